// SPDX-License-Identifier: Apache-2.0
// PNG: 16-bit counts with a stated scale (8-bit for flags), or 8-bit colours. The scale stands in
// the file too, as a tEXt chunk "Description".
#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include <toftwin/names.h>

#include "sim/pictures/png.h"
#include "tools/cli/export/export.h"

namespace toftwin::cli {
namespace {

Result<std::vector<std::byte>> encode(const cv::Mat& image, const std::string& description) {
  if (image.empty()) return Error{Error::Code::Malformed, "an image without pixels cannot be a PNG"};
  return pictures::encodePng(image, description);
}

/// A picture that is nearly all invalid looks like a mistake of this program; it seldom is.
std::string fewValid(const std::vector<float>& values) {
  const auto valid = std::ranges::count_if(values, [](float v) { return !std::isnan(v); });
  if (100 * valid >= static_cast<std::ptrdiff_t>(values.size())) return {};
  return fmt::format("; {} of {} pixels are valid: does the camera look at something in its range?",
                     valid, values.size());
}

Result<Exported> counts(const Picture& picture, const ExportOptions& options) {
  const Plane& plane = *picture.plane;
  const bool is_8bit = plane.type == ElementType::U8;
  const bool is_metres = unitOf(plane.kind) == "m";
  const double per_count = is_metres ? options.mm_per_count / 1000.0 : 1.0;
  constexpr double kMost = std::numeric_limits<std::uint16_t>::max();
  cv::Mat image(plane.height, plane.width, is_8bit ? CV_8U : CV_16U);  // braces would list elements
  std::size_t too_large = 0, negative = 0;
  for (std::size_t i = 0; i < picture.values.size(); ++i) {
    const double count = std::round(static_cast<double>(picture.values[i]) / per_count);
    too_large += count > kMost ? 1 : 0;
    negative += count < 0 ? 1 : 0;
    const double fits = std::isnan(count) ? 0.0 : std::clamp(count, 0.0, kMost);
    if (is_8bit)
      image.data[i] = static_cast<unsigned char>(fits);
    else
      image.ptr<std::uint16_t>()[i] = static_cast<std::uint16_t>(fits);
  }
  std::string note =
      fmt::format("{}: 1 count = {}", nameOf(plane.kind),
                  is_metres ? fmt::format("{:g} mm, 0 = invalid", options.mm_per_count) : "1");
  if (too_large > 0) {
    note += fmt::format("; {} pixels are above {:g}{} and became 65535{}", too_large,
                        kMost * per_count, is_metres ? " m" : "",
                        is_metres ? " (a larger --scale has room for them)" : "");
  }
  if (negative > 0) note += fmt::format("; {} pixels are below 0 and became 0", negative);
  note += fewValid(picture.values);
  auto bytes = encode(image, note);
  if (!bytes) return bytes.error();
  return Exported{*std::move(bytes), std::move(note)};
}

/// Values that 1 % of the finite ones lie below and above, or 0 and 1 where there is none: a few pixels
/// that unwrapped wrongly would otherwise take all the colours.
std::pair<double, double> extentOf(const std::vector<float>& values) {
  std::vector<float> finite;
  std::ranges::copy_if(values, std::back_inserter(finite), [](float v) { return std::isfinite(v); });
  if (finite.empty()) return {0.0, 1.0};
  const std::size_t hundredth = (finite.size() - 1) / 100;
  const auto at = [&](std::size_t rank) {
    const auto place = finite.begin() + static_cast<std::ptrdiff_t>(rank);
    std::ranges::nth_element(finite, place);
    return static_cast<double>(*place);
  };
  return {at(hundredth), at(finite.size() - 1 - hundredth)};
}

Result<Exported> colors(const Picture& picture, const ExportOptions& options) {
  const Plane& plane = *picture.plane;
  const auto [least, greatest] = extentOf(picture.values);
  const double min = options.min.value_or(least), max = options.max.value_or(greatest);
  if (!(min <= max)) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("the colours need a --min below --max, not {:g} and {:g}", min, max)};
  }
  cv::Mat shades(plane.height, plane.width, CV_8U), invalid(plane.height, plane.width, CV_8U),
      image;
  for (std::size_t i = 0; i < picture.values.size(); ++i) {
    const double value = static_cast<double>(picture.values[i]);
    const double share = max > min ? std::clamp((value - min) / (max - min), 0.0, 1.0) : 0.0;
    invalid.data[i] = std::isnan(value) ? 255 : 0;
    shades.data[i] = std::isnan(value) ? 0 : static_cast<unsigned char>(std::lround(255.0 * share));
  }
  cv::applyColorMap(shades, image, cv::COLORMAP_TURBO);
  image.setTo(cv::Scalar{0, 0, 0}, invalid);
  std::string note =
      fmt::format("{}: colours (turbo) from {:g} to {:g}{}{}, black = invalid", nameOf(plane.kind),
                  min, max, unitOf(plane.kind).empty() ? "" : " ", unitOf(plane.kind));
  note += fewValid(picture.values);
  auto bytes = encode(image, note);
  if (!bytes) return bytes.error();
  return Exported{*std::move(bytes), std::move(note)};
}

/// Infrared as people look at it: the square root, since returned light falls with the square of the range.
Result<Exported> greys(const Picture& picture) {
  const Plane& plane = *picture.plane;
  const double white = std::max(extentOf(picture.values).second, 1e-30);
  cv::Mat image(plane.height, plane.width, CV_8U);
  for (std::size_t i = 0; i < picture.values.size(); ++i) {
    const double share = std::clamp(static_cast<double>(picture.values[i]) / white, 0.0, 1.0);
    image.data[i] = static_cast<unsigned char>(std::lround(255.0 * std::sqrt(share)));
  }
  std::string note = fmt::format("{}: square root, white = {:g}", nameOf(plane.kind), white);
  auto bytes = encode(image, note);
  if (!bytes) return bytes.error();
  return Exported{*std::move(bytes), std::move(note)};
}

/// A plane that holds red, green and blue.
Result<Exported> photograph(const Plane& plane) {
  if (plane.channels != 3 || plane.type != ElementType::U8 || plane.data.size() != plane.byteSize()) {
    return Error{Error::Code::Malformed,
                 fmt::format("plane {} does not hold red, green and blue", nameOf(plane.kind))};
  }
  cv::Mat image(plane.height, plane.width, CV_8UC3);
  const std::span<const std::uint8_t> values = plane.as<std::uint8_t>();
  const std::size_t pixels = values.size() / 3;
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t channel = 0; channel < 3; ++channel)
      image.data[3 * i + 2 - channel] = values[channel * pixels + i];  // OpenCV: blue first
  }
  std::string note = fmt::format("{}: sRGB", nameOf(plane.kind));
  auto bytes = encode(image, note);
  if (!bytes) return bytes.error();
  return Exported{*std::move(bytes), std::move(note)};
}

}  // namespace

Result<Exported> toPng(const Frame& frame, const ExportOptions& options) {
  const auto plane = choosePlane(frame, options.planes);
  if (!plane) return plane.error();
  if ((*plane)->kind == PlaneKind::Color) return photograph(**plane);
  const auto picture = pictureOf(**plane, options.channel);
  if (!picture) return picture.error();
  if (options.grey) return greys(*picture);
  return options.color ? colors(*picture, options) : counts(*picture, options);
}

}  // namespace toftwin::cli
