// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3d303/frame_maker.h"

#include <algorithm>
#include <utility>

#include "daemon/facades/o3d303/binning.h"
#include "daemon/facades/o3d303/frame_timing.h"

namespace toftwin::daemon::o3d303 {
namespace {

constexpr std::int64_t kPerSecond_ns = 1'000'000'000;

/// The camera's clock is the source's until a client sets it, or has it follow the network's: then it is this
/// machine's, by as much apart as it was set.
void setClockOf(const Frame& frame, const Device& device, toftwin::o3d303::CameraFrame& wire) {
  const ClockRelation& clock = frame.moment.clock;
  std::int64_t shift_ns = device.clockShift_s() * kPerSecond_ns;
  const auto host_shift_ns = device.hostShift_ns();
  if (host_shift_ns && clock.uncertainty_ns >= 0) shift_ns = clock.host_minus_device_ns + *host_shift_ns;
  if (shift_ns == 0) return;
  const std::int64_t ns = std::max<std::int64_t>(
      0, std::int64_t{wire.time.seconds} * kPerSecond_ns + wire.time.nanoseconds + shift_ns);
  wire.time = {static_cast<std::uint32_t>(ns / kPerSecond_ns),
               static_cast<std::uint32_t>(ns % kPerSecond_ns)};
  wire.time_us = static_cast<std::uint32_t>(ns / 1000);
}

}  // namespace

Result<const toftwin::o3d303::CameraFrame*> FrameMaker::make(const Frame& frame, const Device& device) {
  const auto binning = device.binning();
  const Frame small = binning ? binned(frame, *binning) : Frame{};
  const Frame& shown = binning ? small : frame;
  const auto extrinsics = device.extrinsics();
  images_.reset();
  if (!lens_ || lens_->camera != shown.camera || lens_->extrinsics != extrinsics)
    lens_ = lensChunksOf(shown.camera, extrinsics);
  auto images = imagesOf(shown, *lens_, electrons_per_count_);
  if (!images) return images.error();
  if (device.clipping() != Clipping{}) clip(device.clipping(), *images);
  describe(frame, device, images->wire);
  images_ = *std::move(images);
  return &images_->wire;
}

void FrameMaker::describe(const Frame& frame, const Device& device, toftwin::o3d303::CameraFrame& wire) {
  const std::int64_t began_ns =
      std::int64_t{wire.time.seconds} * kPerSecond_ns + wire.time.nanoseconds;  // on the source's clock
  if (began_ns_ && began_ns > *began_ns_) {
    frame_rate_hz_ = static_cast<double>(kPerSecond_ns) / static_cast<double>(began_ns - *began_ns_);
  }
  began_ns_ = began_ns;
  wire.frame_rate_hz = frame_rate_hz_;
  wire.evaluation_ms = FrameTiming::kProcessing.in(millisecond);
  wire.active_application = device.activeApplication();
  count_ = wire.active_application == counted_ ? count_ + 1 : 1;
  counted_ = wire.active_application;
  setClockOf(frame, device, wire);
}

}  // namespace toftwin::daemon::o3d303
