// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/parameter.h>

#include "daemon/facades/source_changes.h"
#include "drivers/visionary/wire/cola2.h"
#include "drivers/visionary/wire/password.h"

namespace toftwin::daemon::visionary {

using toftwin::visionary::Bytes;
using toftwin::visionary::ColaCommand;
using toftwin::visionary::ColaError;
using toftwin::visionary::UserLevel;

inline constexpr const char* kIdent = "Visionary-T Mini CX V3S105-1x";
inline constexpr const char* kFirmware = "3.0.0.2334";

/// What of the source the camera's variables show.
struct SourceFacts {
  std::vector<Parameter> parameters{};
  std::optional<double> frame_interval_us{};
  bool can_trigger = false;
  double temperature_c = 0.0;
};

enum class FrontendMode : std::uint8_t { Continuous = 0, Stop = 1, ExternalTrigger = 2 };

/// The camera's variables and methods without a network or a source.
class Device {
 public:
  struct Identity {
    std::string serial, address;
    int stream_port = 2114;
    std::map<UserLevel, std::string> passwords;
  };
  explicit Device(Identity identity) : identity_(std::move(identity)) {}

  /// Who asks: what a session has become by its commands.
  struct Client {
    UserLevel level = UserLevel::Run;
    std::vector<std::uint8_t> challenge{}, salt{};
  };
  /// What a command is answered, and what it makes of the camera and of the source.
  struct Outcome {
    Bytes answer;
    SourceChanges changes{};
    std::optional<int> frames{};  ///< how many are to be sent; -1: without end
  };
  Outcome answer(const ColaCommand& command, Client& client);
  void update(SourceFacts facts) { facts_ = std::move(facts); }
  [[nodiscard]] FrontendMode mode() const { return mode_; }
  /// Which pixels are zero: those whose flags say that they are no good.
  [[nodiscard]] bool masksDepth() const { return masks_depth_; }

 private:
  using Told = std::optional<Bytes>;
  Outcome read(const ColaCommand& command) const;
  Outcome write(const ColaCommand& command, const Client& client);
  Outcome call(const ColaCommand& command, Client& client);
  Outcome logIn(const ColaCommand& command, Client& client);
  [[nodiscard]] Outcome challenge(const ColaCommand& command, Client& client) const;
  [[nodiscard]] const Parameter* parameter(std::string_view name) const;
  [[nodiscard]] Told identityVariable(std::string_view name) const;
  [[nodiscard]] Told stateVariable(std::string_view name) const;
  [[nodiscard]] Told sourceVariable(std::string_view name) const;
  std::optional<ColaError> writeSwitch(const ColaCommand& command);
  /// Nothing: it is no variable of the source's.
  std::optional<Outcome> writeSource(const ColaCommand& command) const;

  Identity identity_;
  SourceFacts facts_;
  FrontendMode mode_ = FrontendMode::Continuous;
  bool masks_depth_ = true;
  /// How far below the limit a real camera warns; kept for who reads it back.
  std::int16_t temperature_margin_c_ = 5;
  std::map<std::string, std::uint8_t, std::less<>> functions_{{"DIO1Fnc", 0}, {"DIO2Fnc", 0}};
};

}  // namespace toftwin::daemon::visionary
