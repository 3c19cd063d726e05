// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3r/images.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "daemon/facades/frame_views.h"
#include "daemon/facades/ifm/inverse_lens.h"
#include "drivers/o3d303/wire/confidence.h"
#include "drivers/o3d303/wire/frame_content.h"
#include "drivers/o3r/wire/confidence.h"
#include "drivers/o3r/wire/numbers.h"
#include "sim/pictures/jpeg.h"

namespace toftwin::daemon::o3r {
namespace {

using toftwin::o3r::HeadFrame;
using toftwin::o3r::TofInfo;

constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;
constexpr double kUnknownExposure_us = 1000.0;
constexpr float kNoSensor_c = 3276.7F;  // what the maker's cameras say of a temperature that they lack
constexpr float kLeastRange_m = 0.1F;

/// On this machine's clock, which all heads of a unit share, where its relation to the source's is known;
/// otherwise when the daemon had the frame.
std::int64_t hostTimeOf(const Frame& frame, DeviceTime device) {
  const ClockRelation& clock = frame.moment.clock;
  const bool is_known = clock.uncertainty_ns >= 0 && !frame.moment.exposures.empty();
  return std::max<std::int64_t>(0,
                                is_known ? device.ns + clock.host_minus_device_ns : frame.moment.received.ns);
}

std::int64_t beginOf(const Frame& frame) {
  return hostTimeOf(frame,
                    frame.moment.exposures.empty() ? DeviceTime{} : frame.moment.exposures.front().start);
}

HeadFrame headerOf(const Frame& frame) {
  const std::int64_t ns = beginOf(frame);
  HeadFrame wire;
  wire.width = static_cast<std::uint32_t>(frame.camera.width);
  wire.height = static_cast<std::uint32_t>(frame.camera.height);
  wire.frame_count = static_cast<std::uint32_t>(frame.sequence);
  wire.time = {static_cast<std::uint32_t>(ns / kNanosecondsPerSecond),
               static_cast<std::uint32_t>(ns % kNanosecondsPerSecond)};
  wire.time_us = static_cast<std::uint32_t>(ns / 1000);
  return wire;
}

/// The different exposure times, shortest first, at most the three longest. Empty: not told.
std::vector<double> exposuresOf(const Frame& frame) {
  std::set<double> different;
  for (const Exposure& one : frame.moment.exposures) {
    if (one.duration > 0_s) different.insert(one.duration.in(microsecond));
  }
  std::vector<double> us(different.begin(), different.end());
  constexpr std::size_t kMost = 3;
  if (us.size() > kMost) us.erase(us.begin(), us.end() - kMost);
  return us;
}

void describeExposures(const Frame& frame, const std::vector<double>& exposures_us, TofInfo& info) {
  for (std::size_t i = 0; i < exposures_us.size(); ++i) {
    info.amplitude_factors[i] = static_cast<float>(1.0 / exposures_us[i]);
    info.exposures_s[i] = static_cast<float>(exposures_us[i] * 1e-6);
    const auto first = std::ranges::find_if(frame.moment.exposures, [&](const Exposure& one) {
      return one.duration.in(microsecond) == exposures_us[i];
    });
    if (first != frame.moment.exposures.end())
      info.exposure_starts_ns[i] = static_cast<std::uint64_t>(hostTimeOf(frame, first->start));
  }
}

TofInfo infoOf(const Frame& frame, const LensModels& lens, const Scales& scales, const HeadSettings& settings,
               const std::vector<double>& exposures_us) {
  TofInfo info;
  info.distance_resolution_m = scales.distance_resolution_m;
  info.amplitude_resolution = toftwin::o3r::kAmplitudeResolution;
  info.optic_to_user = settings.optic_to_user;
  info.intrinsics = lens.intrinsics;
  info.inverse_intrinsics = lens.inverse_intrinsics;
  describeExposures(frame, exposures_us, info);
  info.illumination_c = kNoSensor_c;
  for (const NamedTemperature& one : frame.moment.temperatures) {
    if (one.where == "illumination") info.illumination_c = static_cast<float>(one.value.in(celsius));
  }
  info.mode = settings.mode;
  info.imager = kImager;
  info.least_range_m = kLeastRange_m;
  info.most_range_m = static_cast<float>(toftwin::o3r::kMostCounts) * scales.distance_resolution_m;
  return info;
}

Result<std::vector<std::uint16_t>> distancesOf(const Frame& frame, float resolution_m) {
  const Plane* range = planeOf(frame, PlaneKind::Range, ElementType::F32);
  const Plane* depth = planeOf(frame, PlaneKind::Depth, ElementType::F32);
  if (range == nullptr && depth == nullptr)
    return Error{Error::Code::Unsupported,
                 "the source has neither range nor depth, which a 3D head is made of"};
  const auto metres = (range != nullptr ? range : depth)->as<float>();
  const std::vector<float> rays = range != nullptr ? std::vector<float>{} : unitVectorsOf(frame.camera);
  std::vector<std::uint16_t> counts(metres.size());
  for (std::size_t i = 0; i < metres.size(); ++i) {
    const double per_range = range != nullptr ? 1.0 : static_cast<double>(rays[3 * i + 2]);
    counts[i] = toftwin::o3r::distanceCounts(static_cast<double>(metres[i]) / per_range, resolution_m);
  }
  return counts;
}

/// Per pixel: index 0 is the longest.
double exposureOf(const std::vector<double>& exposures_us, unsigned index) {
  if (exposures_us.empty()) return kUnknownExposure_us;
  return exposures_us[exposures_us.size() - 1 - std::min<std::size_t>(index, exposures_us.size() - 1)];
}

}  // namespace

LensModels lensModelsOf(const CameraInfo& camera) {
  LensModels lens{.camera = camera, .inverse_intrinsics = toftwin::o3r::inverseModelOf(camera)};
  lens.intrinsics = lens.inverse_intrinsics;
  lens.intrinsics.model = 0;
  const auto back = ifm::inverseDistortion(camera);
  constexpr std::size_t kDistortion = 5;  // the place of k1
  for (std::size_t i = 0; i < back.size(); ++i)
    lens.intrinsics.parameters[kDistortion + i] = static_cast<float>(back[i]);
  return lens;
}

Result<HeadImages> images3d(const Frame& frame, const LensModels& lens, const Scales& scales,
                            const HeadSettings& settings) {
  auto distance = distancesOf(frame, scales.distance_resolution_m);
  if (!distance) return distance.error();
  HeadImages images{.distance = *std::move(distance), .wire = headerOf(frame)};
  const std::vector<double> exposures_us = exposuresOf(frame);
  const Plane* amplitude = planeOf(frame, PlaneKind::Amplitude, ElementType::F32);
  const Plane* flags = planeOf(frame, PlaneKind::Flags, ElementType::U8);
  const Plane* exposure = planeOf(frame, PlaneKind::Exposure, ElementType::U8);
  images.amplitude.resize(images.distance.size());
  images.confidence.resize(images.distance.size());
  for (std::size_t i = 0; i < images.distance.size(); ++i) {
    const unsigned index = exposure != nullptr ? exposure->as<std::uint8_t>()[i] : 0U;
    if (amplitude != nullptr) {
      const double counts = static_cast<double>(amplitude->as<float>()[i]) / scales.electrons_per_count;
      images.amplitude[i] = toftwin::o3r::amplitudeCounts(counts / exposureOf(exposures_us, index),
                                                          toftwin::o3r::kAmplitudeResolution);
    }
    unsigned confidence = flags != nullptr ? toftwin::o3r::confidenceOf(flags->as<std::uint8_t>()[i]) : 0U;
    confidence |= toftwin::o3d303::confidenceOfExposure(index);
    constexpr auto kInvalid = static_cast<unsigned>(toftwin::o3r::Confidence::Invalid);
    if (images.distance[i] == 0) confidence |= kInvalid;
    if ((confidence & kInvalid) != 0) images.distance[i] = 0;
    images.confidence[i] = static_cast<std::uint16_t>(confidence);
  }
  images.wire.distance = images.distance;
  images.wire.amplitude = images.amplitude;
  images.wire.confidence = images.confidence;
  images.wire.tof_info = infoOf(frame, lens, scales, settings, exposures_us);
  return images;
}

Result<HeadImages> images2d(const Frame& frame, const LensModels& lens, const Scales& scales,
                            const HeadSettings& settings) {
  const Plane* color = frame.find(PlaneKind::Color);
  constexpr int kChannels = 3;
  if (color == nullptr || color->type != ElementType::U8 || color->channels != kChannels ||
      color->data.size() != color->byteSize())
    return Error{Error::Code::Unsupported, "the source has no colour image, which a 2D head is made of"};
  auto jpeg =
      pictures::encodeJpeg(color->as<std::uint8_t>(), color->width, color->height, scales.jpeg_quality);
  if (!jpeg) return jpeg.error();
  HeadImages images{.jpeg = *std::move(jpeg), .wire = headerOf(frame)};
  images.wire.width = static_cast<std::uint32_t>(color->width);
  images.wire.height = static_cast<std::uint32_t>(color->height);
  images.wire.jpeg = images.jpeg;
  toftwin::o3r::RgbInfo info{.frame_count = images.wire.frame_count,
                             .start_ns = static_cast<std::uint64_t>(beginOf(frame)),
                             .optic_to_user = settings.optic_to_user,
                             .intrinsics = lens.intrinsics,
                             .inverse_intrinsics = lens.inverse_intrinsics};
  if (!frame.moment.exposures.empty())
    info.exposure_s = static_cast<float>(frame.moment.exposures.front().duration.in(second));
  images.wire.rgb_info = info;
  return images;
}

std::vector<std::byte> algorithmMessage(const HeadImages& images) {
  const std::string text = fmt::format(R"({{"frameCount":{},"width":{},"height":{}}})",
                                       images.wire.frame_count, images.wire.width, images.wire.height);
  std::vector<std::byte> message;
  toftwin::o3d303::appendText(message, toftwin::o3d303::kFrameBegin);
  appendBytesChunk(message, toftwin::o3r::ChunkTypes::kAlgorithm, images.wire,
                   std::as_bytes(std::span{text}));
  toftwin::o3d303::appendText(message, toftwin::o3d303::kFrameEnd);
  return message;
}

}  // namespace toftwin::daemon::o3r
