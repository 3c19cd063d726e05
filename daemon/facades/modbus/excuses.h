// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

namespace toftwin::daemon::modbus {

/// Frames that a device loses while a recipe or a pose is set are no fault of its own: the PLC asked for it.
/// What is lost from then on until frames come again is excused.
class Excuses {
 public:
  /// Something is set. `lost`: by the device so far.
  void begin(std::uint64_t lost) {
    if (!lost_before_) lost_before_ = lost;
    frames_since_ = 0;
  }
  /// A frame came. The first one may have been made before, so the second one ends it.
  void takeFrame(std::uint64_t lost, bool is_under_way) {
    if (!lost_before_) return;
    if (is_under_way) frames_since_ = 0;
    if (is_under_way || ++frames_since_ < 2) return;
    if (lost > *lost_before_) excused_ += lost - *lost_before_;
    lost_before_.reset();
  }
  /// How many of them are not excused.
  [[nodiscard]] std::uint64_t countOf(std::uint64_t lost) const {
    const std::uint64_t counted = lost_before_.value_or(lost);
    return counted > excused_ ? counted - excused_ : 0;
  }

 private:
  std::optional<std::uint64_t> lost_before_;  ///< while something is set
  std::uint64_t excused_ = 0;
  int frames_since_ = 0;
};

}  // namespace toftwin::daemon::modbus
