// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/looks.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "calib/intrinsics/median.h"

namespace toftwin::intrinsics {

Span spanOf(const Image<float>& image) {
  std::vector<float> values;
  for (const float value : image.pixels()) {
    if (std::isfinite(value) && value > 0.0F) values.push_back(value);
  }
  if (values.size() < 16) return {};
  std::ranges::sort(values);
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(share * double(values.size() - 1))];
  };
  return {at(0.005), at(0.995)};
}

Image<float> mended(const Image<float>& image) {
  constexpr std::size_t kMost = 6;  // of eight neighbours
  Image<float> result = image;
  for (int v = 1; v + 1 < image.height(); ++v) {
    for (int u = 1; u + 1 < image.width(); ++u) {
      if (image(u, v) > 0.0F) continue;
      std::vector<double> around;
      for (int k = 0; k < 9; ++k) {
        const float value = image(u - 1 + k % 3, v - 1 + k / 3);
        if (value > 0.0F) around.push_back(value);
      }
      if (around.size() >= kMost) result(u, v) = static_cast<float>(median(std::move(around)));
    }
  }
  return result;
}

cv::Mat show(const Image<float>& image, const Span& span, const Look& look) {
  cv::Mat shown(image.height(), image.width(), CV_8U);
  const double width = std::max(1e-12F, span.high - span.low);
  for (int v = 0; v < image.height(); ++v) {
    for (int u = 0; u < image.width(); ++u) {
      const float value = image(u, v);
      const double share = std::isfinite(value) ? std::clamp((value - span.low) / width, 0.0, 1.0) : 0.0;
      shown.at<std::uint8_t>(v, u) =
          static_cast<std::uint8_t>(std::lround(255.0 * std::pow(share, look.gamma)));
    }
  }
  if (look.evened) cv::createCLAHE(4.0, {8, 8})->apply(shown, shown);
  if (look.scale > 1) cv::resize(shown, shown, {}, look.scale, look.scale, cv::INTER_CUBIC);
  return shown;
}

std::vector<Pixel> shrunk(const std::vector<cv::Point2f>& points, int scale) {
  std::vector<Pixel> result;
  for (const cv::Point2f& point : points) {
    result.push_back({(point.x + 0.5) / scale - 0.5, (point.y + 0.5) / scale - 0.5});
  }
  return result;
}

}  // namespace toftwin::intrinsics
