// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "daemon/facades/o3d303/device.h"
#include "daemon/facades/o3d303/images.h"

namespace toftwin::daemon::o3d303 {

/// Makes the source's frames those of the camera, as its active application is set.
class FrameMaker {
 public:
  explicit FrameMaker(double electrons_per_count) : electrons_per_count_(electrons_per_count) {}
  /// What is to be sent, until the next is made. Unsupported: the frame has neither range nor depth.
  Result<const toftwin::o3d303::CameraFrame*> make(const Frame& frame, const Device& device);
  /// The one that was made last; null: none was.
  [[nodiscard]] const toftwin::o3d303::CameraFrame* last() const {
    return images_ ? &images_->wire : nullptr;
  }
  /// How many were made since that application is active, for the command "S?".
  [[nodiscard]] std::uint64_t countOf(int application) const { return application == counted_ ? count_ : 0; }

 private:
  void describe(const Frame& frame, const Device& device, toftwin::o3d303::CameraFrame& wire);

  const double electrons_per_count_;
  std::optional<LensChunks> lens_;
  std::optional<CameraImages> images_;  ///< refers to the lens
  std::optional<std::int64_t> began_ns_;
  double frame_rate_hz_ = 0.0;
  int counted_ = 0;  ///< the active application
  std::uint64_t count_ = 0;
};

}  // namespace toftwin::daemon::o3d303
