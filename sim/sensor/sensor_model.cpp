// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor/sensor_model.h"

#include "sim/sensor/factory_calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/decode/decode.h"
#include "sim/images/content_hash.h"
#include "sim/sensor/camera_file.h"
#include "sim/sensor/color.h"
#include "sim/sensor/correlate.h"
#include "sim/sensor/exposures.h"
#include "sim/sensor/parameters.h"

namespace toftwin::sim {

struct SensorModel::Impl {
  CameraFile file;
  std::vector<AnyEffect> effects;
  // Derived from the two above by build():
  CameraInfo camera;
  std::string id;
  std::vector<Response> responses;
  DecodeSettings decoder;
  Rays rays;
};

namespace {

constexpr Bounds kExposureBounds_us{1.0, 20'000.0};

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

bool anyAddsHarmonics(const std::vector<AnyEffect>& effects) {
  return std::ranges::any_of(effects, [](const AnyEffect& effect) { return std::holds_alternative<Harmonics>(effect); });
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

Result<> firstProblem(const NumberSetter& setter, std::string_view parameter, double value) {
  if (setter.problem.empty()) return {};
  return Error{Error::Code::InvalidArgument, fmt::format("{} = {:.12g} is out of bounds: it {}",
                                                         parameter, value, setter.problem)};
}

}  // namespace

std::shared_ptr<const SensorModel::Impl> SensorModel::build(Impl impl) {
  impl.camera = cameraInfo(impl.file.lens);
  impl.id = contentHash(canonicalText(impl.file, impl.effects));
  impl.responses = responsesOf(impl.file);
  impl.decoder = impl.file.decoder;
  const auto& sampling = impl.file.sampling;
  for (const Response& response : impl.responses) {
    if (sampling.factory_calibration == CameraFile::FactoryCalibration::None) break;
    impl.decoder.zero_phase.push_back(response.zeroPhase());
    if (sampling.factory_calibration != CameraFile::FactoryCalibration::Waveform) continue;
    impl.decoder.true_cycles.push_back(trueCyclesOf(response, sampling.steps));
  }
  for (const CameraFile::PulseKeys& keys : impl.file.pulses) {
    impl.decoder.pulse_scheme = keys.pulse.scheme;
    impl.decoder.pulse_width = keys.pulse.width;
    if (sampling.factory_calibration == CameraFile::FactoryCalibration::Waveform)
      impl.decoder.pulse_ranges_m = rangesOfRatios(keys.pulse, keys.knots);
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

std::vector<std::uint8_t> SensorModel::correlatedTerms() const {
  const auto harmonics = static_cast<std::size_t>(impl_->file.sampling.harmonics);
  if (anyAddsHarmonics(impl_->effects)) return std::vector<std::uint8_t>(impl_->responses.size() * harmonics, 1);
  return sim::correlatedTerms(impl_->responses, impl_->file.sampling.harmonics);
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
         .isotropic = emitter.isotropic});
  }
  return request;
}

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
  const bool wants_all = light.frequencies.empty() || anyAddsHarmonics(impl_->effects);
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

bool SensorModel::collectsTheSameEachFrame() const {
  for (const AnyEffect& any : impl_->effects) {
    const bool changes = std::visit(
        []<class E>(const E&) {
          constexpr Covariates on = E::about.explains;
          return std::is_same_v<ImageOf<E>, Light> &&
                 (on.contains(Covariate::Frame) || on.contains(Covariate::Time) ||
                  on.contains(Covariate::Temperature));
        },
        any);
    if (changes) return false;
  }
  return true;
}

bool SensorModel::remembers() const {
  return std::ranges::any_of(impl_->effects, [](const AnyEffect& any) {
    return std::visit(
        []<class E>(const E&) { return E::about.explains.contains(Covariate::History); }, any);
  });
}

std::vector<Parameter> SensorModel::parameters() const {
  const std::vector<Exposure> exposures = this->exposures({});
  Parameter exposure{"exposure_us", {}, kExposureBounds_us};
  if (std::ranges::all_of(exposures, [&](const Exposure& raw) {
        return raw.duration == exposures.front().duration;
      })) {
    exposure.value = exposures.front().duration.in(microsecond);
  }
  std::vector<Parameter> all{std::move(exposure)};
  for (AnyEffect any : impl_->effects) {
    std::visit(
        [&]<class E>(E& effect) {
          NumberSetter lister{"", 0.0};
          effect.visit(lister);
          for (Parameter& parameter : lister.met) {
            parameter.name = fmt::format("{}.{}", E::about.name, parameter.name);
            all.push_back(std::move(parameter));
          }
        },
        any);
  }
  return all;
}

std::vector<std::string> SensorModel::parameterNames() const {
  std::vector<std::string> names;
  for (Parameter& parameter : parameters()) names.push_back(std::move(parameter.name));
  return names;
}

Result<SensorModel> SensorModel::with(std::string_view parameter, double value) const {
  Impl changed = *impl_;
  changed.decoder = {};
  bool is_known = false;
  if (parameter == "exposure_us") {
    is_known = true;
    if (std::isnan(value) || !kExposureBounds_us.contains(value)) {
      return Error{Error::Code::InvalidArgument,
                   fmt::format("exposure_us = {:.12g} is out of bounds: it must be {} us", value,
                               settings::describe(kExposureBounds_us))};
    }
    for (auto& modulation : changed.file.modulations) modulation.exposure = value * microsecond;
    for (auto& keys : changed.file.pulses) keys.exposure = value * microsecond;
  }
  for (AnyEffect& any : changed.effects) {
    const Result<> done = std::visit(
        [&]<class E>(E& effect) -> Result<> {
          const std::string prefix = fmt::format("{}.", E::about.name);
          if (!parameter.starts_with(prefix)) return {};
          NumberSetter setter{parameter.substr(prefix.size()), value};
          effect.visit(setter);
          is_known |= setter.is_set;
          if (auto within = firstProblem(setter, parameter, value); !within) return within;
          if constexpr (requires { effect.problem(); }) {
            if (const std::string problem = effect.problem(); setter.is_set && !problem.empty()) {
              return Error{Error::Code::InvalidArgument,
                           fmt::format("with {} = {:.12g}, {} {}", parameter, value, E::about.name,
                                       problem)};
            }
          }
          return {};
        },
        any);
    if (!done) return done.error();
  }
  if (!is_known) {
    return Error{Error::Code::NotFound,
                 fmt::format("{} has no parameter \"{}\"; there are: {}", model(), parameter,
                             fmt::join(parameterNames(), ", "))};
  }
  return SensorModel{build(std::move(changed))};
}

SensorModel SensorModel::withEffects(std::vector<AnyEffect> effects) const {
  Impl changed = *impl_;
  changed.decoder = {};
  changed.effects = std::move(effects);
  return SensorModel{build(std::move(changed))};
}

}  // namespace toftwin::sim
