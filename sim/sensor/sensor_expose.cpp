// SPDX-License-Identifier: Apache-2.0
// From light to samples to ranges: what a sensor model does with each frame.
#include <type_traits>
#include <utility>
#include <variant>

#include "sim/sensor/correlate.h"
#include "sim/sensor/exposures.h"
#include "sim/sensor/sensor_model_impl.h"

namespace toftwin::sim {
namespace {

/// Applies those effects that act on this type of image, in their order. Each of several exposures has noise of
/// its own.
template <class Of>
Of applyAll(Of image, const std::vector<AnyEffect>& effects, const Conditions& now,
            std::uint64_t seed, std::uint64_t frame, std::size_t exposure = 0) {
  constexpr std::size_t kMostEffects = 1000;
  for (std::size_t place = 0; place < effects.size(); ++place) {
    std::visit(
        [&]<class E>(const E& effect) {
          if constexpr (std::is_same_v<ImageOf<E>, Of>) {
            image = effect.apply(std::move(image), now,
                                 Random{seed, frame, effectKey(E::about.name, place + kMostEffects * exposure)});
          }
        },
        effects[place]);
  }
  return image;
}

bool anyActsOnLight(const std::vector<AnyEffect>& effects) {
  for (const AnyEffect& any : effects) {
    if (std::visit([]<class E>(const E&) { return std::is_same_v<ImageOf<E>, Light>; }, any))
      return true;
  }
  return false;
}

template <class T>
Image<T> cropped(const Image<T>& full, int left, int top, int width, int height) {
  Image<T> part{width, height};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) part(x, y) = full(left + x, top + y);
  }
  return part;
}

DecodeRays cropped(const DecodeRays& full, int left, int top, int width, int height) {
  return {cropped(full.x, left, top, width, height), cropped(full.z, left, top, width, height)};
}

/// The charge that the light makes in one exposure, free of noise.
Samples samplesOf(const SensorModel::Impl& impl, const Light& light, double exposure_factor) {
  if (impl.file.isPulsed()) {
    const CameraFile::PulseKeys& keys = impl.file.pulses.front();
    const double seconds = exposure_factor * keys.exposure.in(second);
    return collectGates(light, keys.pulse, impl.file.pixel.electrons_per_radiance_s * seconds,
                        keys.open_share);
  }
  std::vector<Response> responses = impl.responses;
  for (Response& response : responses) response.electrons_per_radiance *= exposure_factor;
  return correlate(light, responses, impl.file.sampling.steps, impl.file.sampling.taps);
}

Samples samplesOf(const SensorModel::Impl& impl, const Light& light) {
  const auto& factors = impl.file.sampling.exposure_factors;
  if (factors.size() == 1) return samplesOf(impl, light, factors.front());
  std::vector<Samples> parts;
  for (const double factor : factors) parts.push_back(samplesOf(impl, light, factor));
  return joinExposures(parts);
}

RangeImage decodeRegion(const SensorModel::Impl& impl, const Samples& samples, int left, int top) {
  const int width = samples.width(), height = samples.height();
  DecodeSettings settings = impl.decoder;
  for (Image<std::complex<float>>& turns : settings.pixel_turns)
    turns = cropped(turns, left, top, width, height);
  return decode(samples, settings, cropped(impl.rays, left, top, width, height));
}

}  // namespace

SensorModel::Exposed SensorModel::expose(const Light& light, const Moment& moment,
                                         std::uint64_t seed, std::uint64_t frame, int region_x,
                                         int region_y, History before) const {
  return readOut(collect(light, moment, seed, frame, region_x, region_y), moment, seed, frame,
                 region_x, region_y, before);
}

Samples SensorModel::collect(const Light& light, const Moment& moment, std::uint64_t seed,
                             std::uint64_t frame, int region_x, int region_y) const {
  if (!anyActsOnLight(impl_->effects)) return samplesOf(*impl_, light);
  const Conditions now{moment, impl_->camera, region_x, region_y};
  const bool wants_all = light.frequencies.empty() || impl_->addsHarmonics();
  Light seen = correlatedPart(light, impl_->responses, wants_all);
  return samplesOf(*impl_, applyAll(std::move(seen), impl_->effects, now, seed, frame));
}

SensorModel::Exposed SensorModel::readOut(Samples collected, const Moment& moment,
                                          std::uint64_t seed, std::uint64_t frame, int region_x,
                                          int region_y, History before) const {
  const Conditions now{moment, impl_->camera, region_x, region_y, before};
  const std::size_t count = exposureCount();
  Exposed exposed;
  if (count == 1) {
    exposed = readOutOne(std::move(collected), 0, now, seed, frame);
  } else {
    std::vector<Samples> samples;
    std::vector<RangeImage> ranges;
    for (std::size_t e = 0; e < count; ++e) {
      Conditions then = now;
      Samples earlier;
      if (before.collected != nullptr) {
        earlier = samplesOfExposure(*before.collected, e, count);
        then.before.collected = &earlier;
      }
      Exposed one = readOutOne(samplesOfExposure(collected, e, count), e, then, seed, frame);
      samples.push_back(std::move(one.samples));
      ranges.push_back(std::move(one.range));
    }
    exposed = {joinExposures(samples), mergeExposures(ranges)};
  }
  exposed.range = applyAll(std::move(exposed.range), impl_->effects, now, seed, frame);
  return exposed;
}

SensorModel::Exposed SensorModel::readOutOne(Samples collected, std::size_t exposure,
                                             const Conditions& now, std::uint64_t seed,
                                             std::uint64_t frame) const {
  Samples counted = applyAll(std::move(collected), impl_->effects, now, seed, frame, exposure);
  const bool is_whole =
      counted.width() == impl_->camera.width && counted.height() == impl_->camera.height;
  RangeImage range = is_whole ? decode(counted, impl_->decoder, impl_->rays)
                              : decodeRegion(*impl_, counted, now.left, now.top);
  return {std::move(counted), std::move(range)};
}

}  // namespace toftwin::sim
