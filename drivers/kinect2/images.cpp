// SPDX-License-Identifier: Apache-2.0
#include "drivers/kinect2/images.h"

#include <algorithm>
#include <array>
#include <utility>

namespace toftwin::drivers::kinect2 {
namespace {

constexpr std::array kAll{PlaneKind::Range, PlaneKind::Depth,   PlaneKind::Amplitude,
                          PlaneKind::Flags, PlaneKind::Samples, PlaneKind::Phasors};

/// Rows of all channels, the other way round.
template <class T>
void flipRows(std::span<T> values, int width) {
  for (std::size_t at = 0; at < values.size(); at += static_cast<std::size_t>(width)) {
    const auto row = values.subspan(at, static_cast<std::size_t>(width));
    std::reverse(row.begin(), row.end());
  }
}

template <class T>
Plane planeOf(PlaneKind kind, Image<T> image, bool flip) {
  if (flip) flipRows(image.pixels(), image.width());
  return toPlane(kind, std::move(image));
}

Plane planar(PlaneKind kind, int width, int height, std::vector<float> values, bool flip) {
  if (flip) flipRows(std::span{values}, width);
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const auto channels = static_cast<int>(values.size() / pixels);
  return {kind, ElementType::F32, width, height, channels, Buffer::adopt(std::move(values))};
}

Plane samplesPlane(const sim::Samples& samples, bool flip) {
  std::vector<float> values;
  for (const Image<float>& image : samples.electrons) {
    values.insert(values.end(), image.pixels().begin(), image.pixels().end());
  }
  return planar(PlaneKind::Samples, samples.width(), samples.height(), std::move(values), flip);
}

Plane phasorsPlane(const sim::RangeImage& decoded, bool flip) {
  std::vector<float> values;
  for (const auto& phasors : decoded.phasors) {
    for (const auto& p : phasors.pixels()) values.push_back(p.real());
    for (const auto& p : phasors.pixels()) values.push_back(p.imag());
  }
  return planar(PlaneKind::Phasors, decoded.range_m.width(), decoded.range_m.height(), std::move(values),
                flip);
}

Image<float> depthOf(const Image<float>& range_m, const Image<float>& ray_z) {
  Image<float> depth_m{range_m.width(), range_m.height()};
  for (std::size_t i = 0; i < depth_m.size(); ++i) depth_m[i] = range_m[i] * ray_z[i];
  return depth_m;
}

}  // namespace

std::span<const PlaneKind> allPlanes() { return kAll; }

std::vector<Plane> planesOf(sim::RangeImage decoded, const sim::Samples& samples, const Image<float>& ray_z,
                            std::span<const PlaneKind> kinds, bool flip) {
  std::vector<Plane> planes;
  for (const PlaneKind kind : kinds) {
    if (kind == PlaneKind::Range) planes.push_back(planeOf(kind, decoded.range_m, flip));
    if (kind == PlaneKind::Depth) planes.push_back(planeOf(kind, depthOf(decoded.range_m, ray_z), flip));
    if (kind == PlaneKind::Amplitude) planes.push_back(planeOf(kind, std::move(decoded.amplitude), flip));
    if (kind == PlaneKind::Flags) planes.push_back(planeOf(kind, std::move(decoded.flags), flip));
    if (kind == PlaneKind::Samples) planes.push_back(samplesPlane(samples, flip));
    if (kind == PlaneKind::Phasors) planes.push_back(phasorsPlane(decoded, flip));
  }
  return planes;
}

}  // namespace toftwin::drivers::kinect2
