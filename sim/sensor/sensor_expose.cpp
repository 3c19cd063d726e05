// SPDX-License-Identifier: Apache-2.0
// From light to samples to ranges: what a sensor model does with each frame.
#include <algorithm>
#include <functional>
#include <memory>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include "sim/decode/kinect_v2.h"
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
          if constexpr (ActsOn<E, Of>) {
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
          if constexpr (ActsOn<E, Samples>)
            samples = effect.apply(std::move(samples), now, randomOf(E::about.name, place));
        },
        effects[place]);
  }
  return samples;
}

/// Effects on samples look at one pixel at a time: strip by strip, samples stay in the processor's cache
/// from the first effect to the last. `filler()` makes, for one part of the work, what writes the samples from row `top`
/// on as they are before them, `fill(top, part)`; `take(top, part)` reads what they are after them, on many threads.
template <class Filler, class Take>
void countInStrips(const Samples& shape, int width, int height, const Filler& filler,
                   const std::vector<AnyEffect>& effects, const Conditions& now, std::uint64_t seed, std::uint64_t frame, std::size_t exposure,
                   const Take& take) {
  constexpr int kRows = 8;
  const std::size_t images = shape.frequencies.size() * static_cast<std::size_t>(shape.steps * shape.taps);
  struct Strip {
    decltype(filler()) fill;
    Samples part;
  };
  const auto make = [&] {
    return Strip{filler(), {.frequencies = shape.frequencies, .steps = shape.steps, .taps = shape.taps}};
  };
  const auto count = [&](int top, Strip& strip) {
    const int rows = std::min(kRows, height - top);
    Samples& part = strip.part;
    if (part.height() != rows) part.electrons.assign(images, Image<float>{width, rows});
    part.flags = {};
    strip.fill(top, part);
    Conditions here = now;
    here.top += top;
    part = applyOnSamples(std::move(part), effects, here, seed, frame, exposure);
    take(top, part);
  };
  Rooms<Strip> strips;
  inParallel((height + kRows - 1) / kRows, 1, [&](int first, int last) {
    strips.use(make, [&](Strip& strip) {
      for (int i = first; i < last; ++i) count(i * kRows, strip);
    });
  });
}

/// Puts strips of counted samples together.
class WholeSamples {
 public:
  explicit WholeSamples(Samples& samples)
      : samples_(samples),
        flags_(samples.width(), samples.height()),
        is_flagged_(static_cast<std::size_t>(samples.height())) {}

  void take(int top, const Samples& part) {
    const auto count = static_cast<std::ptrdiff_t>(samples_.width()) * part.height();
    for (std::size_t i = 0; i < part.electrons.size(); ++i)
      std::copy_n(&part.electrons[i](0, 0), count, &samples_.electrons[i](0, top));
    if (part.flags.empty()) return;
    std::copy_n(&part.flags(0, 0), count, &flags_(0, top));
    is_flagged_[static_cast<std::size_t>(top)] = 1;
  }
  void finish() {
    if (std::ranges::count(is_flagged_, 1) > 0) samples_.flags = std::move(flags_);
  }

 private:
  Samples& samples_;
  Image<std::uint8_t> flags_;
  std::vector<std::uint8_t> is_flagged_;  ///< by the strip's top
};

/// The same of samples that were collected.
Samples applyInStrips(Samples samples, const std::vector<AnyEffect>& effects, const Conditions& now,
                      std::uint64_t seed, std::uint64_t frame, std::size_t exposure) {
  WholeSamples whole{samples};
  const auto fill = [&](int top, Samples& part) {
    const auto count = static_cast<std::ptrdiff_t>(samples.width()) * part.height();
    for (std::size_t i = 0; i < part.electrons.size(); ++i)
      std::copy_n(&samples.electrons[i](0, top), count, &part.electrons[i](0, 0));
    if (samples.flags.empty()) return;
    part.flags = Image<std::uint8_t>{part.width(), part.height()};
    std::copy_n(&samples.flags(0, top), count, &part.flags(0, 0));
  };
  countInStrips(samples, samples.width(), samples.height(), [&] { return fill; }, effects, now, seed, frame, exposure,
                [&](int top, const Samples& part) { whole.take(top, part); });
  whole.finish();
  return samples;
}

/// Those that change this light.
std::vector<const AnyEffect*> actingOnLight(const std::vector<AnyEffect>& effects, const Light& light,
                                            const Conditions& now) {
  std::vector<const AnyEffect*> acting;
  for (const AnyEffect& any : effects) {
    if (!actsOn<Light>(any)) continue;
    const auto* ambient = std::get_if<AmbientLight>(&any);
    if (ambient == nullptr || ambient->shines(light, now)) acting.push_back(&any);
  }
  return acting;
}

bool anyAsksForTheScene(const std::vector<AnyEffect>& effects) {
  return std::ranges::any_of(effects, [](const AnyEffect& any) {
    return std::holds_alternative<Learned>(any) && actsOn<Light>(any);
  });
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

/// Samples of so many pixels, all zero.
Samples rowsOfSamples(const SensorModel::Impl& impl, int width, int height) {
  Samples samples{.steps = impl.file.sampling.steps, .taps = impl.file.sampling.taps};
  for (const Response& response : impl.responses) samples.frequencies.push_back(response.frequency);
  if (width > 0) {
    samples.electrons.assign(samples.frequencies.size() * static_cast<std::size_t>(samples.steps * samples.taps),
                             Image<float>{width, height});
  }
  return samples;
}

/// The scatter, if it alone acts and can be made row by row.
const LensScatter* onlyScatter(const std::vector<const AnyEffect*>& acting) {
  const auto* scatter = acting.size() == 1 ? std::get_if<LensScatter>(acting.front()) : nullptr;
  return scatter != nullptr && goesByRows(*scatter) ? scatter : nullptr;
}

/// Scatters and correlates row by row. One for each part of the work.
class ScatteredFill {
 public:
  ScatteredFill(const ScatteredRows& scattered, const std::vector<Response>& responses, int steps, int taps)
      : scattered_(scattered),
        row_(std::make_unique<Light>(scattered.room(1))),
        correlator_(*row_, responses, steps, taps) {}

  void operator()(int top, Samples& part) {
    for (int y = 0; y < part.height(); ++y) {
      scattered_.write(top + y, 1, halo_, *row_);
      correlator_.collect(-y, y, y + 1, part);
    }
  }

 private:
  const ScatteredRows& scattered_;
  std::unique_ptr<Light> row_;  ///< whose place the correlator knows
  std::vector<float> halo_;
  Correlator correlator_;
};

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
  if (!countsInStrips()) {
    return readOut(collect(light, moment, seed, frame, region_x, region_y), moment, seed, frame, region_x,
                   region_y, before);
  }
  const Conditions now{moment, impl_->camera, region_x, region_y, before, frame};
  Samples counted = rowsOfSamples(*impl_, light.width(), light.height());
  WholeSamples whole{counted};
  countLight(light, now, seed, frame, [&](int top, const Samples& part) { whole.take(top, part); });
  whole.finish();
  Exposed exposed = decodeCounted(std::move(counted), now);
  exposed.range = applyAll(std::move(exposed.range), impl_->effects, now, seed, frame);
  return exposed;
}

RangeImage SensorModel::measure(const Light& light, const Moment& moment, std::uint64_t seed,
                                std::uint64_t frame) const {
  const bool is_whole = light.width() == impl_->camera.width && light.height() == impl_->camera.height;
  if (!countsInStrips() || !is_whole || impl_->decoder.algorithm != DecodeSettings::Algorithm::KinectV2)
    return expose(light, moment, seed, frame).range;
  const Conditions now{moment, impl_->camera, 0, 0, {}, frame};
  KinectV2Decoder decoder{rowsOfSamples(*impl_, 0, 0), light.width(), light.height(), impl_->decoder, impl_->rays};
  countLight(light, now, seed, frame,
             [&](int top, const Samples& part) { decoder.take(top, part, 0, part.height()); });
  return applyAll(decoder.finish(), impl_->effects, now, seed, frame);
}

bool SensorModel::countsInStrips() const { return !impl_->file.isPulsed() && exposureCount() == 1 && !remembers(); }

/// From light to counted samples without whole images of what is collected: a strip's samples are made where its
/// effects find them, and so is the scattered light.
void SensorModel::countLight(const Light& light, const Conditions& now, std::uint64_t seed, std::uint64_t frame,
                             const std::function<void(int, const Samples&)>& take) const {
  const std::vector<Response> responses = responsesFor(*impl_, impl_->file.sampling.exposure_factors.front());
  const int steps = impl_->file.sampling.steps, taps = impl_->file.sampling.taps;
  const Samples shape = rowsOfSamples(*impl_, 0, 0);
  const auto count = [&](const auto& filler) {
    countInStrips(shape, light.width(), light.height(), filler, impl_->effects, now, seed, frame, 0, take);
  };
  const auto acting = actingOnLight(impl_->effects, light, now);
  if (const LensScatter* scatter = onlyScatter(acting)) {
    const ScatteredRows scattered{*scatter, light, sim::correlatedTerms(responses, light)};
    count([&] { return ScatteredFill{scattered, responses, steps, taps}; });
    return;
  }
  const bool is_changed = !acting.empty();
  const Light changed = is_changed ? lightAfterEffects(light, now, seed, frame) : Light{};
  const Correlator correlator{is_changed ? changed : light, responses, steps, taps};
  count([&] { return [&](int top, Samples& part) { correlator.collect(top, 0, part.height(), part); }; });
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
  const Conditions now{moment, impl_->camera, region_x, region_y, {}, frame};
  if (actingOnLight(impl_->effects, light, now).empty()) return samplesOf(*impl_, light);
  return samplesOf(*impl_, lightAfterEffects(light, now, seed, frame));
}

SensorModel::Exposed SensorModel::readOut(Samples collected, const Moment& moment,
                                          std::uint64_t seed, std::uint64_t frame, int region_x,
                                          int region_y, History before) const {
  Exposed exposed = decoded(std::move(collected), moment, seed, frame, region_x, region_y, before);
  exposed.range = finished(std::move(exposed.range), moment, seed, frame, region_x, region_y, before);
  return exposed;
}

SensorModel::Exposed SensorModel::decoded(Samples collected, const Moment& moment, std::uint64_t seed,
                                          std::uint64_t frame, int region_x, int region_y, History before) const {
  const Conditions now{moment, impl_->camera, region_x, region_y, before, frame};
  const std::size_t count = exposureCount();
  if (count == 1) return readOutOne(std::move(collected), 0, now, seed, frame);
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
  return {joinExposures(samples), mergeExposures(ranges)};
}

RangeImage SensorModel::finished(RangeImage decoded, const Moment& moment, std::uint64_t seed, std::uint64_t frame,
                                 int region_x, int region_y, History before) const {
  const Conditions now{moment, impl_->camera, region_x, region_y, before, frame};
  return applyAll(std::move(decoded), impl_->effects, now, seed, frame);
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
