// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor/interference.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "sim/sensor/collect_moving.h"
#include "sim/sensor/sensor_model_impl.h"

namespace toftwin::sim {
namespace {

/// Of the camera's own fundamental: a beat of less is not traced.
constexpr double kNothing = 1e-6;
/// As in correlate(): a waveform has no harmonic below.
constexpr double kNoContent = 1e-12;

/// sin x / x with x = π Δ T.
double leftOf(Frequency difference, Duration exposure) {
  const double half_turns = std::numbers::pi * difference.in(hertz) * exposure.in(second);
  return std::abs(half_turns) < 1e-8 ? 1.0 : std::sin(half_turns) / half_turns;
}

}  // namespace

Interference::Interference(ForeignEmitterSpec emitter, const std::vector<Own>& own, int harmonics)
    : emitter_(std::move(emitter)) {
  for (std::size_t i = 0; i < own.size(); ++i) {
    const double fundamental = std::abs(own[i].emitted.coefficient(1, own[i].frequency) *
                                        own[i].demodulating.coefficient(1, own[i].frequency));
    const auto is_positive = [](double value) { return std::isfinite(value) && value > 0.0; };
    if (!is_positive(emitter_.frequency.in(hertz)) || !is_positive(own[i].frequency.in(hertz)) || !is_positive(fundamental))
      throw std::invalid_argument{"interference needs frequencies above 0 and waveforms with a fundamental"};
    for (int n = 1; n <= harmonics; ++n) addBeatsOf(i, own[i], n, fundamental);
  }
}

std::complex<double> Interference::coefficient(int times, const Waveform& like) const {
  Waveform wave{.duty = emitter_.duty, .clip = emitter_.clip, .rise = emitter_.rise};
  switch (emitter_.emitted) {
    case ForeignEmitterSpec::Wave::LikeCamera:
      wave = like;
      break;
    case ForeignEmitterSpec::Wave::Sine:
      wave.shape = Waveform::Shape::Sine;
      break;
    case ForeignEmitterSpec::Wave::Square:
      wave.shape = Waveform::Shape::Square;
      break;
    case ForeignEmitterSpec::Wave::ClippedSine:
      wave.shape = Waveform::Shape::ClippedSine;
      break;
  }
  return emitter_.modulation * wave.coefficient(times, emitter_.frequency);
}

void Interference::addBeatsOf(std::size_t own, const Own& modulation, int harmonic, double fundamental) {
  const std::complex<double> emitted = modulation.emitted.coefficient(harmonic, modulation.frequency),
                             reference = std::conj(modulation.demodulating.coefficient(harmonic, modulation.frequency));
  const bool is_lacking = std::abs(emitted * reference) / fundamental < kNoContent;
  bool is_any = false;
  const double ratio = harmonic * (modulation.frequency / emitter_.frequency);
  const int below = static_cast<int>(std::floor(ratio));
  for (const int times : {below, below + 1}) {
    if (times == 0) continue;
    const std::complex<double> other = coefficient(times, modulation.emitted);
    if (std::abs(other * reference) / fundamental < kNothing) continue;
    const Frequency difference =
        static_cast<double>(times) * emitter_.frequency - static_cast<double>(harmonic) * modulation.frequency;
    is_any = true;
    beats_.push_back({own, harmonic, frequencyOf(times), times, difference, is_lacking ? other : other / emitted});
  }
  if (is_any && is_lacking) lacking_.push_back({own, harmonic, reference / fundamental});
}

std::size_t Interference::frequencyOf(int times) {
  const Frequency wanted = static_cast<double>(times) * emitter_.frequency;
  const auto at = std::ranges::find(frequencies_, wanted);
  const auto index = static_cast<std::size_t>(at - frequencies_.begin());
  if (at == frequencies_.end()) frequencies_.push_back(wanted);
  return index;
}

TraceRequest Interference::request(const TraceRequest& own) const {
  const auto& p = emitter_.position_m;
  const auto& a = emitter_.axis;
  const Transform<Camera, World> camera_from_world = own.world_from_camera.inverse();
  TraceRequest request = own;
  request.emitters = {{.position_m = (camera_from_world * Point<World>{{p[0], p[1], p[2]}}).m,
                       .axis = camera_from_world.rotate(normalised(Vec3d{a[0], a[1], a[2]})),
                       .radius = emitter_.radius,
                       .power_w = emitter_.power_w,
                       .lobe_exponent = emitter_.lobe_exponent,
                       .half_angle = emitter_.half_angle,
                       .isotropic = emitter_.isotropic}};
  request.frequencies = frequencies_;
  if (frequencies_.empty()) request.frequencies = {emitter_.frequency};  // its mean alone is wanted
  request.harmonics = 1;
  request.gates.clear();
  request.seed = own.seed ^ 0x6a09e667f3bcc909u;  // its paths' noise is its own
  return request;
}

void Interference::addTo(Light& light, const Light& other, const Exposure& exposure, Duration row_delay) const {
  for (std::size_t i = 0; i < light.ambient.size(); ++i) light.ambient[i] += other.steady[i];
  const auto isSeen = [&](std::size_t own) { return light.frequencies[own] == exposure.modulation; };
  for (const Lacking& one : lacking_) {
    if (!isSeen(one.own)) continue;
    light.error.content.resize(light.phasors.size());
    std::complex<float>& content =
        light.error.content[one.own * static_cast<std::size_t>(light.harmonics) + static_cast<std::size_t>(one.harmonic - 1)];
    if (content != std::complex<float>{}) continue;  // another one was added before
    content = std::complex<float>{one.content};
    light.phasor(one.own, one.harmonic) = {light.width(), light.height()};
  }
  for (const Beat& beat : beats_) {
    if (isSeen(beat.own)) addBeat(beat, other, exposure, row_delay, light);
  }
}

void Interference::addBeat(const Beat& beat, const Light& other, const Exposure& exposure, Duration row_delay,
                           Light& light) const {
  const std::complex<double> weight = beat.weight * leftOf(beat.difference, exposure.duration) *
                                      std::polar(1.0, beat.times * emitter_.phase.in(radian));
  const Image<std::complex<float>>& added = other.phasor(beat.other, 1);
  Image<std::complex<float>>& sum = light.phasor(beat.own, beat.harmonic);
  for (int y = 0; y < sum.height(); ++y) {
    const Duration time = middleOf(exposure) + y * row_delay;
    const double turns = std::remainder(beat.difference.in(hertz) * time.in(second), 1.0);
    const std::complex<float> factor{weight * std::polar(1.0, 2.0 * std::numbers::pi * turns)};
    for (int x = 0; x < sum.width(); ++x) sum(x, y) += factor * added(x, y);
  }
}

std::vector<Interference> SensorModel::interferences(const std::vector<ForeignEmitterSpec>& emitters) const {
  std::vector<Interference::Own> own;
  for (const auto& modulation : impl_->file.modulations)
    own.push_back({modulation.frequency, modulation.emitted, modulation.demodulating});
  std::vector<Interference> all;
  for (const ForeignEmitterSpec& emitter : emitters)
    all.emplace_back(emitter, own, impl_->addsHarmonics() ? 1 : impl_->file.sampling.harmonics);
  return all;
}

}  // namespace toftwin::sim
