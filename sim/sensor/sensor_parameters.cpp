// SPDX-License-Identifier: Apache-2.0
// The numbers of a sensor model that can be changed while it runs.
#include <fmt/format.h>
#include <toftwin/modulation.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <variant>

#include "sim/sensor/parameters.h"
#include "sim/sensor/sensor_model_impl.h"

namespace toftwin::sim {
namespace {

constexpr Bounds kExposureBounds_us{1.0, 20'000.0};

Result<> firstProblem(const NumberSetter& setter, std::string_view parameter, double value) {
  if (setter.problem.empty()) return {};
  return Error{Error::Code::InvalidArgument, fmt::format("{} = {:.12g} is out of bounds: it {}",
                                                         parameter, value, setter.problem)};
}

std::int64_t kilohertzOf(const CameraFile::Modulation& modulation) {
  return std::llround(modulation.frequency.in(hertz) / 1e3);
}

/// Where the ranges of those frequencies together begin anew: c / 2 gcd(f).
Length repeatsAfter(const std::vector<CameraFile::Modulation>& modulations, double speed_of_light) {
  const Frequency common = commonFrequency(modulations, &CameraFile::Modulation::frequency);
  return (speed_of_light / (2.0 * common.in(hertz))) * metre;
}

}  // namespace

std::optional<Operation> SensorModel::operation() const {
  const CameraFile& file = impl_->file;
  if (file.isPulsed() || file.decoder.algorithm != DecodeSettings::Algorithm::NPhase) return std::nullopt;
  return Operation{static_cast<int>(file.modulations.size()), file.sampling.exposure_factors,
                   file.decoder.minimum_amplitude, file.decoder.asymmetry_threshold};
}

int SensorModel::mostFrequencies() const {
  const auto& own = impl_->file.modulations;
  const bool can_be_more = !own.empty() && own.size() < 3 && kilohertzOf(own.front()) % 30 == 0;
  return can_be_more ? 3 : static_cast<int>(own.size());
}

SensorModel SensorModel::operated(const Operation& operation) const {
  Impl changed = *impl_;
  changed.decoder = {};
  CameraFile& file = changed.file;
  auto& modulations = file.modulations;
  const auto count = static_cast<std::size_t>(operation.frequencies);
  if (count != modulations.size()) {
    const Frequency step = modulations.front().frequency / 30.0;
    if (count < modulations.size()) modulations.erase(modulations.begin() + static_cast<std::ptrdiff_t>(count), modulations.end());
    while (modulations.size() < count) {
      modulations.push_back(modulations.back());
      modulations.back().frequency = modulations.back().frequency - step;
    }
    constexpr Length kTwoReach = 30_m;
    const Length repeats = repeatsAfter(modulations, file.decoder.speed_of_light);
    file.decoder.farthest = count == 2 ? std::min(repeats, kTwoReach) : repeats;
  }
  file.sampling.exposure_factors = operation.exposure_factors;
  file.decoder.minimum_amplitude = operation.minimum_amplitude_electrons;
  file.decoder.asymmetry_threshold = operation.asymmetry_threshold;
  return SensorModel{build(std::move(changed))};
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

}  // namespace toftwin::sim
