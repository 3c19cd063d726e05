// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include <toftwin/result.h>

#include "calib/discover/campaign/captures/campaign.h"

namespace toftwin::discover {

/// An error that names its capture.
Error ofCapture(const plan::CaptureRecord& record, const std::string& message,
                Error::Code code = Error::Code::Malformed);

/// "1 capture", "2 captures".
std::string howMany(std::size_t count, const std::string& what);

inline constexpr std::size_t kFewestRepeats = 2;  ///< without repeats nothing is known of the noise

/// Frames of one thing in one place, one after the other: their means and their noise.
class CaptureGatherer {
 public:
  /// `without`: frames of that class are passed over, unless fewer than two would be left.
  explicit CaptureGatherer(const plan::CaptureRecord& record, const std::optional<FrameClass>& without = {});
  CaptureGatherer(CaptureGatherer&&) noexcept;
  CaptureGatherer& operator=(CaptureGatherer&&) noexcept;
  ~CaptureGatherer();

  /// Errors name the capture: no range, another camera than the frames before it.
  Result<> add(const Frame& frame);
  [[nodiscard]] std::size_t frames() const;  ///< that are in the means
  [[nodiscard]] const CameraInfo& camera() const;
  /// The capture; two frames at least must have been added, and none may be from now on.
  MeasuredCapture finish();

 private:
  struct State;
  [[nodiscard]] State& chosen() const;
  std::unique_ptr<State> kept_, all_;  ///< the latter as long as the former has no repeats
  std::optional<FrameClass> without_{};
  std::size_t place_ = 0;  ///< of the next frame, with those that are passed over
};

}  // namespace toftwin::discover
