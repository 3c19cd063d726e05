// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <toftwin/parameter.h>
#include <toftwin/result.h>

#include "daemon/clock.h"
#include "drivers/o3d303/wire/schema.h"
#include "drivers/o3d303/wire/xmlrpc.h"

namespace toftwin::daemon::o3d303 {

using Parameters = std::map<std::string, std::string>;

/// Faults, by the vendor's numbers.
struct Fault {
  static constexpr int kNoSuchMethod = -506;  // of XML-RPC itself
  static constexpr int kInternal = -500;
  static constexpr int kNoSuchObject = 100'000;  // a session that ended among them
  static constexpr int kNoSuchParameter = 101'000;
  static constexpr int kWrongType = 101'001;
  static constexpr int kOutOfRange = 101'002;
  static constexpr int kReadOnly = 101'003;
  static constexpr int kSessionExists = 101'004;
  static constexpr int kWrongPassword = 101'005;
  static constexpr int kWrongFormat = 101'010;
  static constexpr int kNoSuchApplication = 101'013;
  static constexpr int kApplicationInEdit = 101'014;
  static constexpr int kTooManyApplications = 101'015;
  static constexpr int kNoApplicationInEdit = 101'016;
  static constexpr int kWrongImagerType = 101'027;
  static constexpr int kWrongApplicationType = 101'028;
};

/// What the camera's parameters stand for, as it is now.
struct SourceFacts {
  std::vector<Parameter> parameters;
  std::optional<double> frame_rate_hz;
  bool can_trigger = false;
  int width = 176, height = 132;
  std::vector<std::uint32_t> exposures_us;  ///< the different ones, shortest first
  int frequencies = 1;
  std::optional<double> illumination_c;
  double since_power_on_s = 0.0;
  std::int64_t device_s = 0;  ///< the clock of the frames
};

/// What a client's wish makes of the source: its parameters' names and values.
using SourceChanges = std::vector<std::pair<std::string, double>>;

/// The camera's XML-RPC objects without a network or a source: parameters, applications, sessions, edit mode.
class Device {
 public:
  struct Identity {
    std::string name, password, mac, address;
    int xmlrpc_port = 80, pcic_port = 50'010;
  };
  /// What a call comes to. The changes are to be made before the answer is given; if the source refuses them,
  /// the answer is a fault instead, and the parameters show what the source has.
  struct Outcome {
    toftwin::o3d303::XmlRpcAnswer answer;
    SourceChanges changes{};
    bool has_saved = false;  ///< clients are told that the application changed
    bool is_reboot = false;
  };

  explicit Device(Identity identity);

  /// Any path and call are safe.
  Outcome answer(std::string_view path, const toftwin::o3d303::XmlRpcCall& call, SteadyTime now);
  /// What the source has now is what the parameters show.
  void update(const SourceFacts& facts);
  /// Ends a session that has not been heard of for too long. What it had set for itself is undone.
  SourceChanges expire(SteadyTime now);
  /// As after switching off and on: no session, nothing that was not saved.
  void restart();

  /// While a client edits, the camera takes no frames.
  [[nodiscard]] bool isEditing() const { return is_editing_; }
  /// What connections get that have asked for nothing yet.
  [[nodiscard]] const toftwin::o3d303::Schema& defaultSchema() const { return default_schema_; }
  [[nodiscard]] std::array<float, 3> translation_mm() const;
  [[nodiscard]] int activeApplication() const;
  [[nodiscard]] std::vector<int> applications() const;
  [[nodiscard]] const Parameters& parameters() const { return device_; }

 private:
  struct Application {
    Parameters application, imager;
  };
  struct Session {
    std::string id;
    std::chrono::seconds timeout;
    SteadyTime ends;
    Parameters before;  ///< of the imager: what was set for the session only
  };
  using Answer = toftwin::o3d303::XmlRpcAnswer;
  using Call = toftwin::o3d303::XmlRpcCall;

  Outcome onMain(const Call& call, SteadyTime now);
  Outcome onSession(const Call& call, SteadyTime now);
  Outcome onEdit(const Call& call);
  Outcome onDeviceParameters(const Call& call);
  Outcome onNetwork(const Call& call);
  Outcome onTime(const Call& call) const;
  Outcome onApplication(const Call& call);
  Outcome onImager(const Call& call);
  Outcome inSession(std::string_view object, const Call& call, SteadyTime now);
  Outcome requestSession(const Call& call, SteadyTime now);
  Outcome setTemporarily(const Call& call);
  Outcome cancelSession();
  Outcome setMode(const Call& call);
  Outcome saveApplication();
  Outcome saveDevice();
  Outcome activate(int index);
  std::optional<Answer> setDeviceParameter(const std::string& name, const std::string& value);
  std::optional<Answer> setApplicationParameter(const std::string& name, const std::string& value);
  std::optional<Answer> setImagerParameter(Parameters& imager, const std::string& name,
                                           const std::string& value);
  std::optional<Answer> checkBound(std::string_view source_name, const std::string& value,
                                   bool is_integral) const;
  [[nodiscard]] const Parameter* parameterOf(std::string_view source_name) const;
  [[nodiscard]] SourceChanges changesTo(const Application& wanted) const;
  void show(Application& application) const;
  void createApplication(int index);
  [[nodiscard]] int freeIndex() const;
  void refreshSchema();

  const Identity identity_;
  SourceFacts facts_;
  Parameters device_, edited_device_;
  std::map<int, Application> applications_;
  std::optional<std::pair<int, Application>> edited_;
  std::optional<Session> session_;
  bool is_editing_ = false;
  std::string password_;
  toftwin::o3d303::Schema default_schema_;
};

}  // namespace toftwin::daemon::o3d303
