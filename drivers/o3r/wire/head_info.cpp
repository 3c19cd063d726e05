// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3r/wire/head_info.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

namespace toftwin::o3r {
namespace {

using toftwin::o3d303::appendNumber;
using toftwin::o3d303::numberAt;

constexpr std::size_t kModeSize = 32;
// Sizes by version.
constexpr std::size_t kTofInfo1 = 0x138, kTofInfo2 = 0x15C, kTofInfo3 = 0x1A0, kTofInfo4 = 0x1AC,
                      kRgbInfo1 = 0x134;

template <class T, std::size_t N>
void append(Bytes& bytes, const std::array<T, N>& numbers) {
  for (const T number : numbers) appendNumber(bytes, number);
}
void append(Bytes& bytes, const LensModel& lens) {
  appendNumber(bytes, lens.model);
  append(bytes, lens.parameters);
}
void append(Bytes& bytes, const OpticToUser& pose) {
  append(bytes, pose.translation_m);
  append(bytes, pose.rotation_rad);
}
void append(Bytes& bytes, std::string_view text) {
  text = text.substr(0, kModeSize);
  toftwin::o3d303::appendText(bytes, text);
  bytes.resize(bytes.size() + kModeSize - text.size());
}

/// Reads one number after another; who calls has looked at the size.
class Cursor {
 public:
  explicit Cursor(std::span<const std::byte> bytes) : bytes_(bytes) {}
  template <class T>
  void read(T& number) {
    number = numberAt<T>(bytes_, at_);
    at_ += sizeof(T);
  }
  template <class T, std::size_t N>
  void read(std::array<T, N>& numbers) {
    for (T& number : numbers) read(number);
  }
  void read(LensModel& lens) {
    read(lens.model);
    read(lens.parameters);
  }
  void read(OpticToUser& pose) {
    read(pose.translation_m);
    read(pose.rotation_rad);
  }
  void read(std::string& text) {
    const std::string_view all = toftwin::o3d303::textOf(bytes_.subspan(at_, kModeSize));
    text = all.substr(0, all.find('\0'));
    at_ += kModeSize;
  }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
};

Error tooShort(std::string_view what, std::size_t size) {
  return {Error::Code::Malformed, fmt::format("{}: {} bytes are too few for its version", what, size)};
}

/// A point of the image plane as models 0 and 1 move it.
std::array<float, 2> moved(const LensModel& lens, float x, float y) {
  const auto& p = lens.parameters;
  const float k1 = p[5], k2 = p[6], k3 = p[7], k4 = p[8], k5 = p[9];
  const float r2 = x * x + y * y;
  const float radial = 1.0F + r2 * (k1 + r2 * (k2 + r2 * k5));
  const float h = 2.0F * x * y;
  return {radial * x + (k3 * h + k4 * (r2 + 2.0F * x * x)), radial * y + (k3 * (r2 + 2.0F * y * y) + k4 * h)};
}

std::array<float, 3> fishEyeRay(const LensModel& lens, float x, float y) {
  const auto& p = lens.parameters;
  const float theta_s = std::sqrt(x * x + y * y);
  float s = std::min(theta_s, p[9]);
  s *= s;
  const float factor = 1.0F + s * (p[5] + s * (p[6] + s * (p[7] + s * p[8])));
  const float theta = std::clamp(theta_s * factor, 0.0F, std::numbers::pi_v<float>);
  const float sine = std::sin(theta);
  if (!(theta_s > 0.0F)) return {0.0F, 0.0F, std::cos(theta)};
  return {x / theta_s * sine, y / theta_s * sine, std::cos(theta)};
}

}  // namespace

std::array<float, 3> rayOf(const LensModel& lens, int u, int v) {
  const auto& p = lens.parameters;
  float x = (static_cast<float>(u) + 0.5F - p[2]) / p[0];
  const float y = (static_cast<float>(v) + 0.5F - p[3]) / p[1];
  x -= p[4] * y;
  if (lens.model == 2) return fishEyeRay(lens, x, y);
  if (lens.model != 0) return {};
  const auto [dx, dy] = moved(lens, x, y);
  const float norm = 1.0F / std::sqrt(dx * dx + dy * dy + 1.0F);
  return {norm * dx, norm * dy, norm};
}

LensModel inverseModelOf(const CameraInfo& camera) {
  constexpr double kHalfPixel = 0.5;  // their first pixel's middle is (0.5, 0.5), ours (0, 0)
  const auto& d = camera.distortion;
  LensModel lens{.model = 1};
  std::size_t i = 0;
  for (const double number : {camera.fx, camera.fy, camera.cx + kHalfPixel, camera.cy + kHalfPixel, 0.0, d[0],
                              d[1], d[2], d[3], d[4]}) {
    lens.parameters[i++] = static_cast<float>(number);
  }
  return lens;
}

std::array<float, 9> rotationOf(const OpticToUser& pose) {
  const auto [x, y, z] = pose.rotation_rad;
  const float cx = std::cos(x), sx = std::sin(x), cy = std::cos(y), sy = std::sin(y), cz = std::cos(z),
              sz = std::sin(z);
  return {cy * cz,
          -cy * sz,
          sy,
          cx * sz + cz * sx * sy,
          cx * cz - sx * sy * sz,
          -cy * sx,
          sx * sz - cx * cz * sy,
          cz * sx + cx * sy * sz,
          cx * cy};
}

Bytes encode(const TofInfo& info) {
  Bytes bytes;
  bytes.reserve(kTofInfo4);
  appendNumber(bytes, TofInfo::kVersion);
  appendNumber(bytes, info.distance_resolution_m);
  appendNumber(bytes, info.amplitude_resolution);
  append(bytes, info.amplitude_factors);
  append(bytes, info.optic_to_user);
  append(bytes, info.intrinsics);
  append(bytes, info.inverse_intrinsics);
  append(bytes, info.exposure_starts_ns);
  append(bytes, info.exposures_s);
  appendNumber(bytes, info.illumination_c);
  append(bytes, info.mode);
  append(bytes, info.imager);
  appendNumber(bytes, info.measurement_block);
  appendNumber(bytes, info.least_range_m);
  appendNumber(bytes, info.most_range_m);
  return bytes;
}

Result<TofInfo> readTofInfo(std::span<const std::byte> bytes) {
  if (bytes.size() < kTofInfo1) return tooShort("TOF_INFO", bytes.size());
  TofInfo info;
  Cursor cursor{bytes};
  cursor.read(info.version);
  const std::size_t least = info.version >= 4   ? kTofInfo4
                            : info.version == 3 ? kTofInfo3
                            : info.version == 2 ? kTofInfo2
                                                : kTofInfo1;
  if (info.version == 0 || bytes.size() < least) return tooShort("TOF_INFO", bytes.size());
  cursor.read(info.distance_resolution_m);
  cursor.read(info.amplitude_resolution);
  cursor.read(info.amplitude_factors);
  cursor.read(info.optic_to_user);
  cursor.read(info.intrinsics);
  cursor.read(info.inverse_intrinsics);
  if (info.version < 2) return info;
  cursor.read(info.exposure_starts_ns);
  cursor.read(info.exposures_s);
  if (info.version < 3) return info;
  cursor.read(info.illumination_c);
  cursor.read(info.mode);
  cursor.read(info.imager);
  if (info.version < 4) return info;
  cursor.read(info.measurement_block);
  cursor.read(info.least_range_m);
  cursor.read(info.most_range_m);
  return info;
}

Bytes encode(const RgbInfo& info) {
  Bytes bytes;
  bytes.reserve(kRgbInfo1);
  appendNumber(bytes, info.version);
  appendNumber(bytes, info.frame_count);
  appendNumber(bytes, info.start_ns);
  appendNumber(bytes, info.exposure_s);
  append(bytes, info.optic_to_user);
  append(bytes, info.intrinsics);
  append(bytes, info.inverse_intrinsics);
  return bytes;
}

Result<RgbInfo> readRgbInfo(std::span<const std::byte> bytes) {
  if (bytes.size() < kRgbInfo1) return tooShort("RGB_INFO", bytes.size());
  RgbInfo info;
  Cursor cursor{bytes};
  cursor.read(info.version);
  cursor.read(info.frame_count);
  cursor.read(info.start_ns);
  cursor.read(info.exposure_s);
  cursor.read(info.optic_to_user);
  cursor.read(info.intrinsics);
  cursor.read(info.inverse_intrinsics);
  return info;
}

Bytes encode(const LensModel& lens) {
  Bytes bytes;
  append(bytes, lens);
  return bytes;
}

}  // namespace toftwin::o3r
