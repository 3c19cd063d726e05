// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3d303/auto_exposure.h"

#include <algorithm>
#include <boost/property_tree/json_parser.hpp>
#include <cmath>
#include <sstream>

#include "daemon/facades/frame_views.h"

namespace toftwin::daemon::o3d303 {

ExposureRegion ExposureRegion::around(int x, int y) { return {x - 1, y - 1, x + 1, y + 1}; }

std::optional<ExposureRegion> readExposureRegion(const std::string& json) {
  constexpr std::size_t kLongest = 4096;  // and thereby the deepest
  if (json.size() > kLongest) return std::nullopt;
  boost::property_tree::ptree tree;
  std::istringstream text{json};
  try {
    boost::property_tree::read_json(text, tree);
  } catch (const boost::property_tree::ptree_error&) {
    return std::nullopt;
  }
  const auto all = tree.get_child_optional("ROIs");
  if (!all || all->empty()) return std::nullopt;
  const auto& first = all->front().second;
  const auto numberAt = [&](const char* name) { return first.get_optional<int>(name); };
  const auto x = numberAt("center_x"), y = numberAt("center_y"), width = numberAt("width"),
             height = numberAt("height");
  if (!x || !y || !width || !height) return std::nullopt;
  constexpr int kMost = 8192;
  for (const int one : {*x, *y, *width, *height}) {
    if (one < 0 || one > kMost) return std::nullopt;
  }
  return ExposureRegion{*x - *width / 2, *y - *height / 2, *x + *width / 2, *y + *height / 2};
}

std::optional<double> saturatedShareOf(const Frame& frame, const ExposureRegion& region) {
  const Plane* flags = planeOf(frame, PlaneKind::Flags, ElementType::U8);
  if (flags == nullptr) return std::nullopt;
  const Plane* exposure = planeOf(frame, PlaneKind::Exposure, ElementType::U8);
  const int right = std::min(region.right, frame.camera.width - 1),
            bottom = std::min(region.bottom, frame.camera.height - 1);
  int saturated = 0, all = 0;
  for (int y = std::max(0, region.top); y <= bottom; ++y) {
    for (int x = std::max(0, region.left); x <= right; ++x) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.camera.width) +
                     static_cast<std::size_t>(x);
      const bool is_saturated =
          (flags->as<std::uint8_t>()[i] & static_cast<unsigned>(PixelFlag::Saturated)) != 0;
      // A pixel of a shorter exposure was saturated in the longest.
      const bool is_of_shorter = exposure != nullptr && exposure->as<std::uint8_t>()[i] > 0;
      saturated += is_saturated || is_of_shorter ? 1 : 0;
      ++all;
    }
  }
  if (all == 0) return std::nullopt;
  return static_cast<double>(saturated) / all;
}

std::optional<double> AutoExposure::next(double now_us, double saturated_share, Bounds bounds) {
  constexpr double kTooMany = 0.01, kNearlyNone = 0.001, kShrink = 0.8, kGrow = 1.25, kGrowSlowly = 1.02;
  double wanted_us = now_us;
  if (saturated_share > kTooMany) {
    wanted_us = std::floor(now_us * kShrink);
    has_met_saturation_ = true;
  } else if (saturated_share < kNearlyNone) {
    wanted_us = std::ceil(now_us * (has_met_saturation_ ? kGrowSlowly : kGrow));
  }
  wanted_us = std::floor(std::clamp(wanted_us, bounds.least_us, std::max(bounds.least_us, bounds.most_us)));
  if (wanted_us == std::round(now_us)) return std::nullopt;
  return wanted_us;
}

}  // namespace toftwin::daemon::o3d303
