// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/facades/o3r/configuration.h"
#include "daemon/facades/o3r/identity.h"
#include "daemon/facades/o3r/parameters.h"
#include "daemon/facades/o3r/sealed_box.h"
#include "daemon/facades/source_changes.h"
#include "drivers/o3d303/wire/xmlrpc.h"
#include "drivers/o3r/wire/head_info.h"

namespace toftwin::daemon::o3r {

/// Faults, by the numbers that the maker's cameras have.
struct Fault {
  static constexpr int kNoSuchMethod = -506;  // of XML-RPC itself
  static constexpr int kInternal = -500;
  static constexpr int kNoSuchObject = 100'000;
  static constexpr int kNoSuchParameter = 101'000;
  static constexpr int kOutOfRange = 101'002;
  static constexpr int kReadOnly = 101'003;
  static constexpr int kWrongPassword = 101'005;
  static constexpr int kNoReboot = 101'007;
  static constexpr int kWrongFormat = 101'010;
};
toftwin::o3d303::XmlRpcFault faultOf(const Error& error);

/// What of the unit changes by itself.
struct UnitFacts {
  std::int64_t host_ns = 0, since_boot_ns = 0;
  std::vector<std::pair<std::string, double>> temperatures_c{};
  std::map<int, PortFacts> ports{};
};

/// How a head is set that the source knows nothing of.
struct HeadSettings {
  bool is_running = true, tells_algorithm = false;
  toftwin::o3r::OpticToUser optic_to_user{};
  std::string mode{};
};

/// The unit's XML-RPC objects without a network or a source: the configuration and what can be done with it.
class Device {
 public:
  Device(const Identity& identity, std::vector<PortIdentity> ports, double electrons_per_count);

  /// What a call is answered, and what it sets of the source at each port. Any call is safe.
  struct Outcome {
    toftwin::o3d303::XmlRpcAnswer answer;
    std::map<int, SourceChanges> changes{};
    bool is_reboot = false;
  };
  Outcome answer(std::string_view path, const toftwin::o3d303::XmlRpcCall& call);
  void update(const UnitFacts& facts);
  /// After a reboot all is as it was saved last, or as in the factory.
  std::map<int, SourceChanges> restart();

  [[nodiscard]] const std::vector<PortIdentity>& ports() const { return ports_; }
  [[nodiscard]] HeadSettings head(int port) const;

 private:
  using Call = toftwin::o3d303::XmlRpcCall;
  using Answer = toftwin::o3d303::XmlRpcAnswer;

  Outcome answerMain(const Call& call);
  std::optional<Outcome> answerConfiguration(const Call& call);
  std::optional<Answer> answerQuestion(const Call& call) const;
  Answer answerDiagnostic(const Call& call) const;
  Outcome set(const std::string& text);
  Outcome setSealed(const std::string& message);
  Outcome setTree(const Json& tree, bool is_sealed);
  /// The tree has the changes, and the sources will.
  Outcome make(const Result<Configuration::Changes>& changes);
  Answer saveInit(const std::vector<std::string>& pointers);
  Answer lock(const std::string& password);
  Answer unlock(const std::string& password);
  [[nodiscard]] Json diagnostic() const;
  void showBox();

  std::vector<PortIdentity> ports_;
  double electrons_per_count_;
  Configuration configuration_;
  Json init_ = Json::object();
  SealedBox box_;
  std::string lock_password_;
  bool is_locked_ = false;
  std::map<int, PortFacts> facts_;
  std::int64_t host_ns_ = 0;
};

}  // namespace toftwin::daemon::o3r
