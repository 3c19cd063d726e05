// SPDX-License-Identifier: Apache-2.0
#include "drivers/kinect2/samples.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>

#include "sim/effects/companding.h"
#include "sim/images/content_hash.h"
#include "sim/images/rows.h"

namespace toftwin::drivers::kinect2 {
namespace {

constexpr std::size_t kRowBytes = kWidth * 11 / 8;
constexpr std::uint32_t kCodes = 2048, kSignBit = 1024;

struct Table {
  Table() {
    for (std::uint32_t code = 0; code < kCodes; ++code) counts[code] = countsOf(code);
  }
  std::array<float, kCodes> counts{};
};

/// Eight codes fill eleven bytes.
void unpackRow(const std::byte* packed, std::array<std::uint16_t, kWidth>& codes) {
  std::uint32_t bits = 0;
  unsigned have = 0;
  std::size_t at = 0;
  for (std::uint16_t& code : codes) {
    while (have < 11) {
      bits |= std::to_integer<std::uint32_t>(packed[at++]) << have;
      have += 8;
    }
    code = static_cast<std::uint16_t>(bits & (kCodes - 1));
    bits >>= 11U;
    have -= 11;
  }
}

void readRow(std::span<const std::byte> image, int y, Image<float>& counts, Image<std::uint8_t>& flags) {
  static const Table table;
  std::array<std::uint16_t, kWidth> codes{};
  unpackRow(&image[static_cast<std::size_t>(storedRow(y)) * kRowBytes], codes);
  constexpr auto kSaturated = static_cast<std::uint8_t>(PixelFlag::Saturated);
  for (int x = 1; x < kWidth - 1; ++x) {
    const std::uint16_t code = codes[static_cast<std::size_t>(storedColumn(x))];
    counts(x, y) = table.counts[code];
    if (code == kSaturatedCode) flags(x, y) = kSaturated;
  }
}

}  // namespace

float countsOf(std::uint32_t code) {
  if (code == kSaturatedCode) return sim::Companding::kLargest;
  const std::uint32_t magnitude = code % kSignBit;
  const std::uint32_t octave = magnitude / 128;
  // The octaves 0 and 1 have steps of 1, octave n steps of 2ⁿ⁻¹ from 128 · 2ⁿ⁻¹ on.
  const std::uint32_t counts = octave == 0 ? magnitude : (magnitude % 128 + 128) << (octave - 1);
  return code >= kSignBit ? -static_cast<float>(counts) : static_cast<float>(counts);
}

sim::Samples samplesOf(std::span<const std::byte> images) {
  constexpr int kFrequencies = 3, kSteps = 3;
  sim::Samples samples{.frequencies = {80_MHz, 16_MHz, 120_MHz}, .steps = kSteps, .taps = 1};
  samples.electrons.assign(kUsedImages, Image<float>{kWidth, kHeight});
  samples.flags = Image<std::uint8_t>{kWidth, kHeight};
  sim::forRows(kHeight, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      for (int i = 0; i < kFrequencies * kSteps; ++i) {
        const auto frequency = static_cast<std::size_t>(i / kSteps);
        readRow(images.subspan(static_cast<std::size_t>(i) * kImageBytes, kImageBytes), y,
                samples.tap(frequency, stepOfImage(i), 0), samples.flags);
      }
    }
  });
  return samples;
}

CameraInfo cameraOf(const Lens& lens) {
  CameraInfo camera{.width = kWidth,
                    .height = kHeight,
                    .fx = lens.fx,
                    .fy = lens.fy,
                    .cx = lens.cx - 0.5,
                    .cy = lens.cy - 0.5,
                    .distortion = {lens.k1, lens.k2, lens.p1, lens.p2, lens.k3},
                    .calibration_id = {}};
  const auto& d = camera.distortion;
  camera.calibration_id =
      sim::contentHash(fmt::format("kinect2 {} {} {} {} {} {} {} {} {}", camera.fx, camera.fy, camera.cx,
                                   camera.cy, d[0], d[1], d[2], d[3], d[4]));
  return camera;
}

/// x → −x: u → width − 1 − u, and the tangential term p₂ (r² + 2x²), which is even in x, changes its sign.
CameraInfo mirrored(const CameraInfo& camera) {
  CameraInfo other = camera;
  other.cx = camera.width - 1 - camera.cx;
  other.distortion[3] = -camera.distortion[3];
  if (!camera.calibration_id.empty())
    other.calibration_id = sim::contentHash("mirrored " + camera.calibration_id);
  return other;
}

std::vector<Image<std::complex<float>>> turnsOf(const PhaseTables& tables) {
  constexpr double kStep_rad = 0.000031 * std::numbers::pi;
  static const std::vector<std::complex<float>> turn_of = [] {
    std::vector<std::complex<float>> all(std::size_t{1} << 16U);
    for (std::size_t i = 0; i < all.size(); ++i) {
      all[i] = std::complex<float>{std::polar(1.0, -kStep_rad * static_cast<double>(i))};
    }
    return all;
  }();
  std::vector<Image<std::complex<float>>> turns;
  turns.reserve(tables.size());
  for (const auto& table : tables) {
    Image<std::complex<float>>& image = turns.emplace_back(kWidth, kHeight);
    for (std::size_t i = 0; i < kPixels; ++i) image[i] = turn_of[table[i]];
  }
  return turns;
}

sim::DecodeRays raysOf(const CameraInfo& camera) {
  sim::DecodeRays rays{{camera.width, camera.height}, {camera.width, camera.height}};
  sim::forRows(camera.height, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const Direction<Camera> ray = rayThroughPixel(camera, x, y);
        rays.x(x, y) = static_cast<float>(ray.v.x);
        rays.z(x, y) = static_cast<float>(ray.v.z);
      }
    }
  });
  return rays;
}

sim::DecodeSettings decodeSettings() {
  // The reasons stand beside these numbers in sim/cameras/kinect_v2.toml; a test compares what both decode.
  sim::DecodeSettings settings;
  settings.algorithm = sim::DecodeSettings::Algorithm::KinectV2;
  settings.baseline_length = 45_mm;
  settings.baseline = sim::DecodeSettings::Baseline::FirstOrder;
  settings.unwrap_threshold = 0.6108653_rad;
  settings.nearest = 0.5_m;
  settings.farthest = 18.7_m;
  return settings;
}

}  // namespace toftwin::drivers::kinect2
