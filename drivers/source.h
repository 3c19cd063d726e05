// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/parameter.h>
#include <toftwin/result.h>

#include "protocol/settings/settings.h"

namespace toftwin::drivers {

/// What an opened camera is and can do. Constant while it is open, but for planes, frame_interval and can_trigger
/// where parameters set them, and for planes where another program does: from the frame on that has them.
struct SourceInfo {
  std::string driver;  ///< name of the driver's row
  std::string model;   ///< "Microsoft Kinect v2 (simulated)"
  std::string serial;
  FrameKind kind = FrameKind::Real;
  CameraInfo camera;
  std::vector<PlaneKind> planes;
  std::optional<Duration> frame_interval;  ///< nominal; none if it comes as it comes
  bool can_set_pose = false;
  bool can_trigger = false;
  bool can_lockstep = false;  ///< makes a frame only when asked: simulators and recordings
  std::vector<std::string> parameters;  ///< names that setParameter and setParameterText take
};

/// What can be set, as it is set now.
struct SourceState {
  std::vector<Parameter> parameters;  ///< those of info(), in that order
  std::optional<Transform<World, Camera>> world_from_camera;  ///< of the next frame
};

/// An opened camera. One thread owns it and makes every call but the destructor's stop request.
class Source {
 public:
  virtual ~Source() = default;

  [[nodiscard]] virtual const SourceInfo& info() const = 0;

  /// Starts streaming; called again after stop() it starts anew, with device time still increasing.
  virtual Result<> start() = 0;
  virtual void stop() = 0;

  /// Waits for the next frame. The source fills everything but `source`, `sequence`,
  /// `dropped_before` and `moment.received`, which are the daemon's (except that a replayed frame
  /// keeps the recorded `received`). Errors: Stopped (soon after the token asks), EndOfStream,
  /// Disconnected (the daemon reopens it), Timeout (asked again; to be given after a second without
  /// a frame, at the latest). In free run a source paces itself; `lockstep` says that the caller
  /// does, so don't wait. The daemon also uses the token to interrupt a wait when it has a command
  /// for the source, and then calls again: a wait that is cut short loses no frame.
  virtual Result<Frame> next(std::stop_token stop, bool lockstep) = 0;

  /// Asked after every change by one of the following. By default the names alone.
  [[nodiscard]] virtual SourceState state() const;

  virtual Result<> setPose(const Transform<World, Camera>& world_from_camera);
  virtual Result<> setParameter(std::string_view name, double value);
  /// Of a parameter whose state has a text; those of most cameras are numbers.
  virtual Result<> setParameterText(std::string_view name, std::string_view text);
  virtual Result<> trigger();
};

/// InvalidArgument unless it is a unit quaternion (within 1e-6) and finite metres: what setPose() takes at most.
Result<> checkPose(const Transform<World, Camera>& world_from_camera);

/// For what goes wrong at opening a device once the keys were checked: that it does not take a value is its
/// answer and no mistake of the file, which InvalidArgument would say. Incompatible instead.
Error answerAtOpening(Error error);

/// One row of the driver table.
struct Driver {
  std::string_view name;
  std::string_view summary;
  /// URIs of the cameras that are there now ("pattern:0"); what `toftwin list --drivers` shows. A
  /// driver that lists cameras reads the key `uri`, and opens each with that key alone.
  std::vector<std::string> (*list)();
  /// Opens a camera by the keys of its [[source]] table; the driver reads its own keys and thereby
  /// ticks them off, so that what is left over is an unknown key. What it complains about to `keys` makes the
  /// daemon refuse the file; any error alone is a camera that is not there, and is tried again.
  Result<std::unique_ptr<Source>> (*open)(settings::Table& keys);
  /// The driver's keys as a Markdown table, for the documents.
  std::string (*document)();
  /// Empty, or why this build lacks it and what to do: "not built: install libopenni2-dev and …".
  std::string_view not_built = {};
  /// What a listed camera can be set to, a line each, for people; null: the driver does not know.
  std::vector<std::string> (*formats)(const std::string& uri) = nullptr;
};

/// All drivers of this build, in the order of the documents.
std::span<const Driver> allDrivers();

}  // namespace toftwin::drivers
