// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned_columns.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/effects/column_change.h"

namespace toftwin::sim {
namespace {

double at(const std::vector<double>& list, std::size_t column_class) {
  return list.empty() ? 0.0 : list[column_class];
}

bool isNothing(const std::vector<double>& list) {
  return std::ranges::all_of(list, [](double number) { return number == 0.0; });
}

/// After how many columns they repeat.
std::size_t periodOf(const LearnedColumns& columns) {
  return std::max({columns.in_phase_electrons.size(), columns.quadrature_electrons.size(), columns.gains_percent.size()});
}

}  // namespace

std::string LearnedColumns::problem() const {
  const std::size_t m = periodOf(*this);
  for (const auto* list : {&in_phase_electrons, &quadrature_electrons, &gains_percent})
    if (!list->empty() && list->size() != m)
      return "in_phase_electrons, quadrature_electrons and gains_percent have as many numbers as each other, or none: "
             "one for each column until they repeat";
  return {};
}

Samples LearnedColumns::apply(Samples samples, const Conditions& now, const Random&) const {
  const std::size_t m = periodOf(*this);
  if (isNothing(in_phase_electrons) && isNothing(quadrature_electrons) && isNothing(gains_percent)) return samples;
  const auto width = static_cast<std::size_t>(samples.width());
  const auto classOf = [&](std::size_t x) { return (static_cast<std::size_t>(now.left) + x) % m; };
  const auto in_group = static_cast<std::size_t>(samples.steps * samples.taps);
  const auto change = [&](Image<float>& electrons, double cosine, double sine) {
    std::vector<float> factor(width), charge(width);
    for (std::size_t x = 0; x < width; ++x) {
      factor[x] = static_cast<float>(1.0 + 1e-2 * at(gains_percent, classOf(x)));
      charge[x] = static_cast<float>(at(in_phase_electrons, classOf(x)) * cosine +
                                     at(quadrature_electrons, classOf(x)) * sine);
    }
    changeColumns(electrons, factor, charge);
  };
  for (std::size_t f = 0; f < samples.electrons.size() / in_group; ++f) {
    for (int step = 0; step < samples.steps; ++step) {
      const double theta = 2.0 * std::numbers::pi * step / samples.steps, share = 2.0 / samples.steps;
      for (int tap = 0; tap < samples.taps; ++tap) {
        const double here = tap == 0 ? share : 0.0;
        change(samples.tap(f, step, tap), here * std::cos(theta), here * std::sin(theta));
      }
    }
  }
  return samples;
}

}  // namespace toftwin::sim
