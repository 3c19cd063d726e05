// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3d303/images.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "daemon/facades/frame_views.h"
#include "daemon/facades/ifm/inverse_lens.h"
#include "drivers/o3d303/wire/confidence.h"

namespace toftwin::daemon::o3d303 {
namespace {

using toftwin::o3d303::Confidence;

constexpr double kMost = std::numeric_limits<std::uint16_t>::max();
constexpr double kMillimetres = 1000.0;
constexpr std::size_t kMostExposures = 3;

/// 0 for what is no number, or does not fit.
std::uint16_t countsOf(double value) {
  return value > 0.0 && value <= kMost ? static_cast<std::uint16_t>(std::lround(value)) : std::uint16_t{0};
}

Result<std::vector<std::uint16_t>> distancesOf(const Frame& frame, const LensChunks& lens) {
  const Plane* range = planeOf(frame, PlaneKind::Range, ElementType::F32);
  const Plane* depth = planeOf(frame, PlaneKind::Depth, ElementType::F32);
  if (range == nullptr && depth == nullptr) {
    return Error{Error::Code::Unsupported,
                 "the source has neither range nor depth, which an O3D303 is made of"};
  }
  const auto metres = (range != nullptr ? range : depth)->as<float>();
  std::vector<std::uint16_t> distance_mm(metres.size());
  for (std::size_t i = 0; i < metres.size(); ++i) {
    const double per_range = range != nullptr ? 1.0 : static_cast<double>(lens.rays[3 * i + 2]);
    distance_mm[i] = countsOf(kMillimetres * static_cast<double>(metres[i]) / per_range);
  }
  return distance_mm;
}

}  // namespace

FrameFacts factsOf(const Frame& frame) {
  std::set<std::uint32_t> durations_us;
  std::set<double> modulations;
  for (const Exposure& one : frame.moment.exposures) {
    durations_us.insert(
        static_cast<std::uint32_t>(std::lround(std::clamp(one.duration.in(microsecond), 0.0, 1e9))));
    if (one.modulation > 0_Hz) modulations.insert(one.modulation.in(hertz));
  }
  FrameFacts facts;
  facts.exposures_us.assign(durations_us.begin(), durations_us.end());
  if (facts.exposures_us.size() > kMostExposures) facts.exposures_us = {facts.exposures_us.back()};
  facts.frequencies = std::clamp(static_cast<int>(modulations.size()), 1, 3);
  for (const NamedTemperature& one : frame.moment.temperatures) {
    if (one.where == "illumination") facts.illumination_c = one.value.in(celsius);
    if (one.where == "processor") facts.processor_c = one.value.in(celsius);
    if (one.where == "housing" || (one.where == "sensor" && !facts.housing_c))
      facts.housing_c = one.value.in(celsius);  // of a camera that tells its imager's alone
  }
  return facts;
}

LensChunks lensChunksOf(const CameraInfo& camera, const toftwin::o3d303::ExtrinsicCalibration& extrinsics) {
  LensChunks lens{.camera = camera, .extrinsics = extrinsics, .rays = unitVectorsOf(camera)};
  lens.unit_vectors = toftwin::o3d303::unitVectorsFrom(lens.rays, extrinsics);
  // fx fy mx my alpha k1 k2 k5 k3 k4, then the optics against the housing: none.
  const auto chunkOf = [&](const std::array<double, 5>& d) {
    std::array<float, 16> chunk{};
    std::size_t i = 0;
    for (const double number :
         {camera.fx, camera.fy, camera.cx, camera.cy, 0.0, d[0], d[1], d[4], d[2], d[3]}) {
      chunk[i++] = static_cast<float>(number);
    }
    return chunk;
  };
  lens.intrinsics = chunkOf(camera.distortion);
  lens.inverse_intrinsics = chunkOf(ifm::inverseDistortion(camera));
  return lens;
}

namespace {

/// What every chunk of the frame says of it.
void describe(const Frame& frame, toftwin::o3d303::CameraFrame& wire) {
  wire.width = static_cast<std::uint32_t>(frame.camera.width);
  wire.height = static_cast<std::uint32_t>(frame.camera.height);
  wire.frame_count = static_cast<std::uint32_t>(frame.sequence);
  const std::int64_t ns = std::max<std::int64_t>(
      0, frame.moment.exposures.empty() ? frame.moment.received.ns : frame.moment.exposures.front().start.ns);
  wire.time = {static_cast<std::uint32_t>(ns / 1'000'000'000),
               static_cast<std::uint32_t>(ns % 1'000'000'000)};
  wire.time_us = static_cast<std::uint32_t>(ns / 1000);
  const FrameFacts facts = factsOf(frame);
  for (std::size_t i = 0; i < facts.exposures_us.size(); ++i) wire.exposures_us[i] = facts.exposures_us[i];
  const auto degrees = [](std::optional<double> value_c) {
    return value_c ? static_cast<float>(*value_c) : toftwin::o3d303::CameraFrame::kNoSensor_c;
  };
  wire.illumination_c = degrees(facts.illumination_c);
  wire.front1_c = degrees(facts.housing_c);
  wire.processor_c = degrees(facts.processor_c);
}

}  // namespace

Result<CameraImages> imagesOf(const Frame& frame, const LensChunks& lens, double electrons_per_count) {
  auto distance_mm = distancesOf(frame, lens);
  if (!distance_mm) return distance_mm.error();
  CameraImages images;
  images.distance_mm = *std::move(distance_mm);
  const std::size_t pixels = images.distance_mm.size();
  images.amplitude.resize(pixels);
  images.confidence.resize(pixels);
  const Plane* amplitude = planeOf(frame, PlaneKind::Amplitude, ElementType::F32);
  const Plane* flags = planeOf(frame, PlaneKind::Flags, ElementType::U8);
  const Plane* exposure = planeOf(frame, PlaneKind::Exposure, ElementType::U8);
  for (std::size_t i = 0; i < pixels; ++i) {
    if (amplitude != nullptr) {
      const double counts = static_cast<double>(amplitude->as<float>()[i]) / electrons_per_count;
      images.amplitude[i] = countsOf(std::min(counts, kMost));
    }
    unsigned confidence =
        flags != nullptr ? toftwin::o3d303::confidenceOf(flags->as<std::uint8_t>()[i]) : std::uint8_t{0};
    confidence |=
        toftwin::o3d303::confidenceOfExposure(exposure != nullptr ? exposure->as<std::uint8_t>()[i] : 0U);
    if (images.distance_mm[i] == 0) confidence |= static_cast<unsigned>(Confidence::Invalid);
    if ((confidence & static_cast<unsigned>(Confidence::Invalid)) != 0) images.distance_mm[i] = 0;
    images.confidence[i] = static_cast<std::uint8_t>(confidence);
  }
  describe(frame, images.wire);
  images.wire.distance_mm = images.distance_mm;
  images.wire.amplitude = images.wire.raw_amplitude = images.amplitude;
  images.wire.confidence = images.confidence;
  images.wire.unit_vectors = lens.unit_vectors;
  images.wire.extrinsics = lens.extrinsics;
  images.wire.intrinsics = lens.intrinsics;
  images.wire.inverse_intrinsics = lens.inverse_intrinsics;
  return images;
}

void clip(const Clipping& clipping, CameraImages& images) {
  constexpr auto kGone =
      static_cast<unsigned>(Confidence::Invalid) | static_cast<unsigned>(Confidence::Clipped);
  const auto width = static_cast<std::size_t>(images.wire.width);
  const auto& t = images.wire.extrinsics;
  for (std::size_t i = 0; i < images.distance_mm.size(); ++i) {
    bool stays = clipping.hasPixel(static_cast<int>(i % width), static_cast<int>(i / width));
    if (stays && images.distance_mm[i] != 0) {
      const auto p_m = [&](std::size_t axis) {
        return (static_cast<double>(images.wire.unit_vectors[3 * i + axis]) * images.distance_mm[i] +
                static_cast<double>(t[axis])) /
               kMillimetres;
      };
      stays = clipping.hasPoint({p_m(0), p_m(1), p_m(2)});
    }
    if (stays) continue;
    images.distance_mm[i] = 0;
    images.confidence[i] = static_cast<std::uint8_t>(images.confidence[i] | kGone);
  }
}

}  // namespace toftwin::daemon::o3d303
