// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "daemon/peer.h"

namespace toftwin::daemon {

/// What a client may do.
struct Grants {
  bool view = false;     ///< see sources and frames
  bool control = false;  ///< set parameters and poses, trigger, hold a source in lockstep
  bool record = false;   ///< begin recordings, and stop its own
  bool admin = false;    ///< all that, and stop the recordings of others
};

/// [[roles.token]]
struct TokenKeys {
  std::string name;
  std::string file;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "by which the roles name whoever has it");
    v.text("file", file, "where the secret is, relative to this file: one line, which nobody else may read");
  }
};

/// [roles]: who may do what.
struct RoleKeys {
  std::vector<std::string> view, control, record, admin;
  std::vector<TokenKeys> tokens;

  template <class Visitor>
  void visit(Visitor& v) {
    v.texts("view", view,
            "who may see sources and frames: \"user:NAME\", \"group:NAME\" (Unix socket), \"token:NAME\", "
            "\"certificate:NAME\" (its common name), \"here\" (every user of this machine), \"anyone\". With no role given "
            "to anybody, whoever can connect may do all but what is admin's");
    v.texts("control", control, "who may also set parameters and poses, trigger, and hold a source in lockstep");
    v.texts("record", record, "who may also begin recordings, and stop their own");
    v.texts("admin", admin,
            "who may do all, and stop the recordings of others; root and the daemon's own user always may");
    v.group("token", tokens, "secrets by which clients over TCP say who they are");
  }
};

/// Who a client is, and what that one may do.
struct Identity {
  std::string name;  ///< "user 1000", "token:cell3", "certificate:plc", or an address
  Grants grants;
};

/// The roles of a configuration. May be used from any thread.
class Access {
 public:
  /// Whoever can connect may do all but what is admin's.
  Access() = default;
  /// All that is wrong, each told to `complain` with its key under [roles].
  using Complain = std::function<void(const std::string& key, const std::string& what)>;
  static Access read(const RoleKeys& keys, const std::function<std::filesystem::path(const std::string&)>& resolve,
                     const Complain& complain);

  /// `certificate`: the common name of one that was checked, or empty. Error PermissionDenied: a token that nobody has, or
  /// someone who may not even view.
  [[nodiscard]] Result<Identity> identify(const Peer& peer, const std::string& token,
                                          const std::string& certificate) const;
  /// Whether anybody has a role by name.
  [[nodiscard]] bool isLimited() const { return is_limited_; }

 private:
  struct Who {
    enum class Kind { User, Group, Token, Certificate, Here, Anyone };
    Kind kind = Kind::Anyone;
    std::uint32_t number = 0;  ///< of a user or group
    std::string name{};        ///< of a token or certificate
  };
  struct Secret {
    std::string name, text;
  };
  static Result<Who> readWho(const std::string& text, const std::vector<TokenKeys>& tokens);
  [[nodiscard]] static bool isOne(const Who& who, const Peer& peer, const std::string& token,
                                  const std::string& certificate);

  bool is_limited_ = false;
  std::vector<Who> view_, control_, record_, admin_;
  std::vector<Secret> secrets_;
};

}  // namespace toftwin::daemon
