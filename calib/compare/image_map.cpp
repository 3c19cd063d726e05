// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "calib/compare/plot.h"
#include "calib/compare/report.h"
#include "sim/pictures/png.h"

namespace toftwin::compare {
namespace {

using Rgb = std::array<double, 3>;

/// Nine samples of Matplotlib's viridis (CC0), linearly interpolated: at most 2 % off in any
/// channel.
constexpr std::array<Rgb, 9> kSequential{{{68, 1, 84},
                                          {71, 44, 122},
                                          {59, 81, 139},
                                          {44, 113, 142},
                                          {33, 144, 141},
                                          {39, 173, 129},
                                          {92, 200, 99},
                                          {170, 220, 50},
                                          {253, 231, 37}}};
/// Blue over near-white to vermillion: the ends are Okabe and Ito's, told apart by all readers.
constexpr std::array<Rgb, 5> kDiverging{
    {{0, 70, 140}, {90, 165, 215}, {245, 245, 242}, {240, 150, 90}, {165, 55, 0}}};

template <std::size_t N>
Rgb blend(const std::array<Rgb, N>& stops, double share) {
  const double place = std::clamp(share, 0.0, 1.0) * static_cast<double>(N - 1);
  const auto below = std::min(static_cast<std::size_t>(place), N - 2);
  const double rest = place - static_cast<double>(below);
  Rgb rgb;
  for (std::size_t c = 0; c < 3; ++c)
    rgb[c] = stops[below][c] + rest * (stops[below + 1][c] - stops[below][c]);
  return rgb;
}

Rgb colour(const ImageMap& map, double share) {
  return map.diverging ? blend(kDiverging, share) : blend(kSequential, share);
}

std::string png(const cv::Mat& bgra) {
  const std::vector<std::byte> bytes = pictures::encodePng(bgra, {}, 9);
  return "data:image/png;base64," +
         base64({reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()});
}

cv::Vec4b pixel(Rgb rgb) {
  const auto byte = [](double v) { return static_cast<unsigned char>(std::lround(v)); };
  return {byte(rgb[2]), byte(rgb[1]), byte(rgb[0]), 255};
}

}  // namespace

std::string toSvg(const ImageMap& map) {
  const int width = map.values.width(), height = map.values.height();
  cv::Mat picture(height, width, CV_8UC4, cv::Scalar::all(0));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double v = static_cast<double>(map.values(x, y));
      if (std::isfinite(v))
        picture.at<cv::Vec4b>(y, x) = pixel(colour(map, (v - map.low) / (map.high - map.low)));
    }
  }
  cv::Mat bar(128, 1, CV_8UC4);
  for (int y = 0; y < 128; ++y) bar.at<cv::Vec4b>(y, 0) = pixel(colour(map, 1.0 - y / 127.0));
  constexpr double kWide = 340.0;
  const double tall = kWide * height / std::max(1, width), bar_x = kWide + 16;
  std::string svg =
      fmt::format("<div class='plot map'><svg viewBox='0 0 {} {:.1f}' role='img' aria-label='{}'>",
                  kWide + 96, tall + 12, escaped(map.title));
  svg += fmt::format("<rect class='nothing' x='0' y='6' width='{}' height='{:.1f}'/>", kWide, tall);
  svg += fmt::format(
      "<image x='0' y='6' width='{}' height='{:.1f}' preserveAspectRatio='none' "
      "style='image-rendering:pixelated' href='{}'/>",
      kWide, tall, png(picture));
  svg += fmt::format(
      "<image x='{}' y='6' width='16' height='{:.1f}' preserveAspectRatio='none' href='{}'/>",
      bar_x, tall, png(bar));
  for (const double v : roundTicks(map.low, map.high, 6)) {
    const double y = 6 + tall * (1.0 - (v - map.low) / (map.high - map.low));
    svg += fmt::format("<text class='tick' x='{:.1f}' y='{:.1f}'>{}</text>", bar_x + 22,
                       std::clamp(y + 5, 18.0, tall + 6), shownDigits(v, 4));
  }
  svg += fmt::format(
      "<text class='label' text-anchor='middle' transform='translate({:.1f} {:.1f}) "
      "rotate(-90)'>{}</text>",
      kWide + 86, tall / 2 + 6, escaped(map.label));
  return svg + "</svg></div>";
}

}  // namespace toftwin::compare
