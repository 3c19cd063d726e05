// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/overlay.h"

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>

#include "sim/pictures/png.h"

namespace toftwin::intrinsics {
namespace {

constexpr double kMagnification = 50.0, kRed_px = 0.3;
constexpr int kWidth = 1280;

/// Bright enough to see, with the gamma of a screen.
cv::Mat backdrop(const Image<float>& image, int scale) {
  float largest = 0.0F;
  for (const float value : image.pixels()) largest = std::isfinite(value) ? std::max(largest, value) : largest;
  cv::Mat grey(image.height(), image.width(), CV_8U);
  for (int v = 0; v < image.height(); ++v) {
    for (int u = 0; u < image.width(); ++u) {
      const float value = std::isfinite(image(u, v)) ? std::max(0.0F, image(u, v)) : 0.0F;
      const float share = largest > 0.0F ? value / largest : 0.0F;
      grey.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(std::lround(200.0F * std::sqrt(share)));
    }
  }
  cv::Mat large, colour;
  cv::resize(grey, large, {}, scale, scale, cv::INTER_NEAREST);
  cv::cvtColor(large, colour, cv::COLOR_GRAY2BGR);
  return colour;
}

/// A pixel's centre in the enlarged picture.
cv::Point placed(double u, double v, int scale) {
  return {static_cast<int>(std::lround((u + 0.5) * scale - 0.5)), static_cast<int>(std::lround((v + 0.5) * scale - 0.5))};
}

cv::Scalar colourOf(double error_px) {
  const double share = std::clamp(error_px / kRed_px, 0.0, 1.0);
  return {0.0, 255.0 * std::min(1.0, 2.0 - 2.0 * share), 255.0 * std::min(1.0, 2.0 * share)};
}

void write(cv::Mat& picture, const std::string& text, int line) {
  const cv::Point at{8, 22 + 22 * line};
  cv::putText(picture, text, at, cv::FONT_HERSHEY_SIMPLEX, 0.55, {0, 0, 0}, 4, cv::LINE_AA);
  cv::putText(picture, text, at, cv::FONT_HERSHEY_SIMPLEX, 0.55, {255, 255, 255}, 1, cv::LINE_AA);
}

}  // namespace

std::vector<std::byte> overlayPng(const Calibrated& calibrated, std::size_t index, const Image<float>& image) {
  const Sighting& sighting = calibrated.sightings[index];
  const Estimate& estimate = calibrated.estimate;
  const std::string name = sighting.name.substr(sighting.name.rfind('/') + 1);
  const int scale = std::max(1, static_cast<int>(std::lround(static_cast<double>(kWidth) / std::max(1, image.width()))));
  cv::Mat picture = backdrop(image, scale);
  for (const Corner& corner : sighting.corners) {
    cv::circle(picture, placed(corner.at.u, corner.at.v, scale), 4, {255, 200, 0}, 1, cv::LINE_AA);
  }
  const auto used = std::ranges::find(estimate.used, index);
  if (used == estimate.used.end()) {
    write(picture, fmt::format("{}: {} ({})", name, nameOf(sighting.rejection), sighting.detail), 0);
  } else {
    const auto v = static_cast<std::size_t>(used - estimate.used.begin());
    const auto left = residuals(estimate.bundle, estimate.views[v], v);
    for (std::size_t i = 0; i < left.size(); ++i) {
      const Pixel at = estimate.views[v].corners[i].at;
      const cv::Point from = placed(at.u, at.v, scale);
      const cv::Point to = placed(at.u - kMagnification * left[i].x(),
                                  at.v - kMagnification * left[i].y(), scale);
      cv::line(picture, from, to, colourOf(left[i].norm()), 2, cv::LINE_AA);
    }
    write(picture, fmt::format("{}: {:.3f} px RMS, lines are errors x {:.0f}", name, estimate.rms_px[v],
                               kMagnification),
          0);
  }
  return pictures::encodePng(picture);
}

}  // namespace toftwin::intrinsics
