// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/captures/reading.h"

#include <algorithm>
#include <cmath>
#include <variant>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "calib/compare/statistics.h"

namespace toftwin::discover {
namespace {

Reading asReading(const sim::RangeImage& image) {
  Reading reading{image.range_m, Image<float>(image.range_m.width(), image.range_m.height(), kNaN)};
  for (std::size_t i = 0; i < image.range_m.size(); ++i) {
    if (!(image.range_m[i] > 0.0F)) reading.range_m[i] = kNaN;
    if (std::isfinite(reading.range_m[i]) && image.amplitude[i] > 0.0F)
      reading.log_amplitude[i] = std::log(image.amplitude[i]);
  }
  return reading;
}

/// In microseconds; 0: that of the camera file.
double exposureOf(const sim::SensorModel& model, const MeasuredCapture& capture) {
  const auto& measured = capture.moment.exposures;
  const auto own = model.exposures({});
  const bool is_same = measured.size() == own.size() &&
                       std::ranges::equal(own, measured, [](const auto& a, const auto& b) {
                         return std::abs((a.duration - b.duration).in(microsecond)) < 1e-3;
                       });
  return measured.empty() || is_same ? 0.0 : measured.front().duration.in(microsecond);
}

/// What a model's noise does to a mean stays: steps are as smeared as in the mean over frames.
void smearSteps(const sim::SensorModel& model, std::vector<sim::AnyEffect>& effects) {
  sim::NoiseOfCharge noise;
  for (const sim::AnyEffect& any : model.effects()) {
    if (const auto* shot = std::get_if<sim::ShotNoise>(&any)) noise.fano += shot->fano;
    if (const auto* read = std::get_if<sim::ReadNoise>(&any))
      noise.variance += read->sigma_electrons * read->sigma_electrons;
  }
  for (sim::AnyEffect& any : effects) {
    if (auto* companding = std::get_if<sim::Companding>(&any)) companding->mean_over = noise;
    if (auto* quantisation = std::get_if<sim::Quantisation>(&any)) quantisation->mean_over = noise;
  }
}

}  // namespace

std::vector<sim::AnyEffect> effectsWithoutNoise(const sim::SensorModel& model) {
  std::vector<sim::AnyEffect> effects = model.effects();
  std::erase_if(effects, [](const sim::AnyEffect& any) {
    return std::visit(
        []<class E>(const E& effect) { return sim::explainsOf(effect).contains(sim::Covariate::Frame); }, any);
  });
  return effects;
}

void takeNoiseOff(const sim::SensorModel& model, std::vector<MeasuredCapture>& captures) {
  const auto frequencies = static_cast<float>(model.traceRequest().frequencies.size());
  for (MeasuredCapture& capture : captures) {
    const float of_frames = 0.5F * (frequencies - 1.0F) * static_cast<float>(capture.frames);
    const Image<float>& variance = capture.log_amplitude.variance;
    for (std::size_t i = 0; i < variance.size(); ++i)
      if (std::isfinite(variance[i])) capture.log_amplitude.mean[i] -= of_frames * variance[i];
    Image<float>& range_m = capture.range_m.mean;
    const Image<float>& range_variance = capture.range_m.variance;
    for (std::size_t i = 0; i < range_m.size(); ++i) {
      if (!std::isfinite(range_m[i]) || !std::isfinite(range_variance[i])) continue;
      const double of_frame = static_cast<double>(capture.frames) * static_cast<double>(range_variance[i]);
      range_m[i] -=
          static_cast<float>(of_frame * model.noiseShiftPerVariance(static_cast<double>(range_m[i]) * metre));
    }
  }
}

Moment momentFor(const sim::SensorModel& model, const MeasuredCapture& capture) {
  Moment moment = capture.moment;
  moment.exposures = model.exposures({});
  return moment;
}

Result<NoiselessCamera> NoiselessCamera::make(const sim::SensorModel& model,
                                              std::vector<sim::AnyEffect> effects,
                                              const std::vector<MeasuredCapture>& captures) {
  NoiselessCamera camera;
  smearSteps(model, effects);
  const sim::SensorModel changed = model.withEffects(std::move(effects));
  camera.models_.emplace(0.0, changed);
  for (const MeasuredCapture& capture : captures) {
    const double exposure_us = exposureOf(model, capture);
    if (camera.models_.contains(exposure_us)) continue;
    auto exposed = changed.with("exposure_us", exposure_us);
    if (!exposed) {
      return Error{
          exposed.error().code,
          fmt::format(
              "capture {} (\"{}\") was exposed for {:.6g} us, at which the camera file's camera "
              "cannot be simulated: {}",
              capture.record.number, capture.record.name, exposure_us, exposed.error().message)};
    }
    camera.models_.emplace(exposure_us, *std::move(exposed));
  }
  return camera;
}

Reading changed(Reading a, const Reading& b, const Reading& c) {
  for (std::size_t i = 0; i < a.range_m.size(); ++i) {
    a.range_m[i] += b.range_m[i] - c.range_m[i];
    a.log_amplitude[i] += b.log_amplitude[i] - c.log_amplitude[i];
  }
  return a;
}

Reading readingOf(const NoiselessCamera& declared, const NoiselessCamera& other,
                  const MeasuredCapture& capture, const sim::Light& traced,
                  const sim::Light& varied) {
  return changed(declared.read(capture, traced), other.read(capture, varied),
                 declared.read(capture, varied));
}

const sim::SensorModel& NoiselessCamera::at(const MeasuredCapture& capture) const {
  return models_.at(exposureOf(models_.at(0.0), capture));
}

sim::Samples NoiselessCamera::collect(const MeasuredCapture& capture,
                                      const sim::Light& light) const {
  const sim::SensorModel& model = at(capture);
  return model.collect(light, momentFor(model, capture), 0, 0);
}

Reading NoiselessCamera::read(const MeasuredCapture& capture, const sim::Light& light) const {
  return read(capture, collect(capture, light));
}

Reading NoiselessCamera::read(const MeasuredCapture& capture, const sim::Samples& collected) const {
  const sim::SensorModel& model = at(capture);
  const Moment moment = momentFor(model, capture);
  auto exposed = model.readOut(collected, moment, 0, 0);
  if (model.remembers()) {  // repeats: the frame before saw the same
    const sim::RangeImage before = std::move(exposed.range);
    exposed = model.readOut(collected, moment, 0, 0, 0, 0, {&collected, &before});
  }
  return asReading(exposed.range);
}

Reading NoiselessCamera::read(const MeasuredCapture& capture, const sim::RangeImage& decoded) const {
  const sim::SensorModel& model = at(capture);
  return asReading(model.finished(decoded, momentFor(model, capture), 0, 0));
}

sim::RangeImage NoiselessCamera::decode(const MeasuredCapture& capture, const sim::Samples& collected) const {
  const sim::SensorModel& model = at(capture);
  return model.decoded(collected, momentFor(model, capture), 0, 0).range;
}

bool NoiselessCamera::remembers() const { return models_.at(0.0).remembers(); }

StagedReading::StagedReading(const NoiselessCamera& camera, const MeasuredCapture& capture, const sim::Light& light,
                             std::shared_ptr<const sim::Samples> collected)
    : capture_(capture), light_(light), collected_(std::move(collected)) {
  if (collected_ == nullptr) collected_ = std::make_shared<const sim::Samples>(camera.collect(capture, light));
  if (!camera.remembers()) decoded_ = camera.decode(capture, *collected_);
  reading_ = decoded_ ? camera.read(capture, *decoded_) : camera.read(capture, *collected_);
}

Reading StagedReading::by(const NoiselessCamera& other, Stage from) const {
  if (from == Stage::Light) return other.read(capture_, light_);
  if (from == Stage::Range && decoded_ && !other.remembers()) return other.read(capture_, *decoded_);
  return other.read(capture_, *collected_);
}

RawReading NoiselessCamera::readRaw(const MeasuredCapture& capture, const sim::Light& light) const {
  const sim::SensorModel& model = at(capture);
  return rawReadingOf(model.readOut(collect(capture, light), momentFor(model, capture), 0, 0).samples);
}

}  // namespace toftwin::discover
