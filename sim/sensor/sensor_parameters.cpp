// SPDX-License-Identifier: Apache-2.0
// The numbers of a sensor model that can be changed while it runs.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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

}  // namespace

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

}  // namespace toftwin::sim
