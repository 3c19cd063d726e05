// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/table_words.h"

#include <algorithm>
#include <cmath>
#include <ctime>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "calib/discover/curve.h"

namespace toftwin::discover {
namespace {

/// Between the rows where it is least and most.
std::string sizeOf(const TableDiscovery& d, const Effect& effect) {
  const auto values = effectIn(d.open, effect);
  const auto [least, most] = std::ranges::minmax(values);
  return fmt::format("by up to {}{} between rows", compare::shown(most - least, decimalsOf(d)), unitOf(d));
}

/// " between 500 and 1000": of a step, the rows on both sides.
std::string betweenInWords(const TableDiscovery& d, const Effect& effect) {
  for (std::size_t i = 0; i < effect.numbers.size() && effect.parts.size() == 1; ++i) {
    const auto step = stepRows(d.open, effect, i);
    if (!step) continue;
    const auto place = [&](double x) { return placeInWords(d, step->covariate, x); };
    return fmt::format(" between {} and {}", place(step->below), place(step->from));
  }
  return {};
}

/// Whether nearly every step from row to row, in the order in which they wander, moves the covariate the same way.
bool followsClock(const RowClock& clock, const std::vector<double>& covariate) {
  constexpr double kNearly = 0.98;
  double up = 0.0, down = 0.0;
  for (std::size_t i = 1; i < clock.order.size(); ++i) {
    if (!std::isfinite(clock.step[i])) continue;
    const double by = covariate[static_cast<std::size_t>(clock.order[i])] -
                      covariate[static_cast<std::size_t>(clock.order[i - 1])];
    up += by > 0.0 ? 1.0 : 0.0, down += by < 0.0 ? 1.0 : 0.0;
  }
  return up + down > 0.0 && std::max(up, down) >= kNearly * (up + down);
}

}  // namespace

std::string joined(const std::vector<std::string>& names, const char* between) {
  std::string out;
  for (const auto& name : names) out += (out.empty() ? "" : between) + name;
  return out;
}

const char* partOf(const TableDiscovery& d) { return d.open.sessions_are_captures ? "capture" : "session"; }
std::string unitOf(const TableDiscovery& d) { return d.open.unit.empty() ? "" : " " + d.open.unit; }
std::string labelled(const TableDiscovery& d, const char* what) {
  return d.open.unit.empty() ? what : fmt::format("{} [{}]", what, d.open.unit);
}

int decimalsOf(const TableDiscovery& d) {
  const double size = std::max(d.noise.typical, 1e-9);
  const double digits = size < 0.01 ? 2.0 : 1.0;  // in metres an RMSE of two digits tells no improvement of a tenth
  return std::clamp(static_cast<int>(std::ceil(digits - std::log10(size))), 0, 9);
}

std::string significant(double value) { return std::isfinite(value) ? fmt::format("{:.4g}", value) : "–"; }

const std::vector<double>* valuesOf(const TableData& data, const std::string& name) {
  const auto at = std::ranges::find(data.covariates, name, &TableCovariate::name);
  return at == data.covariates.end() ? nullptr : &at->values;
}

std::string placeInWords(const TableDiscovery& d, const std::string& covariate, double x) {
  const auto at = std::ranges::find(d.open.covariates, covariate, &TableCovariate::name);
  if (at == d.open.covariates.end() || !at->first) return significant(x);
  constexpr double kDay = 86'400.0;
  const double time = *at->first + x;
  const auto then = fmt::gmtime(static_cast<std::time_t>(std::llround(time)));
  return *at->first < kDay ? fmt::format("{:%H:%M:%S}", then) : fmt::format("{:%Y-%m-%d %H:%M:%S}", then);
}

bool isCertain(const Effect& effect) { return effect.alternatives.empty() && effect.frequency >= 0.8; }

std::string nameInWords(const TableDiscovery& d, const Effect& effect) {
  const auto shape = [](const std::string& name) {
    return name.find("smooth in") != std::string::npos ? std::string{"a curve without a short formula"}
                                                       : name;
  };
  std::string words = effect.is_catalogue
                          ? effect.name
                          : fmt::format("it goes with {} ({}), {}", joined(effect.covariates),
                                        shape(effect.name) + betweenInWords(d, effect), sizeOf(d, effect));
  for (const Alternative& other : effect.alternatives)
    words += fmt::format(", or with {} ({})", joined(other.covariates), shape(other.name));
  return words;
}

std::string containedInWords(const TableDiscovery& d) {
  const auto isContained = [](const Estimate& one) { return one.name == "gain" && std::isnan(one.error); };
  if (std::ranges::none_of(d.finding.nuisances, isContained)) return {};
  return fmt::format("No gain is fitted: an effect that goes with {} contains it", d.open.reference_name);
}

std::string oddInWords(const TableDiscovery& d) {
  const std::string where = inWords(d.odd, unitOf(d));
  if (d.odd.front().captures > 0)
    return fmt::format("captures of which all rows are off by about the same, far from the others, perhaps moved or "
                       "bumped: {}", where);
  return fmt::format("rows that follow each other are off by about the same, far from the others: around {}", where);
}

bool wanders(const TableDiscovery& d) {
  constexpr double kMuch = 0.5, kLong = 20.0;
  return d.noise.dependence && d.noise.dependence->isClear() && d.noise.dependence->best.correlation.share >= kMuch &&
         d.noise.correlationRows() >= kLong;
}

std::vector<std::string> wanderAlong(const TableDiscovery& d) {
  std::vector<std::string> along;
  if (!wanders(d)) return along;
  const RowClock& clock = d.noise.dependence->clock;
  for (const TableCovariate& one : d.open.covariates)
    if (one.name != clock.name && one.nature != Nature::Time && followsClock(clock, one.values)) along.push_back(one.name);
  return along;
}

std::string wanderInWords(const TableDiscovery& d) {
  if (!wanders(d)) return {};
  const auto along = wanderAlong(d);
  const std::string much = compare::shownPercent(d.noise.dependence->best.correlation.share),
                    p = significant(d.finding.first_p);
  if (along.empty()) {
    return fmt::format(
        "{} of the error's variance goes slowly from row to row: something that changes with time and that no column "
        "tells, or a wander, which these rows do not tell apart (p = {} for more than a wander). Give columns of what "
        "changed meanwhile, a temperature's rate say, or take the same again in another order.",
        much, p);
  }
  return fmt::format(
      "{} of the error's variance goes slowly from row to row, and the rows stand in the order of {}: a curve over it "
      "that was gone through once, or a wander with time, which these rows do not tell apart (p = {} for more than a "
      "wander). Measure again in another order, or give columns with the session or the time.",
      much, joined(along, " and "), p);
}

}  // namespace toftwin::discover
