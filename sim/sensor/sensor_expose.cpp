// SPDX-License-Identifier: Apache-2.0
// From light to samples to ranges: what a sensor model does with each frame.
#include <algorithm>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include "sim/effects/charge_noise.h"
#include "sim/images/rows.h"
#include "sim/sensor/correlate.h"
#include "sim/sensor/exposures.h"
#include "sim/sensor/sensor_model_impl.h"

namespace toftwin::sim {
namespace {

constexpr std::size_t kMostEffects = 1000;

/// Applies those effects that act on this type of image, in their order.
template <class Of>
Of applyAll(Of image, const std::vector<AnyEffect>& effects, const Conditions& now,
            std::uint64_t seed, std::uint64_t frame) {
  for (std::size_t place = 0; place < effects.size(); ++place) {
    std::visit(
        [&]<class E>(const E& effect) {
          if constexpr (std::is_same_v<ImageOf<E>, Of>) {
            image = effect.apply(std::move(image), now,
                                 Random{seed, frame, effectKey(E::about.name, place)});
          }
        },
        effects[place]);
  }
  return image;
}

/// The same of samples, of which each of several exposures has noise of its own. What can be done together is
/// done in one pass.
Samples applyOnSamples(Samples samples, const std::vector<AnyEffect>& effects, const Conditions& now,
                       std::uint64_t seed, std::uint64_t frame, std::size_t exposure) {
  for (std::size_t place = 0; place < effects.size(); ++place) {
    const auto randomOf = [&](std::string_view name, std::size_t at) {
      return Random{seed, frame, effectKey(name, at + kMostEffects * exposure)};
    };
    if (const auto joint = ChargeNoise::from(effects, place)) {
      samples = joint->apply(std::move(samples), now, randomOf(ShotNoise::about.name, place),
                             randomOf(ReadNoise::about.name, joint->read_place));
      place = joint->read_place;
      continue;
    }
    std::visit(
        [&]<class E>(const E& effect) {
          if constexpr (std::is_same_v<ImageOf<E>, Samples>)
            samples = effect.apply(std::move(samples), now, randomOf(E::about.name, place));
        },
        effects[place]);
  }
  return samples;
}

/// Effects on samples look at one pixel at a time: strip by strip, samples stay in the processor's cache
/// from the first effect to the last. `fill(top, part)` writes what the rows from `top` on hold before them.
template <class Fill>
void countInStrips(const Fill& fill, const std::vector<AnyEffect>& effects, const Conditions& now,
                   std::uint64_t seed, std::uint64_t frame, std::size_t exposure, Samples& samples) {
  constexpr int kRows = 16;
  const int width = samples.width(), height = samples.height();
  Image<std::uint8_t> flags{width, height};
  std::vector<std::uint8_t> is_flagged(static_cast<std::size_t>(height));
  const auto strip = [&](int top, Samples part) {
    const auto count = static_cast<std::ptrdiff_t>(width) * part.height();
    fill(top, part);
    Conditions here = now;
    here.top += top;
    part = applyOnSamples(std::move(part), effects, here, seed, frame, exposure);
    for (std::size_t i = 0; i < part.electrons.size(); ++i)
      std::copy_n(&part.electrons[i](0, 0), count, &samples.electrons[i](0, top));
    if (part.flags.empty()) return part;
    std::copy_n(&part.flags(0, 0), count, &flags(0, top));
    is_flagged[static_cast<std::size_t>(top)] = 1;
    return part;
  };
  inParallel((height + kRows - 1) / kRows, 1, [&](int first, int last) {
    Samples part{.frequencies = samples.frequencies, .steps = samples.steps, .taps = samples.taps};
    for (int i = first; i < last; ++i) {
      const int rows = std::min(kRows, height - i * kRows);
      if (part.height() != rows) part.electrons.assign(samples.electrons.size(), Image<float>{width, rows});
      part.flags = {};
      part = strip(i * kRows, std::move(part));
    }
  });
  if (std::ranges::count(is_flagged, 1) > 0) samples.flags = std::move(flags);
}

/// The same of samples that were collected.
Samples applyInStrips(Samples samples, const std::vector<AnyEffect>& effects, const Conditions& now,
                      std::uint64_t seed, std::uint64_t frame, std::size_t exposure) {
  const auto take = [&](int top, Samples& part) {
    const auto count = static_cast<std::ptrdiff_t>(samples.width()) * part.height();
    for (std::size_t i = 0; i < part.electrons.size(); ++i)
      std::copy_n(&samples.electrons[i](0, top), count, &part.electrons[i](0, 0));
    if (samples.flags.empty()) return;
    part.flags = Image<std::uint8_t>{part.width(), part.height()};
    std::copy_n(&samples.flags(0, top), count, &part.flags(0, 0));
  };
  countInStrips(take, effects, now, seed, frame, exposure, samples);
  return samples;
}

bool anyActsOnLight(const std::vector<AnyEffect>& effects) {
  for (const AnyEffect& any : effects) {
    if (std::visit([]<class E>(const E&) { return std::is_same_v<ImageOf<E>, Light>; }, any))
      return true;
  }
  return false;
}

bool anyAsksForTheScene(const std::vector<AnyEffect>& effects) {
  return std::ranges::any_of(effects,
                             [](const AnyEffect& any) { return std::holds_alternative<LearnedLight>(any); });
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

std::vector<Response> responsesFor(const SensorModel::Impl& impl, double exposure_factor) {
  std::vector<Response> responses = impl.responses;
  for (Response& response : responses) response.electrons_per_radiance *= exposure_factor;
  return responses;
}

/// The charge that the light makes in one exposure, free of noise.
Samples samplesOf(const SensorModel::Impl& impl, const Light& light, double exposure_factor) {
  if (impl.file.isPulsed()) {
    const CameraFile::PulseKeys& keys = impl.file.pulses.front();
    const double seconds = exposure_factor * keys.exposure.in(second);
    return collectGates(light, keys.pulse, impl.file.pixel.electrons_per_radiance_s * seconds,
                        keys.open_share);
  }
  return correlate(light, responsesFor(impl, exposure_factor), impl.file.sampling.steps,
                   impl.file.sampling.taps);
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
  if (impl_->file.isPulsed() || exposureCount() > 1 || remembers()) {
    return readOut(collect(light, moment, seed, frame, region_x, region_y), moment, seed, frame, region_x,
                   region_y, before);
  }
  // The same without whole images of what is collected: a strip's samples are made where its effects find
  // them.
  const Conditions now{moment, impl_->camera, region_x, region_y, before};
  const bool is_changed = anyActsOnLight(impl_->effects);
  const Light changed = is_changed ? lightAfterEffects(light, now, seed, frame) : Light{};
  const Light& seen = is_changed ? changed : light;
  const std::vector<Response> responses = responsesFor(*impl_, impl_->file.sampling.exposure_factors.front());
  const Correlator correlator{seen, responses, impl_->file.sampling.steps, impl_->file.sampling.taps};
  Samples counted = correlator.rows(seen.height());
  countInStrips([&](int top, Samples& part) { correlator.collect(top, 0, part.height(), part); },
                impl_->effects, now, seed, frame, 0, counted);
  Exposed exposed = decodeCounted(std::move(counted), now);
  exposed.range = applyAll(std::move(exposed.range), impl_->effects, now, seed, frame);
  return exposed;
}

Light SensorModel::lightAfterEffects(const Light& light, const Conditions& now, std::uint64_t seed,
                                     std::uint64_t frame) const {
  const bool wants_all = light.frequencies.empty() || impl_->addsHarmonics();
  Light seen = correlatedPart(light, impl_->responses, wants_all);
  if (anyAsksForTheScene(impl_->effects)) seen.truth = light.truth;
  return applyAll(std::move(seen), impl_->effects, now, seed, frame);
}

Samples SensorModel::collect(const Light& light, const Moment& moment, std::uint64_t seed,
                             std::uint64_t frame, int region_x, int region_y) const {
  if (!anyActsOnLight(impl_->effects)) return samplesOf(*impl_, light);
  const Conditions now{moment, impl_->camera, region_x, region_y};
  return samplesOf(*impl_, lightAfterEffects(light, now, seed, frame));
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
  // What remembers looks at whole images.
  const auto apply = remembers() ? applyOnSamples : applyInStrips;
  return decodeCounted(apply(std::move(collected), impl_->effects, now, seed, frame, exposure), now);
}

SensorModel::Exposed SensorModel::decodeCounted(Samples counted, const Conditions& now) const {
  const bool is_whole =
      counted.width() == impl_->camera.width && counted.height() == impl_->camera.height;
  RangeImage range = is_whole ? decode(counted, impl_->decoder, impl_->rays)
                              : decodeRegion(*impl_, counted, now.left, now.top);
  return {std::move(counted), std::move(range)};
}

}  // namespace toftwin::sim
