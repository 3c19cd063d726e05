// SPDX-License-Identifier: Apache-2.0
#include "uvc_camera.h"

#include <algorithm>

namespace toftwin::kernel_test {
namespace {

using daemon::usb_camera::Picture;
using daemon::usb_camera::UvcLayout;

constexpr std::uint32_t kIntervalUnits = 10;  // of 100 ns in a microsecond

UvcLayout layoutOf(const UvcCamera::Options& options) {
  const auto interval = static_cast<std::uint32_t>(options.interval.count()) * kIntervalUnits;
  UvcLayout layout{.speed = options.speed,
                   .endpoint = options.endpoint,
                   .vendor = "toftwin",
                   .model = UvcCamera::kName,
                   .serial = UvcCamera::kSerial,
                   .streams = {{"Z16 ", UvcCamera::kWidth, UvcCamera::kHeight}},
                   .intervals = {interval, interval, interval},
                   .exposure_100us = {{1, UvcCamera::kMostExposure_100us, UvcCamera::kExposure_100us}},
                   .gain = {{0, UvcCamera::kMostGain, UvcCamera::kGain}}};
  if (options.says_invz) {  // [Linux, UVC_GUID_FORMAT_INVZ]
    layout.streams[0].fourcc = "INVZ";
    layout.streams[0].guid_tail = {0x90, 0x2D, 0x58, 0x4A, 0x92, 0x0B, 0x77, 0x3F, 0x1F, 0x2C, 0x55, 0x6B};
  }
  if (options.has_infrared) layout.streams.push_back({"Y16 ", UvcCamera::kWidth, UvcCamera::kHeight});
  return layout;
}

}  // namespace

UvcCamera::UvcCamera(Options options) : UvcDevice(layoutOf(options)), options_(options) {}

std::uint16_t UvcCamera::codeAt(std::uint32_t frame, std::size_t stream, std::uint32_t x, std::uint32_t y) {
  if (x == 0 && y == 0) return static_cast<std::uint16_t>(frame % 60'000 + 1);
  if (stream == 1) return static_cast<std::uint16_t>(x * 256 + y);
  return static_cast<std::uint16_t>((x + y) % 7 == 0 ? 0 : 1000 + (x + 3 * y + frame) % 500);
}

Answer UvcCamera::setNumber(Number which, std::uint32_t value) {
  (which == Number::Gain ? gain_ : exposure_) = value;
  return {};
}

SteadyTime UvcCamera::nextPictureDue(std::size_t stream) const {
  const auto later = std::chrono::steady_clock::now() + std::chrono::milliseconds{20};
  const auto& next = next_.at(stream);
  return next && !hangs_ && !isSending(stream) ? std::min(later, *next) : later;
}

std::optional<Picture> UvcCamera::nextPicture(std::size_t stream, SteadyTime now) {
  auto& next = next_.at(stream);
  if (!next) next = now;
  if (now < *next || hangs_) return std::nullopt;
  next = std::max(*next + options_.interval, now - options_.interval);
  Writer pixels;
  const std::uint32_t frame = frames_.at(stream)++;
  for (std::uint32_t y = 0; y < kHeight; ++y) {
    for (std::uint32_t x = 0; x < kWidth; ++x) pixels.u16(codeAt(frame, stream, x, y));
  }
  Picture picture{.pixels = pixels.done(), .stamp = clockNow(now)};
  picture.is_damaged = stream == 0 && damaged_ > 0 && damaged_-- > 0;
  const bool is_short = stream == 0 && truncated_ > 0 && truncated_-- > 0;
  if (is_short) picture.pixels.resize(picture.pixels.size() / 2);
  return picture;
}

std::uint32_t UvcCamera::clockNow(SteadyTime now) const {
  const auto since = std::chrono::duration_cast<std::chrono::microseconds>(now.time_since_epoch());
  return static_cast<std::uint32_t>(since.count());
}

}  // namespace toftwin::kernel_test
