// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/table_evidence.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "calib/loop/projection.h"

namespace toftwin::loop {
namespace {

constexpr double kMostMissing = 0.2;
/// A series is at least so many rows; more series than this are how the rig moves, not a beginning anew.
constexpr std::size_t kShortest = 20, kMostSeries = 12;
/// Speed of light in mm·MHz: half of it over the modulation's frequency is the ambiguity length.
constexpr double kLightMmMhz = 299'792.458;

Covariate covariateOf(const table::Column& column, const std::vector<std::size_t>& rows) {
  Covariate c{.name = column.header, .unit = column.unit, .nature = column.nature, .words = column.words};
  c.x.resize(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) c.x[static_cast<Eigen::Index>(i)] = column.values[rows[i]];
  return c;
}

/// Whether a column rises or falls with the lines, but for jitter and a few new beginnings.
bool goesWithLines(const Covariate& c) {
  if (c.nature == table::Nature::Category || c.sorted.size() < 8) return false;
  const auto width = std::max<Eigen::Index>(5, c.x.size() / 60);
  double rising = 0.0, steps = 0.0;
  for (Eigen::Index i = 0; i + 2 * width <= c.x.size(); i += width) {
    const double step = c.x.segment(i + width, width).mean() - c.x.segment(i, width).mean();
    rising += step > 0.0 ? 1.0 : 0.0, steps += step != 0.0 ? 1.0 : 0.0;
  }
  return steps >= 8.0 && std::max(rising, steps - rising) >= 0.9 * steps;
}

void markWithinGroups(Evidence& e) {
  if (e.groups() < 2) return;
  for (Covariate& c : e.covariates) {
    std::vector<double> low(e.group_names.size(), INFINITY), high(e.group_names.size(), -INFINITY);
    for (Eigen::Index i = 0; i < e.rows(); ++i) {
      const auto g = static_cast<std::size_t>(e.group[static_cast<std::size_t>(i)]);
      low[g] = std::min(low[g], c.x[i]), high[g] = std::max(high[g], c.x[i]);
    }
    // What changes within groups by less than a fiftieth of what it changes in all is the group's own number.
    double widest = 0.0;
    for (std::size_t g = 0; g < low.size(); ++g) widest = std::max(widest, high[g] - low[g]);
    c.varies_within_groups = widest > 0.02 * c.span();
  }
}

}  // namespace

std::string_view rangeName(const table::Readings& readings) { return readings.unit == "mm" ? "range_mm" : "value"; }

terms::Quantity quantityOf(const table::Readings& readings) {
  return readings.unit == "mm" ? terms::Quantity::RangeMm : terms::Quantity::Value;
}

const std::string& groupColumn(const table::Readings& readings) {
  return readings.capture_name.empty() ? readings.session_name : readings.capture_name;
}

std::string headerOf(const table::Readings& readings, const std::string& covariate) {
  if (covariate == kLine) return "the line of the file";
  if (covariate == rangeName(readings)) return readings.reference_name.empty() ? covariate : readings.reference_name;
  return covariate;
}

std::vector<std::string> headersOf(const table::Readings& readings, const std::vector<std::string>& covariates) {
  std::vector<std::string> headers;
  for (const std::string& covariate : covariates) headers.push_back(headerOf(readings, covariate));
  return headers;
}

std::vector<int> seriesOf(std::span<const double> reference) {
  std::vector<int> none(reference.size(), 0);
  if (reference.size() < 2 * kShortest) return none;
  // Medians of some rows, so that a reference that jitters from row to row still goes one way.
  const std::size_t width = std::max<std::size_t>(5, reference.size() / 120);
  const auto medianFrom = [&](std::size_t from) {
    const auto begin = reference.begin() + static_cast<std::ptrdiff_t>(from);
    return median({begin, begin + static_cast<std::ptrdiff_t>(std::min(width, reference.size() - from))});
  };
  std::vector<double> step;
  for (std::size_t i = 0; i + 2 * width <= reference.size(); i += width) step.push_back(medianFrom(i + width) - medianFrom(i));
  const auto [low, high] = std::ranges::minmax(reference);
  const auto rising = static_cast<double>(std::ranges::count_if(step, [](double s) { return s > 0.0; }));
  const auto falling = static_cast<double>(std::ranges::count_if(step, [](double s) { return s < 0.0; }));
  if (std::max(rising, falling) < 0.85 * static_cast<double>(step.size())) return none;
  const double sign = rising >= falling ? 1.0 : -1.0;
  // It begins anew where it falls back by a fifth of its span, between what comes before and what comes after.
  std::vector<int> series = none;
  int number = 0;
  std::size_t begun = 0;
  for (std::size_t i = width; i + width <= reference.size(); ++i) {
    const double before = medianFrom(i - width), after = medianFrom(i);
    const bool begins = i >= begun + kShortest && sign * (after - before) < -0.2 * (high - low) &&
                        sign * (reference[i] - reference[i - 1]) < -0.1 * (high - low);
    if (!begins) continue;
    ++number, begun = i;
    std::fill(series.begin() + static_cast<std::ptrdiff_t>(i), series.end(), number);
  }
  return static_cast<std::size_t>(number) < kMostSeries ? series : none;
}

void giveGroups(TableEvidence& out, const table::Readings& readings) {
  Evidence& e = out.evidence;
  e.group.assign(out.row.size(), 0), e.group_names = {""};
  const std::string& name = groupColumn(readings);
  const auto column = std::ranges::find(readings.covariates, name, &table::Column::header);
  if (name.empty() || column == readings.covariates.end()) return;
  std::map<double, int> numbers;
  e.group_names.clear();
  for (std::size_t i = 0; i < out.row.size(); ++i) {
    const double value = column->values[out.row[i]];
    const auto [at, is_new] = numbers.try_emplace(value, static_cast<int>(numbers.size()));
    if (is_new)
      e.group_names.push_back(column->words.empty() ? fmt::format("{:g}", value) : column->words[static_cast<std::size_t>(value)]);
    e.group[i] = at->second;
  }
}

TableEvidence evidenceOf(const table::Readings& readings) {
  TableEvidence out;
  std::vector<const table::Column*> columns;
  for (const table::Column& column : readings.covariates) {
    std::size_t missing = 0;
    for (const double value : column.values) missing += std::isnan(value) ? 1 : 0;
    if (static_cast<double>(missing) > kMostMissing * static_cast<double>(readings.rows())) {
      out.notes.push_back(fmt::format("{} is not looked at: {} of its {} fields are missing", column.header, missing, readings.rows()));
      continue;
    }
    columns.push_back(&column);
  }
  std::size_t left_out = 0;
  for (std::size_t i = 0; i < readings.rows(); ++i) {
    bool is_whole = std::isfinite(readings.error[i]) && (readings.reference.empty() || std::isfinite(readings.reference[i]));
    for (const table::Column* column : columns) is_whole = is_whole && !std::isnan(column->values[i]);
    if (is_whole) out.row.push_back(i);
    else ++left_out;
  }
  if (left_out > 0) out.notes.push_back(fmt::format("{} of {} rows lack a value and are left out", left_out, readings.rows()));

  Evidence& e = out.evidence;
  const auto n = static_cast<Eigen::Index>(out.row.size());
  const auto take = [&](const std::vector<double>& from) {
    Eigen::VectorXd to(from.empty() ? 0 : n);
    for (Eigen::Index i = 0; i < to.size(); ++i) to[i] = from[out.row[static_cast<std::size_t>(i)]];
    return to;
  };
  e.y = take(readings.error), e.reference = take(readings.reference), out.measured = take(readings.measured);
  e.sigma = readings.sigma.empty() ? Eigen::VectorXd::Ones(n) : take(readings.sigma);
  if (readings.modulation_mhz > 0.0 && readings.unit == "mm") e.periods = {0.5 * kLightMmMhz / readings.modulation_mhz};
  giveGroups(out, readings);
  for (const table::Column* column : columns) {
    e.covariates.push_back(covariateOf(*column, out.row));
    e.covariates.back().is_group_name = column->header == readings.session_name || column->header == readings.capture_name;
  }
  if (e.reference.size() > 0) {
    e.covariates.push_back({.name = std::string{rangeName(readings)}, .unit = readings.unit, .nature = table::Nature::Length, .x = e.reference, .is_reference = true});
    const auto series = seriesOf({e.reference.data(), static_cast<std::size_t>(n)});
    for (std::size_t i = 1; i < series.size(); ++i)
      if (series[i] != series[i - 1]) out.begins.push_back(readings.line[out.row[i]]);
  }
  if (!e.find(kLine)) {
    Covariate c{.name = std::string{kLine}, .nature = table::Nature::Index, .x = Eigen::VectorXd(n), .is_order = true};
    for (Eigen::Index i = 0; i < n; ++i) c.x[i] = static_cast<double>(readings.line[out.row[static_cast<std::size_t>(i)]]);
    e.covariates.push_back(std::move(c));
  }
  for (Covariate& c : e.covariates) {
    describe(c);
    if (c.nature == table::Nature::Length) c.periods = e.periods;
    c.goes_with_lines = c.is_order || goesWithLines(c);
  }
  markWithinGroups(e);
  return out;
}

}  // namespace toftwin::loop
