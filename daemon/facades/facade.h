// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>
#include <toftwin/units.h>

#include "daemon/clock.h"
#include "daemon/facades/timing/unevenness.h"
#include "daemon/hub.h"
#include "protocol/settings/settings.h"

namespace toftwin::daemon {

/// What every [[facade]] has; the other keys are its kind's.
struct FacadeKeys {
  std::string kind;
  std::string source;
  std::string address = "127.0.0.1";
  bool allow_remote = false;
  std::vector<std::string> allow;
  std::string intervals;
  Duration latency = 0_s;
  Duration boot_time = 0_s;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("kind", kind, "one of the facades below: the language that is spoken");
    v.text("source", source, "name of the [[source]] that is shown");
    v.text("address", address, "where it listens, with the ports of its kind");
    v.flag("allow_remote", allow_remote,
           "allows an address that other machines reach. Whatever the language is, it has no encryption and "
           "at most a password in clear text: everyone who reaches the ports sees the source and can set it. "
           "Only for a network that you trust whole");
    v.texts("allow", allow,
            "whose connections are taken, addresses and networks (\"10.0.0.0/24\"); of this machine always, of others none if "
            "there are some. Of the kinds over TCP, and gige_vision's commands; an address can be forged within a network");
    v.text("intervals", intervals,
           "a file with the intervals between a real camera's frames, one number in milliseconds per line, "
           "relative to this file: frames leave as unevenly as those; empty: as they come");
    v.quantity(
        "latency", latency, millisecond, {0.0, 10'000.0},
        "by how much later than the source's every frame leaves, as if the camera had taken that long");
    v.quantity(
        "boot_time", boot_time, second, {0.0, 600.0},
        "how long nobody answers after the facade's start, and after a reboot that a client asked for, "
        "where the language has such a thing");
  }
};

/// One source in another language, on sockets and a thread of its own. Its destructor closes them.
class Facade {
 public:
  virtual ~Facade() = default;
  /// Where clients find it, for the log: "XML-RPC on 127.0.0.1 port 80".
  [[nodiscard]] virtual std::string where() const = 0;
  /// For health; set by the facade, if its language tells.
  [[nodiscard]] std::shared_ptr<const ClientCount> clients() const { return clients_; }
  [[nodiscard]] std::shared_ptr<const Booting> booting() const { return booting_; }

 protected:
  const std::shared_ptr<ClientCount> clients_ =
      std::make_shared<ClientCount>(-1);  // shared with health, which may ask when this is gone
  const std::shared_ptr<Booting> booting_ = std::make_shared<Booting>(false);  // likewise
};

/// What a facade is started with.
struct FacadePlace {
  FacadeKeys keys;
  Hub& hub;
  const Clock& clock;
  Unevenness unevenness{};  ///< of its `intervals`
};

/// One row of the table of facades.
struct FacadeKind {
  using Start = std::function<Result<std::unique_ptr<Facade>>(const FacadePlace&)>;

  std::string_view name;
  std::string_view summary;
  /// Reads the facade's own keys, tells the table what is wrong with them, and gives what starts it.
  Start (*read)(settings::Table& keys);
  /// The facade's keys as a Markdown table.
  std::string (*document)();
  /// Empty, or why this build lacks it and what to do.
  std::string_view not_built = {};
  /// Of one that shows several: the sources that its keys name beside `source`, and the key that names them.
  struct MoreSources {
    const char* key;
    std::vector<std::string> names;
  };
  MoreSources (*more_sources)(settings::Table keys) = nullptr;
};

/// All facades, in the order of the documents.
std::span<const FacadeKind> allFacades();

}  // namespace toftwin::daemon
