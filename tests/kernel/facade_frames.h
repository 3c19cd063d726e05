// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "../daemon/running_daemon.h"
#include "v4l2_cameras.h"

namespace toftwin::kernel_test {

using Codes = std::vector<std::uint16_t>;

inline constexpr std::size_t kFacadeWidth = 64, kFacadeHeight = 48,
                             kFacadePixels = kFacadeWidth * kFacadeHeight;
inline const std::string kFacadePattern =
    fmt::format("[[source]]\nname = 'cam'\ndriver = 'pattern'\nwidth = {}\nheight = {}\nframe_rate_hz = 10\n",
                kFacadeWidth, kFacadeHeight);

/// What docs/facades/usb_camera.md says becomes of a frame.
inline Codes codesOf(const Frame& frame, PlaneKind kind) {
  Codes codes;
  for (const float value : frame.find(kind)->as<float>()) {
    const double count = std::round(static_cast<double>(value) * (kind == PlaneKind::Depth ? 1000.0 : 1.0));
    const bool is_depth_beyond = kind == PlaneKind::Depth && count > 65'535.0;
    codes.push_back(std::isnan(count) || is_depth_beyond
                        ? std::uint16_t{0}
                        : static_cast<std::uint16_t>(std::min(count, 65'535.0)));
  }
  return codes;
}

/// The images of 16 bits in a file.
inline std::vector<Codes> imagesIn(const std::string& file) {
  std::ifstream in{file, std::ios::binary};
  const std::string bytes{std::istreambuf_iterator<char>{in}, {}};
  std::vector<Codes> images(bytes.size() / (2 * kFacadePixels), Codes(kFacadePixels));
  for (std::size_t i = 0; i < images.size(); ++i)
    std::memcpy(images[i].data(), bytes.data() + i * 2 * kFacadePixels, 2 * kFacadePixels);
  return images;
}

/// A daemon whose frames are seen natively, too.
class FacadeFrames : public daemon::test::RunningDaemon {
 protected:
  static constexpr std::chrono::seconds kSoon = daemon::test::kSoon;

  /// All frames from now on, by their depth.
  void collect() {
    native_ = client();
    auto stream = native_->subscribe("cam", {.policy = SubscribeOptions::Policy::Queue, .queue = 1000});
    ASSERT_TRUE(stream.ok()) << stream.error().message;
    natives_.emplace(*std::move(stream));
  }
  /// The place among the native frames of the one with those codes; -1: there is none.
  int placeOf(const Codes& codes, PlaneKind kind = PlaneKind::Depth) {
    const auto same =
        std::ranges::find_if(seen_, [&](const Frame& frame) { return codesOf(frame, kind) == codes; });
    if (same != seen_.end()) return static_cast<int>(same - seen_.begin());
    for (int i = 0; i < 100; ++i) {
      auto next = natives_->next(kSoon);
      if (!next) break;
      seen_.push_back(*std::move(next));
      if (codesOf(seen_.back(), kind) == codes) return static_cast<int>(seen_.size()) - 1;
    }
    return -1;
  }

  std::optional<Client> native_;
  std::optional<Subscription> natives_;
  std::vector<Frame> seen_;
};

}  // namespace toftwin::kernel_test
