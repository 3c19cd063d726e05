// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/operating.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "protocol/settings/describe.h"
#include "sim/images/content_hash.h"

namespace toftwin::drivers::simulator {
namespace {

using Spatial = FilterSettings::Spatial;
using Temporal = FilterSettings::Temporal;

struct Row {
  std::string_view name;
  Bounds bounds;
  bool is_integral, is_of_operation;
  double (*get)(const Operating&);
  void (*set)(Operating&, double);
};

/// Shares of the longest exposure. Three are fixed: 5000, 1000 and 100 us of the real O3D303.
std::vector<double> factorsOf(int exposures, double ratio) {
  if (exposures == 1) return {1.0};
  if (exposures == 2) return {1.0, 1.0 / ratio};
  return {1.0, 0.2, 0.02};
}

constexpr std::string_view kFrequencies = "frequencies";

constexpr std::array kRows{
    Row{kFrequencies,
        {1.0, 3.0},
        true,
        true,
        [](const Operating& o) { return double(o.operation->frequencies); },
        [](Operating& o, double value) { o.operation->frequencies = static_cast<int>(value); }},
    Row{"exposures",
        {1.0, 3.0},
        true,
        true,
        [](const Operating& o) { return static_cast<double>(o.operation->exposure_factors.size()); },
        [](Operating& o, double value) {
          if (static_cast<std::size_t>(value) == o.operation->exposure_factors.size()) return;
          o.operation->exposure_factors = factorsOf(static_cast<int>(value), o.exposure_ratio);
        }},
    Row{"exposure_ratio",
        {2.0, 50.0},
        false,
        true,
        [](const Operating& o) { return o.exposure_ratio; },
        [](Operating& o, double value) {
          o.exposure_ratio = value;
          if (o.operation->exposure_factors.size() == 2) o.operation->exposure_factors = factorsOf(2, value);
        }},
    Row{"minimum_amplitude_electrons",
        {0.0, 1e9},
        false,
        true,
        [](const Operating& o) { return o.operation->minimum_amplitude_electrons; },
        [](Operating& o, double value) { o.operation->minimum_amplitude_electrons = value; }},
    Row{"asymmetry_threshold",
        {0.0, 1e9},
        false,
        true,
        [](const Operating& o) { return o.operation->asymmetry_threshold; },
        [](Operating& o, double value) { o.operation->asymmetry_threshold = value; }},
    Row{"spatial_filter",
        {0.0, 3.0},
        true,
        false,
        [](const Operating& o) { return double(int(o.filters.spatial)); },
        [](Operating& o, double value) {
          o.filters.spatial = static_cast<Spatial>(static_cast<int>(value));
        }},
    Row{"spatial_filter_reach",
        {1.0, 2.0},
        true,
        false,
        [](const Operating& o) { return double(o.filters.reach); },
        [](Operating& o, double value) { o.filters.reach = static_cast<int>(value); }},
    Row{"temporal_filter",
        {0.0, 2.0},
        true,
        false,
        [](const Operating& o) { return double(int(o.filters.temporal)); },
        [](Operating& o, double value) {
          o.filters.temporal = static_cast<Temporal>(static_cast<int>(value));
        }},
    Row{"temporal_filter_images",
        {2.0, 25.0},
        true,
        false,
        [](const Operating& o) { return double(o.filters.images); },
        [](Operating& o, double value) { o.filters.images = static_cast<int>(value); }},
    Row{"filters_range",
        {0.0, 1.0},
        true,
        false,
        [](const Operating& o) { return o.filters.of_range ? 1.0 : 0.0; },
        [](Operating& o, double value) { o.filters.of_range = value == 1.0; }},
    Row{"filters_amplitude",
        {0.0, 1.0},
        true,
        false,
        [](const Operating& o) { return o.filters.of_amplitude ? 1.0 : 0.0; },
        [](Operating& o, double value) { o.filters.of_amplitude = value == 1.0; }},
};

Bounds boundsOf(const Row& row, const sim::SensorModel& model) {
  return row.name == kFrequencies ? Bounds{1.0, static_cast<double>(model.mostFrequencies())} : row.bounds;
}

}  // namespace

Operating Operating::of(const sim::SensorModel& model) {
  Operating operating{.operation = model.operation(), .filters = {}};
  if (operating.operation && operating.operation->exposure_factors.size() == 2) {
    const auto& factors = operating.operation->exposure_factors;
    operating.exposure_ratio = factors[0] / factors[1];
  }
  return operating;
}

std::vector<Parameter> Operating::parameters(const sim::SensorModel& model) const {
  std::vector<Parameter> all;
  for (const Row& row : kRows) {
    if (!row.is_of_operation || operation)
      all.push_back({std::string{row.name}, row.get(*this), boundsOf(row, model)});
  }
  return all;
}

Result<Operating> Operating::with(const sim::SensorModel& model, std::string_view name, double value) const {
  const auto row = std::ranges::find(kRows, name, &Row::name);
  if (row == kRows.end() || (row->is_of_operation && !operation))
    return Error{Error::Code::NotFound, "no such parameter"};
  const Bounds bounds = boundsOf(*row, model);
  if (std::isnan(value) || !bounds.contains(value) || (row->is_integral && value != std::floor(value))) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{} = {:.12g} is out of bounds: it must be {}{}", name, value,
                             settings::describe(bounds), row->is_integral ? ", a whole number" : "")};
  }
  Operating changed = *this;
  row->set(changed, value);
  return changed;
}

void Operating::note(Provenance& provenance) const {
  if (!filters.areOn()) return;
  std::string said;
  for (const Row& row : kRows) {
    if (!row.is_of_operation) said += fmt::format("{} = {}\n", row.name, row.get(*this));
  }
  provenance.model_id = sim::contentHash(provenance.model_id + said);
  if (filters.spatial != Spatial::None) provenance.effects.emplace_back("spatial_filter");
  if (filters.temporal != Temporal::None) provenance.effects.emplace_back("temporal_filter");
}

}  // namespace toftwin::drivers::simulator
