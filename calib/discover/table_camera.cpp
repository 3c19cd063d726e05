// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/table_camera.h"

#include <algorithm>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "calib/compare/statistics.h"
#include "calib/discover/campaign/model_file.h"
#include "calib/discover/curve.h"
#include "calib/discover/headers.h"
#include "calib/discover/table_words.h"
#include "sim/effects/learned/covariates.h"
#include "sim/effects/learned/tables.h"

namespace toftwin::discover {
namespace {

/// A column as the simulator knows it: its value there is so many times the column's.
struct Known {
  std::string covariate{};  ///< its name there
  double factor = 1.0;
  std::string as{};  ///< where the header does not say it outright
};

std::optional<double> unitIn(const std::map<std::string, double>& units, const std::string& unit) {
  const auto at = units.find(unit);
  return at == units.end() ? std::nullopt : std::optional{at->second};
}

bool isSimulators(const std::string& name) {
  const sim::LearnedCovariate* known = sim::learnedCovariate(name);
  return known != nullptr && sim::isKnownAt(terms::Stage::Range, *known);
}

std::optional<Known> knownAs(const TableDiscovery& d, const TableCovariate& column) {
  const std::string& name = column.name;
  const std::string unit = discover::unitOf(name);
  if (name == d.open.reference_name) {
    const auto per_metre = unitsPerMetre(unit);
    return per_metre ? std::optional{Known{"range_m", 1.0 / *per_metre, "the range"}} : std::nullopt;
  }
  if (isSimulators(name)) return Known{name};
  static const std::map<std::string, double> kSeconds{{"s", 1.0}, {"ms", 1e-3}, {"min", 60.0}, {"h", 3600.0}};
  static const std::map<std::string, double> kMicroseconds{{"us", 1.0}, {"ms", 1e3}, {"s", 1e6}};
  static const std::map<std::string, double> kKilolux{{"klx", 1.0}, {"lx", 1e-3}};
  if (column.nature == Nature::Time) {
    const auto seconds = column.first ? std::optional{1.0} : unitIn(kSeconds, unit);
    return seconds ? std::optional{Known{"time_s", *seconds, "the time since power-on"}} : std::nullopt;
  }
  if (const auto microseconds = unitIn(kMicroseconds, unit); microseconds && saysWord(name, {"exposure", "integration"}))
    return Known{"exposure_us", *microseconds, "the exposure"};
  if (const auto kilolux = unitIn(kKilolux, unit)) return Known{"ambient_klx", *kilolux, "the ambient light"};
  if (saysWord(name, {"temperature", "temp", "temperatur"}) && (unit.empty() || unit == "c")) {
    if (saysWord(name, {"illumination", "led", "laser", "emitter"}))
      return Known{"temperature_illumination_c", 1.0, "the illumination's temperature"};
    return Known{"temperature_sensor_c", 1.0, "the sensor's temperature"};
  }
  return std::nullopt;
}

/// Of a column of the table; nothing where the simulator knows no such thing, and why.
std::optional<Known> knownColumn(const TableDiscovery& d, const std::string& name, std::vector<std::string>& notes) {
  const auto column = std::ranges::find(d.open.covariates, name, &TableCovariate::name);
  if (column == d.open.covariates.end()) return std::nullopt;
  auto known = knownAs(d, *column);
  if (known && !known->as.empty())
    notes.push_back(fmt::format("camera.toml takes {} for {}", name, known->as));
  if (!known)
    notes.push_back(fmt::format("what goes with {} is not in camera.toml: the simulator knows no such thing, or not by that "
                                "header ({}; the reference is the range)",
                                name, sim::learnedCovariateNames(terms::Stage::Range)));
  return known;
}

/// Without those that a file's digits do not tell from the one before.
std::vector<double> apart(std::vector<double> ascending) {
  constexpr double kApart = 1e-9;  // of all they span
  const double least = ascending.empty() ? 0.0 : kApart * (ascending.back() - ascending.front());
  const auto [first, last] = std::ranges::unique(ascending, [&](double a, double b) { return b - a <= least; });
  ascending.erase(first, last);
  return ascending;
}

std::vector<double> times(std::vector<double> values, double factor) {
  for (double& value : values) value *= factor;
  return values;
}

FittedEffect fitted(const sim::KnotTable& table, const std::vector<double>& offsets_mm) {
  return {sim::AnyEffect{sim::Learned{.title = {}, .terms = sim::termsOf(table, offsets_mm, terms::Quantity::RangeMm)}}, {}};
}

/// As a table over its one or two covariates; nothing where one of them is not known.
std::optional<FittedEffect> tableOf(const TableDiscovery& d, const Effect& effect, double to_mm,
                                    std::vector<std::string>& notes) {
  if (effect.covariates.empty() || effect.covariates.size() > 2) return std::nullopt;
  std::vector<Known> known;
  std::vector<std::vector<double>> points;
  for (const std::string& name : effect.covariates) {
    auto one = knownColumn(d, name, notes);
    if (!one) return std::nullopt;
    known.push_back(*std::move(one));
    points.push_back(apart(pointsOf(d, effect, name)));
  }
  sim::KnotTable table{.over = known[0].covariate, .knots = times(points[0], known[0].factor)};
  if (known.size() == 2) table.and_over = known[1].covariate, table.and_knots = times(points[1], known[1].factor);
  std::vector<double> offsets_mm;
  const Level level = levelOf(effect, d.open);
  for (const double x : points[0]) {
    std::map<std::string, double> at{{effect.covariates[0], x}};
    if (known.size() == 1) {
      offsets_mm.push_back(to_mm * effectAt(effect, at, level).value);
      continue;
    }
    for (const double y : points[1]) {
      at[effect.covariates[1]] = y;
      offsets_mm.push_back(to_mm * effectAt(effect, at, level).value);
    }
  }
  return fitted(table, offsets_mm);
}

/// Offset and gain, which are the camera's where rows have one offset; effects are written above their means.
std::optional<FittedEffect> zeroOf(const TableDiscovery& d, double to_mm, std::vector<std::string>& notes) {
  std::optional<double> offset;
  double gain = 0.0;
  for (const Estimate& one : namedNuisances(d)) {
    if (one.name == "offset") offset = one.value;
    if (one.name == "gain") gain = one.value;
  }
  if (offset) {
    for (const Effect& effect : d.finding.effects) *offset += levelOf(effect, d.open).value;
  } else {
    notes.emplace_back("each session has an offset of its own: camera.toml has none");
  }
  const auto per_metre = unitsPerMetre(discover::unitOf(d.open.reference_name));
  if (d.open.reference.empty() || !per_metre) {
    if (!offset) return std::nullopt;
    return fitted({.over = "range_m", .knots = {1.0}}, {to_mm * *offset});
  }
  const auto [nearest, farthest] = std::ranges::minmax(d.open.reference);
  if (!(nearest < farthest)) return std::nullopt;
  const double middle = compare::quantile(d.open.reference, 0.5);
  const auto at = [&](double x) { return to_mm * (offset.value_or(0.0) + gain * (x - middle)); };
  return fitted({.over = "range_m", .knots = {nearest / *per_metre, farthest / *per_metre}}, {at(nearest), at(farthest)});
}

}  // namespace

Result<TableCamera> cameraWith(const TableDiscovery& discovery, const CameraText& camera) {
  const auto per_metre = unitsPerMetre(discovery.open.unit);
  if (!per_metre) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}: its errors are in {}, and a camera file takes lengths: end the headers in a unit of length, "
                             "as in error_mm, or leave --model away",
                             discovery.open.file.string(), discovery.open.unit.empty() ? "no unit" : discovery.open.unit)};
  }
  const double to_mm = 1e3 / *per_metre;
  TableCamera out;
  std::vector<FittedEffect> added;
  for (const Effect& effect : discovery.finding.effects)
    if (auto table = tableOf(discovery, effect, to_mm, out.notes)) added.push_back(*std::move(table));
  if (auto zero = zeroOf(discovery, to_mm, out.notes)) added.push_back(*std::move(zero));
  out.toml = withEffects(camera.text, camera.model.effects(),
                         std::vector<std::optional<FittedEffect>>(camera.model.effects().size()), added,
                         fmt::format("Mended by toftwin discover with {}.", discovery.open.file.filename().string()));
  if (auto parsed = sim::SensorModel::parse(out.toml, "camera.toml"); !parsed) return parsed.error();
  return out;
}

}  // namespace toftwin::discover
