// SPDX-License-Identifier: Apache-2.0
// What a camera file makes: its rays, responses, decoder and light. Frames are made in sensor_expose.cpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/images/content_hash.h"
#include "sim/sensor/color.h"
#include "sim/sensor/factory_calibration.h"
#include "sim/sensor/parameters.h"
#include "sim/sensor/sensor_model_impl.h"

namespace toftwin::sim {
namespace {

std::string canonicalText(CameraFile file, const std::vector<AnyEffect>& effects) {
  CanonicalText canonical;
  file.visit(canonical);
  for (AnyEffect any : effects) {
    std::visit(
        [&]<class E>(E& effect) {
          canonical.written += fmt::format("effect {}\n", E::about.name);
          effect.visit(canonical);
        },
        any);
  }
  return canonical.written;
}

CameraInfo cameraInfo(const CameraFile::Lens& lens) {
  CameraInfo camera{.width = lens.width,
                    .height = lens.height,
                    .fx = lens.fx,
                    .fy = lens.fy,
                    .cx = lens.cx,
                    .cy = lens.cy,
                    .distortion = lens.distortion,
                    .calibration_id = {}};
  CanonicalText canonical;
  CameraFile::Lens copy = lens;
  copy.visit(canonical);
  camera.calibration_id = contentHash(canonical.written);
  return camera;
}

SensorModel::Rays raysOf(const CameraInfo& camera) {
  SensorModel::Rays rays{{camera.width, camera.height}, {camera.width, camera.height}};
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Direction<Camera> ray = rayThroughPixel(camera, x, y);
      rays.x(x, y) = static_cast<float>(ray.v.x);
      rays.z(x, y) = static_cast<float>(ray.v.z);
    }
  }
  return rays;
}

std::vector<Response> responsesOf(const CameraFile& file) {
  std::vector<Response> responses;
  for (const auto& modulation : file.modulations) {
    responses.push_back(
        {.frequency = modulation.frequency,
         .contrast = modulation.contrast,
         .electrons_per_radiance =
             file.pixel.electrons_per_radiance_s * modulation.exposure.in(second),
         .harmonics = relativeHarmonics(modulation.emitted, modulation.demodulating,
                                        modulation.frequency, file.sampling.harmonics)});
  }
  return responses;
}

}  // namespace

std::shared_ptr<const SensorModel::Impl> SensorModel::build(Impl impl) {
  impl.camera = cameraInfo(impl.file.lens);
  if (!impl.lens_id.empty()) impl.camera.calibration_id = impl.lens_id;
  impl.id = contentHash(canonicalText(impl.file, impl.effects));
  // The tables of waveforms and of a pulse take 10 and 20 ms to make, and are the same for any effects and any lens.
  const std::vector<Response> before = std::move(impl.responses);
  std::vector<std::vector<float>> true_cycles = std::move(impl.decoder.true_cycles);
  std::vector<double> pulse_ranges_m = std::move(impl.decoder.pulse_ranges_m);
  impl.responses = responsesOf(impl.file);
  impl.decoder = impl.file.decoder;
  const auto& sampling = impl.file.sampling;
  for (std::size_t i = 0; i < impl.responses.size(); ++i) {
    const Response& response = impl.responses[i];
    if (sampling.factory_calibration == CameraFile::FactoryCalibration::None) break;
    impl.decoder.zero_phase.push_back(response.zeroPhase());
    if (sampling.factory_calibration != CameraFile::FactoryCalibration::Waveform) continue;
    const bool is_known = i < true_cycles.size() && before[i] == response;
    impl.decoder.true_cycles.push_back(is_known ? std::move(true_cycles[i]) : trueCyclesOf(response, sampling.steps));
  }
  for (const CameraFile::PulseKeys& keys : impl.file.pulses) {
    impl.decoder.pulse_scheme = keys.pulse.scheme;
    impl.decoder.pulse_width = keys.pulse.width;
    if (sampling.factory_calibration == CameraFile::FactoryCalibration::Waveform)
      impl.decoder.pulse_ranges_m =
          pulse_ranges_m.empty() ? rangesOfRatios(keys.pulse, keys.knots) : std::move(pulse_ranges_m);
  }
  if (sampling.phase_tables) {
    impl.decoder.pixel_turns =
        pixelTurnsOf(impl.effects, impl.responses, impl.camera);
  }
  if (impl.rays.x.empty()) impl.rays = raysOf(impl.camera);
  return std::make_shared<const Impl>(std::move(impl));
}

Result<SensorModel> SensorModel::load(const std::filesystem::path& file) {
  auto table = settings::Table::load(file);
  if (!table) return table.error();
  Impl impl;
  impl.file = readCameraFile(*table, impl.effects);
  if (auto checked = table->check(); !checked) return checked.error();
  return SensorModel{build(std::move(impl))};
}

Result<SensorModel> SensorModel::parse(std::string_view toml, const std::filesystem::path& name) {
  auto table = settings::Table::parse(toml, name);
  if (!table) return table.error();
  Impl impl;
  impl.file = readCameraFile(*table, impl.effects);
  if (auto checked = table->check(); !checked) return checked.error();
  return SensorModel{build(std::move(impl))};
}

const std::string& SensorModel::model() const { return impl_->file.model; }
const std::vector<std::string>& SensorModel::notes() const { return impl_->file.notes; }
const CameraInfo& SensorModel::camera() const { return impl_->camera; }
const std::string& SensorModel::id() const { return impl_->id; }
const std::vector<AnyEffect>& SensorModel::effects() const { return impl_->effects; }
const SensorModel::Rays& SensorModel::rays() const { return impl_->rays; }
Duration SensorModel::frameInterval() const { return impl_->file.sampling.frame_interval; }
Duration SensorModel::rowDelay() const { return impl_->file.sampling.row_delay; }

std::size_t SensorModel::exposureCount() const {
  return impl_->file.sampling.exposure_factors.size();
}

std::vector<NamedTemperature> SensorModel::temperatures(Temperature room,
                                                        Duration since_power_on) const {
  const CameraFile::Thermal& thermal = impl_->file.thermal;
  if (thermal.illumination_rise == 0.0) return {};
  const auto warm = [&](double rise, Duration time) {
    return (room.in(celsius) + rise * (1.0 - std::exp(-(since_power_on / time)))) * celsius;
  };
  return {{"illumination", warm(thermal.illumination_rise, thermal.illumination_time)},
          {"sensor", warm(thermal.sensor_rise, thermal.sensor_time)}};
}

std::optional<LensPair> SensorModel::colorLens() const {
  if (impl_->file.colors.empty()) return std::nullopt;
  const CameraFile::Color& color = impl_->file.colors.front();
  const auto turn = [&](Vec3d axis, std::size_t i) {
    return rotation<Camera, Camera>(axis, color.euler_deg[i] * degree.in_si);
  };
  const Transform<Camera, Camera> turned = turn({0, 0, 1}, 2) * (turn({0, 1, 0}, 1) * turn({1, 0, 0}, 0));
  const auto& p = color.position_mm;
  const Transform<Camera, ColorLens> camera_from_color{turned.rotation_wxyz, Vec3d{p[0], p[1], p[2]} * 1e-3};
  return LensPair{impl_->camera, scaled(cameraInfo(color.lens), color.scale), camera_from_color.inverse()};
}

bool SensorModel::hasPhasors() const { return !impl_->file.isPulsed(); }

std::vector<SeenHarmonic> SensorModel::correlatedTerms() const {
  const int harmonics = impl_->file.sampling.harmonics;
  if (impl_->addsHarmonics())
    return std::vector<SeenHarmonic>(impl_->responses.size() * static_cast<std::size_t>(harmonics), Harmonic::Seen);
  // Others than these may treat harmonics each in its own way.
  const bool can_fold = std::ranges::all_of(impl_->effects, [](const AnyEffect& any) {
    return !actsOn<Light>(any) || std::holds_alternative<LensScatter>(any) || std::holds_alternative<AmbientLight>(any);
  });
  if (can_fold) return foldedTerms(impl_->responses, harmonics, impl_->file.sampling.steps);
  const std::vector<Harmonic> terms = sim::correlatedTerms(impl_->responses, harmonics);
  return {terms.begin(), terms.end()};
}

std::vector<std::string> SensorModel::effectNames() const {
  std::vector<std::string> names;
  for (const AnyEffect& any : impl_->effects) {
    names.push_back(std::visit([]<class E>(const E&) { return std::string{E::about.name}; }, any));
  }
  return names;
}

std::vector<Exposure> SensorModel::exposures(DeviceTime start) const {
  const CameraFile& file = impl_->file;
  std::vector<Exposure> all;
  const auto add = [&](Duration exposure, Frequency modulation) {
    all.push_back({start, exposure, modulation});
    start.ns += std::llround((exposure + file.sampling.gap).in(nanosecond));
  };
  for (const double factor : file.sampling.exposure_factors) {
    for (const auto& keys : file.pulses) {
      for (int gate = 0; gate < keys.pulse.gates(); ++gate) add(factor * keys.exposure, 0_MHz);
    }
    for (const auto& modulation : file.modulations) {
      for (int k = 0; k < file.sampling.steps; ++k) add(factor * modulation.exposure, modulation.frequency);
    }
  }
  return all;
}

Duration SensorModel::exposureTime() const { return impl_->file.exposureTime(); }

TraceRequest SensorModel::traceRequest() const {
  TraceRequest request;
  request.camera = impl_->camera;
  request.harmonics = impl_->file.isPulsed() ? 1 : impl_->file.sampling.harmonics;
  for (const auto& keys : impl_->file.pulses) request.gates.push_back(gateFunctionsOf(keys.pulse));
  for (const auto& modulation : impl_->file.modulations)
    request.frequencies.push_back(modulation.frequency);
  for (const auto& emitter : impl_->file.emitters) {
    const auto& p = emitter.position_mm;
    request.emitters.push_back(
        {.position_m = Vec3d{p[0], p[1], p[2]} * 1e-3,
         .axis = normalised(Vec3d{emitter.axis[0], emitter.axis[1], emitter.axis[2]}),
         .radius = emitter.radius,
         .power_w = emitter.power_w,
         .lobe_exponent = emitter.lobe_exponent,
         .half_angle = emitter.half_angle,
         .isotropic = emitter.isotropic,
         .pattern_deg = emitter.pattern_deg,
         .pattern = emitter.pattern});
  }
  return request;
}

bool SensorModel::collectsTheSameEachFrame() const {
  return std::ranges::none_of(impl_->effects, [](const AnyEffect& any) {
    const Covariates on = explainsOf(any);
    return actsOn<Light>(any) && (on.contains(Covariate::Frame) || on.contains(Covariate::Time) ||
                                  on.contains(Covariate::Temperature));
  });
}

bool SensorModel::remembers() const {
  return std::ranges::any_of(impl_->effects, [](const AnyEffect& any) {
    return explainsOf(any).contains(Covariate::History);
  });
}

SensorModel SensorModel::withLens(const CameraInfo& lens) const {
  Impl changed = *impl_;
  changed.rays = {};
  changed.file.lens = {.width = lens.width,
                       .height = lens.height,
                       .fx = lens.fx,
                       .fy = lens.fy,
                       .cx = lens.cx,
                       .cy = lens.cy,
                       .distortion = lens.distortion};
  changed.lens_id = lens.calibration_id;
  return SensorModel{build(std::move(changed))};
}

SensorModel SensorModel::withEffects(std::vector<AnyEffect> effects) const {
  Impl changed = *impl_;
  changed.effects = std::move(effects);
  return SensorModel{build(std::move(changed))};
}

}  // namespace toftwin::sim
