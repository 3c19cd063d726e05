// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/images.h"

#include <limits>
#include <utility>

namespace toftwin::drivers::v4l2 {
namespace {

constexpr std::size_t kCodes = 65536;

unsigned bit(PixelFlag flag) { return static_cast<unsigned>(flag); }

void mark(std::vector<std::uint8_t>& flags, const std::vector<double>& codes, unsigned bits) {
  for (const double code : codes) {
    auto& flag = flags.at(static_cast<std::size_t>(code));
    flag = static_cast<std::uint8_t>(flag | bits);
  }
}

}  // namespace

ImageMaker::ImageMaker(const DepthKeys& keys, Lens lens, bool has_infrared)
    : measures_(keys.measures),
      lens_(std::move(lens)),
      has_infrared_(has_infrared),
      length_m_(kCodes),
      flags_(kCodes),
      depth_per_range_(depthPerRange(lens_.camera)) {
  mark(flags_, keys.invalid, bit(PixelFlag::Invalid));
  mark(flags_, keys.saturated, bit(PixelFlag::Invalid) | bit(PixelFlag::Saturated));
  for (std::size_t code = 0; code < kCodes; ++code) {
    const Length length = keys.offset + static_cast<double>(code) * keys.unit;
    unsigned flag = flags_[code];
    if (length <= 0_m) flag |= bit(PixelFlag::Invalid);
    if (keys.farthest > 0_m && length > keys.farthest && flag == 0) {
      flag |= bit(PixelFlag::Invalid) | bit(PixelFlag::OutOfRange);
    }
    flags_[code] = static_cast<std::uint8_t>(flag);
    length_m_[code] = (flag & bit(PixelFlag::Invalid)) != 0
                          ? std::numeric_limits<float>::quiet_NaN()
                          : static_cast<float>(length.in(metre));
  }
}

std::vector<PlaneKind> ImageMaker::kinds() const {
  std::vector<PlaneKind> kinds;
  if (lens_.is_known || measures_ == Measures::Range) kinds.push_back(PlaneKind::Range);
  if (lens_.is_known || measures_ == Measures::Depth) kinds.push_back(PlaneKind::Depth);
  if (has_infrared_) kinds.push_back(PlaneKind::Amplitude);
  kinds.push_back(PlaneKind::Flags);
  return kinds;
}

std::vector<Plane> ImageMaker::planes(const Image<std::uint16_t>& depth,
                                      const Image<std::uint16_t>& infrared) const {
  const int width = lens_.camera.width, height = lens_.camera.height;
  Image<float> measured_m{width, height}, other_m{width, height};
  Image<std::uint8_t> flags{width, height};
  const bool is_range = measures_ == Measures::Range;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const std::uint16_t code = depth[i];
    measured_m[i] = length_m_[code];
    flags[i] = flags_[code];
    // depth = range · z, with z of the pixel's unit ray
    const float z = depth_per_range_[i];
    other_m[i] = is_range ? measured_m[i] * z : measured_m[i] / z;
  }
  std::vector<Plane> planes;
  for (const PlaneKind kind : kinds()) {
    if (kind == PlaneKind::Flags) planes.push_back(toPlane(kind, std::move(flags)));
    if (kind == PlaneKind::Range) planes.push_back(toPlane(kind, is_range ? measured_m : other_m));
    if (kind == PlaneKind::Depth) planes.push_back(toPlane(kind, is_range ? other_m : measured_m));
    if (kind == PlaneKind::Amplitude) {
      Image<float> strength{width, height};
      for (std::size_t i = 0; i < infrared.size(); ++i) strength[i] = infrared[i];
      planes.push_back(toPlane(kind, std::move(strength)));
    }
  }
  return planes;
}

std::optional<Codes> codesOf(const Layout& layout, std::span<const std::byte> bytes) {
  const auto [format, width, height, stride] = layout;
  Codes codes;
  if (format.has_infrared_first) {
    const std::size_t half = tightStride(format, width) * static_cast<std::size_t>(height);
    if (bytes.size() < half) return std::nullopt;
    auto infrared = unpack(format, bytes.first(half), width, height, stride);
    if (!infrared) return std::nullopt;
    codes.infrared = *std::move(infrared);
    bytes = bytes.subspan(half);
  }
  auto depth = unpack(format, bytes, width, height, stride);
  if (!depth) return std::nullopt;
  codes.depth = *std::move(depth);
  return codes;
}

}  // namespace toftwin::drivers::v4l2
