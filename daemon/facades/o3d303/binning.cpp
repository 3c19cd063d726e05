// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3d303/binning.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "daemon/facades/frame_views.h"

namespace toftwin::daemon::o3d303 {
namespace {

constexpr auto kInvalid = static_cast<unsigned>(PixelFlag::Invalid);

/// Pixel (0, 0) of the small image is the middle of four: half a pixel from the first one's centre.
CameraInfo halfOf(CameraInfo camera) {
  camera.width /= 2;
  camera.height /= 2;
  camera.fx /= 2.0;
  camera.fy /= 2.0;
  camera.cx = (camera.cx - 0.5) / 2.0;
  camera.cy = (camera.cy - 0.5) / 2.0;
  return camera;
}

/// Where the four pixels are that become one.
std::array<std::size_t, 4> fourOf(const Frame& frame, int x, int y) {
  const auto width = static_cast<std::size_t>(frame.camera.width);
  const std::size_t first = 2 * static_cast<std::size_t>(y) * width + 2 * static_cast<std::size_t>(x);
  return {first, first + 1, first + width, first + width + 1};
}

struct Planes {
  const Plane *range, *depth, *amplitude, *flags, *exposure;
  explicit Planes(const Frame& frame)
      : range(planeOf(frame, PlaneKind::Range, ElementType::F32)),
        depth(planeOf(frame, PlaneKind::Depth, ElementType::F32)),
        amplitude(planeOf(frame, PlaneKind::Amplitude, ElementType::F32)),
        flags(planeOf(frame, PlaneKind::Flags, ElementType::U8)),
        exposure(planeOf(frame, PlaneKind::Exposure, ElementType::U8)) {}

  [[nodiscard]] bool isValid(std::size_t i) const {
    const Plane* metres = range != nullptr ? range : depth;
    const bool has_number = metres == nullptr || std::isfinite(metres->as<float>()[i]);
    return has_number && (flags == nullptr || (flags->as<std::uint8_t>()[i] & kInvalid) == 0);
  }
};

/// Of one pixel, or nothing in it counts.
struct Weights {
  std::array<double, 4> of{};
  double sum = 0.0;
};

Weights weightsOf(const Planes& planes, const std::array<std::size_t, 4>& four, Binning how) {
  Weights weights;
  for (std::size_t k = 0; k < four.size(); ++k) {
    if (!planes.isValid(four[k])) continue;
    const bool counts_by_amplitude = how == Binning::ByAmplitude && planes.amplitude != nullptr;
    const double amplitude = counts_by_amplitude ? planes.amplitude->as<float>()[four[k]] : 1.0F;
    constexpr double kLeast = 1e-9;  // so that four dark pixels have a mean, too
    weights.of[k] = std::isfinite(amplitude) ? std::max(amplitude, kLeast) : kLeast;
    weights.sum += weights.of[k];
  }
  return weights;
}

float meanOf(std::span<const float> values, const std::array<std::size_t, 4>& four, const Weights& weights) {
  if (weights.sum == 0.0) return std::numeric_limits<float>::quiet_NaN();
  double sum = 0.0;
  for (std::size_t k = 0; k < four.size(); ++k) {
    if (weights.of[k] > 0.0) sum += weights.of[k] * static_cast<double>(values[four[k]]);
  }
  return static_cast<float>(sum / weights.sum);
}

float plainMeanOf(std::span<const float> values, const std::array<std::size_t, 4>& four) {
  float sum = 0.0F;
  for (const std::size_t i : four) sum += values[i] / 4.0F;
  return sum;
}

std::uint8_t joined(const Planes& planes, const std::array<std::size_t, 4>& four) {
  unsigned of_valid = 0, of_all = 0;
  bool has_valid = false;
  for (const std::size_t i : four) {
    const unsigned flags = planes.flags->as<std::uint8_t>()[i];
    of_all |= flags;
    if (!planes.isValid(i)) continue;
    of_valid |= flags;
    has_valid = true;
  }
  return static_cast<std::uint8_t>(has_valid ? of_valid : of_all | kInvalid);
}

/// The shortest exposure of the four is that of the strongest light in them.
std::uint8_t exposureOf(std::span<const std::uint8_t> exposures, const std::array<std::size_t, 4>& four) {
  std::uint8_t most = 0;
  for (const std::size_t i : four) most = std::max(most, exposures[i]);
  return most;
}

template <class T, class Make>
Plane madeOf(const Frame& frame, PlaneKind kind, const Make& make) {
  Image<T> image{frame.camera.width / 2, frame.camera.height / 2};
  std::size_t i = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) image[i++] = make(fourOf(frame, x, y));
  }
  return toPlane(kind, std::move(image));
}

}  // namespace

Frame binned(const Frame& frame, Binning how) {
  using Four = std::array<std::size_t, 4>;
  const Planes from{frame};
  Frame small = frame;
  small.planes.clear();
  for (const Plane* metres : {from.range, from.depth}) {
    if (metres == nullptr) continue;
    small.planes.push_back(madeOf<float>(frame, metres->kind, [&](const Four& four) {
      return meanOf(metres->as<float>(), four, weightsOf(from, four, how));
    }));
  }
  if (from.amplitude != nullptr) {
    small.planes.push_back(madeOf<float>(frame, PlaneKind::Amplitude, [&](const Four& four) {
      return plainMeanOf(from.amplitude->as<float>(), four);
    }));
  }
  if (from.flags != nullptr) {
    small.planes.push_back(
        madeOf<std::uint8_t>(frame, PlaneKind::Flags, [&](const Four& four) { return joined(from, four); }));
  }
  if (from.exposure != nullptr) {
    small.planes.push_back(madeOf<std::uint8_t>(frame, PlaneKind::Exposure, [&](const Four& four) {
      return exposureOf(from.exposure->as<std::uint8_t>(), four);
    }));
  }
  small.camera = halfOf(frame.camera);
  return small;
}

}  // namespace toftwin::daemon::o3d303
