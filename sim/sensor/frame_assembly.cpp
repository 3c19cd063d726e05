// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor/frame_assembly.h"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "sim/images/rows.h"

namespace toftwin::sim {
namespace {

constexpr std::array kAllPlanes{PlaneKind::Range,    PlaneKind::Depth,      PlaneKind::Amplitude,
                                PlaneKind::Ambient,  PlaneKind::Flags,      PlaneKind::Samples,
                                PlaneKind::Phasors,  PlaneKind::TruthRange, PlaneKind::TruthNormal,
                                PlaneKind::Exposure, PlaneKind::LightSigma, PlaneKind::Color};

void rejectImpossible(RangeImage& range) {
  const auto width = static_cast<std::size_t>(range.range_m.width());
  forRows(range.range_m.height(), [&](int first_row, int last_row) {
    const std::size_t last = static_cast<std::size_t>(last_row) * width;
    for (std::size_t i = static_cast<std::size_t>(first_row) * width; i < last; ++i) {
      if (range.range_m[i] > 0.0F && std::isfinite(range.range_m[i])) continue;
      unsigned flags = range.flags[i] | static_cast<unsigned>(PixelFlag::Invalid);
      if (!std::isnan(range.range_m[i])) flags |= static_cast<unsigned>(PixelFlag::OutOfRange);
      range.flags[i] = static_cast<std::uint8_t>(flags);
      range.range_m[i] = std::numeric_limits<float>::quiet_NaN();
    }
  });
}

Plane planar(PlaneKind kind, int width, int height, int channels, std::vector<float> values) {
  return {kind, ElementType::F32, width, height, channels, Buffer::adopt(std::move(values))};
}

Image<float> depthOf(const Image<float>& range_m, const Image<float>& ray_z, int left, int top) {
  auto depth_m = Image<float>::unset(range_m.width(), range_m.height());
  forRows(range_m.height(), [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) {
      for (int x = 0; x < range_m.width(); ++x) depth_m(x, y) = range_m(x, y) * ray_z(left + x, top + y);
    }
  });
  return depth_m;
}

Plane samplesOf(const Samples& samples) {
  const std::size_t pixels = samples.electrons.front().size();
  const auto taps = static_cast<std::size_t>(samples.taps);
  const std::size_t channels = samples.electrons.size() / taps;
  std::vector<float> values(pixels * channels);
  for (std::size_t c = 0; c < channels; ++c) {
    const auto first = samples.electrons[c * taps].pixels();
    for (std::size_t i = 0; i < pixels; ++i) values[c * pixels + i] = first[i];
    if (taps == 1) continue;
    const auto second = samples.electrons[c * taps + 1].pixels();
    for (std::size_t i = 0; i < pixels; ++i) values[c * pixels + i] -= second[i];
  }
  return planar(PlaneKind::Samples, samples.width(), samples.height(), static_cast<int>(channels),
                std::move(values));
}

Plane phasorsOf(const RangeImage& range) {
  const std::size_t pixels = range.range_m.size();
  std::vector<float> values(2 * pixels * range.phasors.size());
  for (std::size_t f = 0; f < range.phasors.size(); ++f) {
    for (std::size_t i = 0; i < pixels; ++i) {
      values[2 * f * pixels + i] = range.phasors[f][i].real();
      values[(2 * f + 1) * pixels + i] = range.phasors[f][i].imag();
    }
  }
  return planar(PlaneKind::Phasors, range.range_m.width(), range.range_m.height(),
                static_cast<int>(2 * range.phasors.size()), std::move(values));
}

Plane normalsOf(const Image<Vec3f>& normal) {
  const std::size_t pixels = normal.size();
  std::vector<float> values(3 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    values[i] = normal[i].x;
    values[pixels + i] = normal[i].y;
    values[2 * pixels + i] = normal[i].z;
  }
  return planar(PlaneKind::TruthNormal, normal.width(), normal.height(), 3, std::move(values));
}

}  // namespace

std::span<const PlaneKind> allPlanes() { return kAllPlanes; }

std::vector<PlaneKind> planesOfCamera(const SensorModel& model) {
  std::vector<PlaneKind> kinds;
  for (PlaneKind kind : kAllPlanes) {
    if ((kind == PlaneKind::Phasors || kind == PlaneKind::LightSigma) && !model.hasPhasors()) continue;
    if (kind == PlaneKind::Exposure && model.exposureCount() == 1) continue;
    if (kind == PlaneKind::Color && !model.colorLens()) continue;
    kinds.push_back(kind);
  }
  return kinds;
}

CameraInfo cameraOfRegion(const CameraInfo& camera, int left, int top, int width, int height) {
  CameraInfo region = camera;
  region.width = width;
  region.height = height;
  region.cx -= left;
  region.cy -= top;
  return region;
}

std::vector<Plane> planesOf(const SensorModel& model, SensorModel::Exposed exposed,
                            const Truth& truth, std::span<const PlaneKind> kinds, int left,
                            int top) {
  RangeImage& range = exposed.range;
  rejectImpossible(range);
  std::vector<Plane> planes;
  for (PlaneKind kind : kinds) {
    switch (kind) {
      case PlaneKind::Range:
        planes.push_back(toPlane(kind, range.range_m));
        break;
      case PlaneKind::Depth:
        planes.push_back(toPlane(kind, depthOf(range.range_m, model.rays().z, left, top)));
        break;
      case PlaneKind::Amplitude:
        planes.push_back(toPlane(kind, std::move(range.amplitude)));
        break;
      case PlaneKind::Ambient:
        planes.push_back(toPlane(kind, std::move(range.ambient)));
        break;
      case PlaneKind::Flags:
        planes.push_back(toPlane(kind, std::move(range.flags)));
        break;
      case PlaneKind::Samples:
        planes.push_back(samplesOf(exposed.samples));
        break;
      case PlaneKind::Phasors:
        planes.push_back(phasorsOf(range));
        break;
      case PlaneKind::TruthRange:
        planes.push_back(toPlane(kind, truth.range_m));
        break;
      case PlaneKind::TruthNormal:
        planes.push_back(normalsOf(truth.normal));
        break;
      case PlaneKind::Exposure:
        planes.push_back(toPlane(kind, std::move(range.exposure)));
        break;
      case PlaneKind::Color:
      case PlaneKind::LightSigma:
        break;  // not of this exposure: of another lens, and of the light before it
    }
  }
  return planes;
}

Plane planeOf(const ColorImage& color) {
  const int width = color[0].width(), height = color[0].height();
  std::vector<std::uint8_t> planar;
  for (const Image<std::uint8_t>& channel : color)
    planar.insert(planar.end(), channel.pixels().begin(), channel.pixels().end());
  return {PlaneKind::Color, ElementType::U8, width, height, 3, Buffer::adopt(std::move(planar))};
}

/// σ = √v / |P| · c / 4πf, v the variance of one component of the first harmonic's phasor P.
Plane lightSigmaOf(const Light& light) {
  const std::size_t pixels = light.truth.range_m.size(), frequencies = light.frequencies.size();
  std::vector<float> sigma_m(pixels * frequencies, std::numeric_limits<float>::quiet_NaN());
  for (std::size_t f = 0; f < light.variance.size(); ++f) {
    const double metre_per_radian =
        kSpeedOfLight_m_per_s / (4.0 * std::numbers::pi * light.frequencies[f].in(hertz));
    const Image<std::complex<float>>& phasor = light.phasor(f, 1);
    for (std::size_t i = 0; i < phasor.size(); ++i) {
      const float strength = std::abs(phasor[i]);
      if (strength > 0.0F) {
        sigma_m[f * pixels + i] =
            std::sqrt(light.variance[f][i]) / strength * static_cast<float>(metre_per_radian);
      }
    }
  }
  return planar(PlaneKind::LightSigma, light.truth.range_m.width(), light.truth.range_m.height(),
                static_cast<int>(frequencies), std::move(sigma_m));
}

Provenance provenanceOf(const SensorModel& model, std::string scene_id, std::uint64_t seed) {
  return {.kind = FrameKind::Simulated,
          .calibration_id = model.camera().calibration_id,
          .scene_id = std::move(scene_id),
          .model_id = model.id(),
          .seed = seed,
          .effects = model.effectNames()};
}

}  // namespace toftwin::sim
