// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/geometry.h>
#include <toftwin/result.h>

#include "drivers/rig/bus.h"
#include "drivers/rig/rig_file.h"

namespace toftwin::rig {

/// A rig as it stands. What its controller does not say is as if all were well.
struct RigState {
  std::vector<double> positions;  ///< of the axes, in mm or degrees
  bool is_stopped = false;        ///< told to, by whomever
  bool is_emergency = false;
  bool has_fault = false;
  std::optional<double> fault_code;
  bool is_homed = true;
  bool is_in_position = true;
  std::vector<NamedTemperature> temperatures;
};

/// Moves cameras. A motion either ends where it was asked to, or it is stopped and the error says
/// why: an axis that stalls, an exception of the controller, a line that drops, the emergency stop,
/// a fault, the time, or whoever interrupts. Whatever goes wrong, stopping comes first, and whether
/// it worked is the end of the error's message. One thread, which waits in home(), moveAxes() and
/// moveTo().
class Rig {
 public:
  using Interrupted = std::function<bool()>;

  /// Connects and looks whether all that the file names is there; moves nothing.
  static Result<std::unique_ptr<Rig>> open(RigFile file);
  /// For a stop: connects, and looks at nothing.
  static Result<> stopNow(const RigFile& file);

  [[nodiscard]] const RigFile& file() const { return file_; }
  Result<RigState> state();
  /// Tried again over a new line, if need be.
  Result<> stop();
  Result<RigState> home(const Interrupted& interrupted = {});
  /// All axes at once. Where it really stands, when it has settled there.
  Result<RigState> moveAxes(const std::vector<double>& positions,
                            const Interrupted& interrupted = {});
  Result<RigState> moveTo(const Transform<World, Camera>& pose,
                          const Interrupted& interrupted = {});
  [[nodiscard]] Transform<World, Camera> poseAt(const std::vector<double>& positions) const;

  /// Whether a PLC asks for a capture.
  Result<bool> isTriggered();
  /// Tells the PLC that the capture is done, or takes that back.
  Result<> setCaptured(bool is_done);

 private:
  Rig(RigFile file, std::unique_ptr<Bus> bus) : file_(std::move(file)), bus_(std::move(bus)) {}

  Result<> mayMove(const RigState& state) const;
  Result<> release();
  Result<> checkLimits(const std::vector<double>& positions) const;
  Result<> launch(const std::vector<double>& targets);
  Result<RigState> drive(const std::vector<double>& targets, const Interrupted& interrupted);
  Result<RigState> watch(const std::vector<double>& targets, const Interrupted& interrupted);
  Result<RigState> watchHoming(const Interrupted& interrupted);
  Result<RigState> look(const Interrupted& interrupted);
  Error halt(Error why);

  RigFile file_;
  std::unique_ptr<Bus> bus_;
  int beats_ = 0;
  bool may_release_ =
      true;  ///< a stop: from before us, or our own; not one from elsewhere meanwhile
};

}  // namespace toftwin::rig
