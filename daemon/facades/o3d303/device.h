// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <toftwin/parameter.h>
#include <toftwin/result.h>

#include "daemon/clock.h"
#include "daemon/facades/o3d303/auto_exposure.h"
#include "daemon/facades/o3d303/bindings.h"
#include "daemon/facades/o3d303/binning.h"
#include "daemon/facades/o3d303/clipping.h"
#include "daemon/facades/o3d303/rules.h"
#include "daemon/facades/source_changes.h"
#include "drivers/o3d303/wire/extrinsics.h"
#include "drivers/o3d303/wire/schema.h"
#include "drivers/o3d303/wire/xmlrpc.h"

namespace toftwin::daemon::o3d303 {

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
  static constexpr int kNoReboot = 101'007;
  static constexpr int kWrongFormat = 101'010;
  static constexpr int kWrongImportFlags = 101'012;
  static constexpr int kNoSuchApplication = 101'013;
  static constexpr int kApplicationInEdit = 101'014;
  static constexpr int kTooManyApplications = 101'015;
  static constexpr int kNoApplicationInEdit = 101'016;
  static constexpr int kWrongImagerType = 101'027;
  static constexpr int kWrongApplicationType = 101'028;
  static constexpr int kFilterAgainstTrigger = 101'036;
  static constexpr int kWrongNetwork = 101'051;
  static constexpr int kNoAutoExposure = 101'056;
};

/// What the camera's parameters stand for, as it is now.
struct SourceFacts {
  std::vector<Parameter> parameters;
  std::optional<double> frame_rate_hz;
  bool can_trigger = false;
  int width = 176, height = 132;
  std::vector<std::uint32_t> exposures_us;  ///< the different ones, shortest first
  int frequencies = 1;
  std::optional<double> illumination_c, housing_c, processor_c;
  double since_power_on_s = 0.0;
  std::int64_t device_s = 0;  ///< the clock of the frames
  /// This machine's clock, where its relation to that of the frames is known.
  std::optional<std::int64_t> host_ns;
};

/// The camera's XML-RPC objects without a network or a source: parameters, applications, sessions, edit mode.
class Device {
 public:
  struct Identity {
    std::string name, password, mac, address;
    int xmlrpc_port = 80, pcic_port = 50'010;
    double electrons_per_count = 6.0;
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
  SourceChanges restart();

  /// While a client edits, and while no application is active, the camera takes no frames.
  [[nodiscard]] bool isIdle() const { return is_editing_ || !applications_.contains(activeApplication()); }
  [[nodiscard]] bool isEditing() const { return is_editing_; }
  /// What connections get that have asked for nothing yet, and as a client wrote it.
  [[nodiscard]] const toftwin::o3d303::Schema& defaultSchema() const { return default_schema_; }
  [[nodiscard]] std::string defaultSchemaText() const;
  /// What a client has set; the optics themselves stand where the camera does.
  [[nodiscard]] toftwin::o3d303::ExtrinsicCalibration extrinsics() const;
  /// Of the active application.
  [[nodiscard]] const Clipping& clipping() const { return clipping_; }
  /// By how much a client has set the camera's clock against this machine's, which it follows from then on. 0
  /// while it is to be that of the network, which here is this machine's. Nothing: neither was done.
  [[nodiscard]] std::optional<std::int64_t> hostShift_ns() const;
  /// By how much a client has set it against the source's, where its relation to this machine's is not known.
  [[nodiscard]] std::int64_t clockShift_s() const { return clock_shift_s_; }
  /// Whether the active application has half the source's rows and columns.
  [[nodiscard]] std::optional<Binning> binning() const;
  /// How the active application chooses the exposure by itself; nothing: it does not.
  struct ExposureControl {
    ExposureRegion region{};
    AutoExposure::Bounds bounds{};
  };
  [[nodiscard]] std::optional<ExposureControl> exposureControl() const;
  /// Makes an application active by the process interface. Nothing: there is none, or not now.
  std::optional<Outcome> select(int index);
  /// 0: none.
  [[nodiscard]] int activeApplication() const;
  [[nodiscard]] std::vector<int> applications() const;
  [[nodiscard]] const Parameters& parameters() const { return device_; }
  [[nodiscard]] const Parameters& network() const { return network_; }
  /// Whether a frame comes when a client of the process interface asks for one; else it runs freely, or waits
  /// for an edge of its wire.
  [[nodiscard]] bool isTriggeredByCommand() const;

 private:
  static constexpr int kMostApplications = 32;
  /// From so many columns on the source is what the camera calls resolution 1.
  static constexpr int kFineWidth = 352;
  struct Application {
    Parameters application, imager, spatial, temporal;
    int width = 176, height = 132;  ///< that the clipping is of
    bool has_resolution = false;    ///< a client has chosen it
    /// What the source had when the parameter was shown with that text, which may be rounded.
    struct Shown {
      std::string text;
      double number = 0.0;
    };
    std::map<std::string_view, Shown> shown{};  ///< by the source's name of it
  };
  struct Session {
    std::string id;
    std::chrono::seconds timeout;
    SteadyTime ends;
    SourceChanges before;  ///< what was set for the session only, as it was
  };
  using Answer = toftwin::o3d303::XmlRpcAnswer;
  using Call = toftwin::o3d303::XmlRpcCall;
  using Value = toftwin::o3d303::XmlRpcValue;
  using Refusal = std::optional<Answer>;

  // device.cpp: objects that anybody may ask, and sessions
  Outcome onMain(const Call& call, SteadyTime now);
  Outcome onSession(const Call& call, SteadyTime now);
  Outcome inSession(std::string_view object, const Call& call, SteadyTime now);
  Outcome requestSession(const Call& call, SteadyTime now);
  Outcome heartbeat(const Call& call, SteadyTime now);
  Outcome setTemporarily(const Call& call);
  Outcome cancelSession();
  Outcome setMode(const Call& call);
  static Outcome reboot(const Call& call);
  [[nodiscard]] Value applicationList() const;
  [[nodiscard]] Parameters versions() const;

  // device_edit.cpp: edit mode, and the device's own parameters
  Outcome onEdit(const Call& call);
  Outcome addApplication(const Call& call);
  Outcome nameApplication(const Call& call);
  Outcome deleteApplication(int index);
  Outcome factoryReset();
  Outcome onDeviceParameters(const Call& call);
  Outcome onNetwork(const Call& call);
  Outcome onTime(const Call& call);
  Outcome setClock(const Call& call);
  Refusal setDeviceParameter(const std::string& name, std::string value);
  Refusal setNetworkParameter(const std::string& name, std::string value);
  Refusal setTimeParameter(const std::string& name, std::string value);
  Outcome saveDevice();
  Outcome activate(int index);
  int createApplication(Application made);
  [[nodiscard]] Application freshApplication() const;
  [[nodiscard]] Parameters shownDevice() const;
  [[nodiscard]] Parameters shownNetwork() const;
  [[nodiscard]] Parameters shownTime() const;
  [[nodiscard]] std::int64_t clockNow_s() const;

  // device_application.cpp: the application that is edited, its imager and filters
  Outcome onApplication(const Call& call);
  Outcome onImager(const Call& call);
  Outcome onFilter(const Call& call, Binding::Object object);
  Outcome saveApplication();
  [[nodiscard]] Refusal setApplicationParameter(Application& of, const std::string& name,
                                                std::string value) const;
  [[nodiscard]] Refusal setImagerParameter(Application& of, const std::string& name, std::string value) const;
  [[nodiscard]] Refusal setFilterParameter(Application& of, Binding::Object object, const std::string& name,
                                           std::string value) const;
  [[nodiscard]] Refusal setSpecial(Application& of, const std::string& name, std::string value) const;
  [[nodiscard]] Refusal setResolution(Application& of, const std::string& value) const;
  [[nodiscard]] Refusal setBound(Parameters& all, Binding::Object object, const Rule& rule,
                                 std::string value) const;
  [[nodiscard]] Refusal setType(Application& of, std::string_view text) const;
  [[nodiscard]] std::vector<std::string> availableTypes() const;
  [[nodiscard]] std::map<std::string, Bounds> boundsOf(const Parameters& all, Binding::Object object,
                                                       std::span<const Rule> rules) const;
  static const Parameters& of(const Application& application, Binding::Object object);
  static Parameters& of(Application& application, Binding::Object object) {
    return const_cast<Parameters&>(of(std::as_const(application), object));
  }
  void fitExposures(Application& application) const;
  [[nodiscard]] static Refusal checkFilter(const Application& application);

  // device_source.cpp: what the source has, and what is to become of it
  [[nodiscard]] const Parameter* parameterOf(std::string_view source_name) const;
  [[nodiscard]] std::optional<Bound> boundOf(Binding::Object object, std::string_view name) const;
  [[nodiscard]] SourceChanges changesTo(const Application& wanted) const;
  [[nodiscard]] std::optional<double> numberOf(const Application& application, const Bound& bound) const;
  enum class RateShown { AsSource, AsWished };
  void show(Application& application, RateShown rate_shown = RateShown::AsWished) const;
  void showSize(Application& application) const;
  void showFrameRate(Application& application, RateShown rate_shown) const;
  [[nodiscard]] std::optional<double> frameRateFor(const Application& application) const;
  void refreshActive();
  [[nodiscard]] Clipping clippingOf(const Application& application) const;

  // device_transfer.cpp: whole applications and configurations as bytes
  Outcome exportApplication(const Call& call) const;
  Outcome importApplication(const Call& call);
  Outcome exportConfiguration() const;
  Outcome importConfiguration(const Call& call);
  [[nodiscard]] static Value valueOf(const Application& application);
  [[nodiscard]] std::variant<Application, Answer> applicationOf(const Value& value) const;

  const Identity identity_;
  SourceFacts facts_;
  Parameters device_, edited_device_, network_, edited_network_, time_, edited_time_;
  std::map<int, Application> applications_;
  Application live_;                    ///< what the source has now
  std::optional<Application> factory_;  ///< what it had when it was first seen
  std::optional<std::pair<int, Application>> edited_;
  std::optional<Session> session_;
  bool is_editing_ = false;
  std::string password_, edited_password_;
  std::int64_t clock_shift_s_ = 0;
  std::optional<std::int64_t> host_shift_ns_;
  toftwin::o3d303::Schema default_schema_;
  Clipping clipping_;
};

}  // namespace toftwin::daemon::o3d303
