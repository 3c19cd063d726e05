// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <vector>

#include <toftwin/nan.h>

#include "daemon/faults.h"

namespace toftwin::daemon {
namespace {

constexpr unsigned kBlind =
    static_cast<unsigned>(PixelFlag::Invalid) | static_cast<unsigned>(PixelFlag::LowAmplitude);
constexpr float kThroughDirt = 0.05F;  ///< of the amplitude: light passes the spot twice

double uniform(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1p-53; }

/// A plane's elements to write to; the frame that others hold stays as it is.
template <class T>
std::vector<T> copyOf(const Plane& plane) {
  const auto elements = plane.as<T>();
  return {elements.begin(), elements.end()};
}

template <class T, class Change>
void change(Frame& frame, PlaneKind kind, ElementType type, Change change_one) {
  for (Plane& plane : frame.planes) {
    if (plane.kind != kind || plane.type != type || plane.channels != 1) continue;
    std::vector<T> elements = copyOf<T>(plane);
    for (std::size_t i = 0; i < elements.size(); ++i) change_one(i, elements[i]);
    plane.data = Buffer::adopt(std::move(elements));
  }
}

/// A range takes its depth along: both along the same ray.
template <class RangeAt>
void setRanges(Frame& frame, const std::vector<bool>& hit, RangeAt range_at) {
  change<float>(frame, PlaneKind::Range, ElementType::F32, [&](std::size_t i, float& range_m) {
    if (hit[i]) range_m = range_at(i);
  });
  const auto width = static_cast<std::size_t>(std::max(1, frame.camera.width));
  change<float>(frame, PlaneKind::Depth, ElementType::F32, [&](std::size_t i, float& depth_m) {
    if (!hit[i]) return;
    const double z =
        rayThroughPixel(frame.camera, static_cast<double>(i % width), static_cast<double>(i / width)).v.z;
    depth_m = static_cast<float>(static_cast<double>(range_at(i)) * z);
  });
  change<std::uint8_t>(frame, PlaneKind::Flags, ElementType::U8, [&](std::size_t i, std::uint8_t& flags) {
    if (!hit[i]) return;
    flags = static_cast<std::uint8_t>(std::isnan(range_at(i)) ? flags | kBlind : flags & ~kBlind);
  });
}

/// A round spot of that share of the image, somewhere.
std::vector<bool> spot(const Frame& frame, const FaultKeys& fault, std::size_t number) {
  const int width = frame.camera.width, height = frame.camera.height;
  const double radius = std::sqrt(fault.share * width * height / std::numbers::pi);
  const double x = uniform(faultBits(fault.seed, number, 0, 0)) * width;
  const double y = uniform(faultBits(fault.seed, number, 0, 1)) * height;
  std::vector<bool> hit;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) hit.push_back(std::hypot(u - x, v - y) <= radius);
  }
  return hit;
}

}  // namespace

/// splitmix64's finaliser over the four numbers in turn (Steele, Lea, Flood 2014).
std::uint64_t faultBits(std::uint64_t seed, std::uint64_t number, std::uint64_t frame, std::uint64_t place) {
  std::uint64_t bits = 0;
  for (const std::uint64_t one : {seed, number, frame, place}) {
    bits += one + 0x9E37'79B9'7F4A'7C15;
    bits = (bits ^ (bits >> 30)) * 0xBF58'476D'1CE4'E5B9;
    bits = (bits ^ (bits >> 27)) * 0x94D0'49BB'1331'11EB;
    bits ^= bits >> 31;
  }
  return bits;
}

std::size_t damagePixels(Frame& frame, const FaultKeys& fault, std::uint64_t index, std::size_t number) {
  const auto pixels =
      static_cast<std::size_t>(frame.camera.width) * static_cast<std::size_t>(frame.camera.height);
  for (const Plane& plane : frame.planes) {
    if (static_cast<std::size_t>(plane.width) * static_cast<std::size_t>(plane.height) != pixels) return 0;
  }
  const bool is_dirt = fault.kind == FaultKind::Dirt, is_stuck = fault.kind == FaultKind::StuckPixels;
  std::vector<bool> hit(pixels);
  if (is_dirt) hit = spot(frame, fault, number);
  // Stuck pixels are always the same, corrupted ones others in each frame.
  const std::uint64_t of_frame = is_stuck ? 0 : index;
  for (std::size_t i = 0; i < pixels && !is_dirt; ++i) {
    hit[i] = uniform(faultBits(fault.seed, number, of_frame, 2 * i)) < fault.share;
  }
  constexpr double kFarthest_m = 10.0;
  setRanges(frame, hit, [&](std::size_t i) {
    const double any_m = kFarthest_m * uniform(faultBits(fault.seed, number, of_frame, 2 * i + 1));
    return is_dirt ? kNaN : static_cast<float>(any_m);
  });
  change<float>(frame, PlaneKind::Amplitude, ElementType::F32, [&](std::size_t i, float& amplitude) {
    if (hit[i] && is_dirt) amplitude *= kThroughDirt;
  });
  return static_cast<std::size_t>(std::ranges::count(hit, true));
}

}  // namespace toftwin::daemon
