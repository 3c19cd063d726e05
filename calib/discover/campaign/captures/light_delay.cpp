// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/captures/light_delay.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <variant>

#include "calib/discover/campaign/captures/catalogue.h"

namespace toftwin::discover {

sim::AnyEffect delayInLight(const sim::SensorModel& model, double millimetres) {
  sim::FrequencyOffset offset = sim::FrequencyOffset::none();
  const std::vector<Frequency> frequencies = model.traceRequest().frequencies;
  const std::array each{&offset.first, &offset.second, &offset.third};
  for (std::size_t f = 0; f < std::min(each.size(), frequencies.size()); ++f)
    *each[f] = 2.0 * std::numbers::pi * millimetres * 1e-3 / unambiguousRange(frequencies[f]).in(metre) * radian;
  return offset;
}

std::vector<sim::AnyEffect> withDelay(const sim::SensorModel& model, std::vector<sim::AnyEffect> effects,
                                      double millimetres) {
  if (millimetres == 0.0) return effects;
  const auto more = std::get<sim::FrequencyOffset>(delayInLight(model, millimetres));
  for (sim::AnyEffect& effect : effects) {
    if (auto* own = std::get_if<sim::FrequencyOffset>(&effect)) {
      own->first += more.first, own->second += more.second, own->third += more.third;
      return effects;
    }
  }
  return withInserted(std::move(effects), more);
}

std::vector<sim::AnyEffect> declaredEffects(const Declared& declared) {
  return withDelay(declared.model, effectsWithoutNoise(declared.model), declared.delay_mm);
}

std::vector<std::optional<std::size_t>> placesInFile(const Declared& declared) {
  const auto& in_file = declared.model.effects();
  std::vector<std::optional<std::size_t>> places;
  std::size_t next = 0;
  for (const sim::AnyEffect& effect : declaredEffects(declared)) {
    std::size_t place = next;
    while (place < in_file.size() && in_file[place].index() != effect.index()) ++place;
    if (place == in_file.size()) {
      places.emplace_back();
      continue;
    }
    places.emplace_back(place);
    next = place + 1;
  }
  return places;
}

bool isOnlyDelay(const Declared& declared, const sim::AnyEffect& effect) {
  const auto isOffset = [](const sim::AnyEffect& any) {
    return std::holds_alternative<sim::FrequencyOffset>(any);
  };
  return isOffset(effect) && std::ranges::none_of(declared.model.effects(), isOffset);
}

bool isNoOffset(std::span<const Reading> changes) {
  double sum = 0.0, squares = 0.0, n = 0.0;
  for (const Reading& change : changes) {
    for (const float value : change.range_m.pixels()) {
      if (!std::isfinite(value)) continue;
      sum += static_cast<double>(value), squares += static_cast<double>(value) * static_cast<double>(value);
      n += 1.0;
    }
  }
  return n > 0.0 && squares / n - sum * sum / (n * n) > 0.02 * 0.02 * squares / n;
}

}  // namespace toftwin::discover
