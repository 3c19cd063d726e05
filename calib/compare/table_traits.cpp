// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/table_traits.h"

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <string_view>

#include <fmt/format.h>

#include <toftwin/units.h>

#include "calib/compare/csv.h"
#include "calib/compare/fitted_figure.h"
#include "calib/compare/trait_verdict.h"

namespace toftwin::compare {
namespace {

/// Units that a column's name may end in; those of one quantity are converted into each other.
struct Unit {
  std::string_view suffix;
  char quantity;
  double in_base;
};
constexpr std::array kUnits{Unit{"_m", 'l', 1.0},       Unit{"_cm", 'l', 1e-2},       Unit{"_mm", 'l', 1e-3},
                            Unit{"_um", 'l', 1e-6},     Unit{"_s", 't', 1.0},         Unit{"_ms", 't', 1e-3},
                            Unit{"_us", 't', 1e-6},     Unit{"_klx", 'e', 1.0},       Unit{"_lx", 'e', 1e-3},
                            Unit{"_m_per_s", 'v', 1.0}, Unit{"_mm_per_s", 'v', 1e-3}, Unit{"_px", 'p', 1.0}};

/// The longest suffix that fits: "_m_per_s" before "_s".
const Unit* unitOf(std::string_view column) {
  const Unit* best = nullptr;
  for (const Unit& unit : kUnits) {
    if (column.ends_with(unit.suffix) && (best == nullptr || unit.suffix.size() > best->suffix.size()))
      best = &unit;
  }
  return best;
}

/// What values of `there` are multiplied by to be in `wanted`'s unit. A name without a unit is taken as it
/// is.
Result<double> factorOf(std::string_view there, std::string_view wanted) {
  const Unit *from = unitOf(there), *to = unitOf(wanted);
  if (from == nullptr || to == nullptr) return 1.0;
  if (from->quantity == to->quantity) return from->in_base / to->in_base;
  return Error{
      Error::Code::InvalidArgument,
      fmt::format("column \"{}\" cannot stand for {}: its unit is of another quantity", there, wanted)};
}

Error ofTable(const TableJob& job, const Error& error) {
  return {error.code, fmt::format("{}: {}", job.file.string(), error.message)};
}

/// Rows of the image are the table's lines, of as many pixels as the longest has.
Image<float> imageOf(const std::vector<double>& line, const std::vector<double>& range_m) {
  std::map<double, std::vector<float>> rows;
  for (std::size_t i = 0; i < line.size(); ++i) rows[line[i]].push_back(static_cast<float>(range_m[i]));
  std::size_t width = 0;
  for (const auto& [number, row] : rows) width = std::max(width, row.size());
  Image<float> image(static_cast<int>(width), static_cast<int>(rows.size()),
                     std::numeric_limits<float>::quiet_NaN());
  int y = 0;
  for (const auto& [number, row] : rows) {
    for (std::size_t x = 0; x < row.size(); ++x) image(static_cast<int>(x), y) = row[x];
    ++y;
  }
  return image;
}

/// Of one frequency exactly, of several for a small veil.
Traits scatterOf(const std::vector<std::vector<double>>& c, const std::vector<double>& f) {
  return f.size() == 1 ? scatterTraits(c[0], c[1], c[2], c[3], f.front())
                       : veilTraits(c[0], c[1], c[2], c[3], f);
}

/// A table's rows for the plot.
NamedRows rowsOf(const TableColumns& table, const char* of) {
  NamedRows rows{table.kind->name, of};
  const bool has_two = table.values.size() > 1;
  rows.y = table.values[has_two ? 1 : 0];
  for (std::size_t i = 0; i < rows.y.size(); ++i)
    rows.x.push_back(has_two ? table.values[0][i] : static_cast<double>(i));
  return rows;
}

/// Rows are of the same condition where both tables have the same x, row by row; a row's number is no condition.
void pairRows(NamedTraits& traits, const TableKind& kind) {
  if (kind.columns.size() < 2 || traits.rows.size() != 2 || traits.rows[0].x != traits.rows[1].x) return;
  for (NamedRows& rows : traits.rows) {
    rows.condition.resize(rows.x.size());
    std::iota(rows.condition.begin(), rows.condition.end(), std::size_t{0});
  }
}

Figure figureOf(const NamedTraits& traits, const TableKind& kind) {
  const bool has_two = kind.columns.size() > 1, is_law = std::string_view{kind.name} == "noise_law";
  const Unit* unit = unitOf(kind.columns[has_two ? 1 : 0]);
  auto figure = fittedFigure(traits, kind.name,
                             {.title = kind.tells,
                              .caption = "The tables' rows, and what was fitted to them.",
                              .x_label = has_two ? kind.columns[0] : "row",
                              .y_label = kind.columns[has_two ? 1 : 0],
                              .log_x = is_law,
                              .log_y = is_law,
                              .compact = false,
                              .rest_unit = std::string{unit == nullptr ? "" : unit->suffix.substr(1)}});
  return figure.value_or(Figure{"Too few rows to draw."});
}

}  // namespace

const std::vector<TableKind>& tableKinds() {
  static const std::vector<TableKind> kinds{
      {"drift", "warm-up drift and its model", {"time_s", "value_mm"}},
      {"harmonics",
       "error over distance: waves per period, scale, residual",
       {"distance_m", "error_mm"},
       true},
      {"noise_law", "floor, shot noise and read noise", {"signal", "sigma_mm"}},
      {"wraps", "share of errors of whole periods", {"error_m"}, true},
      {"corner", "multipath's fall from the edge", {"distance_to_edge_m", "error_mm"}},
      {"lens_scatter",
       "share of a plate's light that veils what lies behind",
       {"own_range_m", "plate_range_m", "plate_over_own", "error_mm"},
       true},
      {"flying_pixels", "flying pixels of scan lines", {"line", "range_m"}},
      {"edge", "an edge's width and the lateral resolution", {"place_px", "value"}},
      {"amplitude", "amplitude-related error", {"amplitude", "error_mm"}},
      {"ambient", "ambient-related error and noise", {"ambient_klx", "error_mm", "sigma_mm"}},
      {"motion", "motion artefact", {"speed_m_per_s", "error_mm"}},
      {"lag", "what frames after a change of light still have of it", {"frames_after", "value"}},
      {"frame_timing", "interval, jitter, lost frames", {"start_s"}}};
  return kinds;
}

const TableKind* findTableKind(const std::string& name) {
  const auto found = std::ranges::find(tableKinds(), name, &TableKind::name);
  return found == tableKinds().end() ? nullptr : &*found;
}

Result<TableColumns> loadTable(const TableJob& job) {
  TableColumns table{.kind = findTableKind(job.kind)};
  if (table.kind == nullptr)
    return Error{Error::Code::InvalidArgument, fmt::format("there is no kind of table \"{}\"", job.kind)};
  const auto& wanted = table.kind->columns;
  if (table.kind->needs_frequency && job.frequency_hz.empty()) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{} takes the modulation frequencies: --frequency-mhz", job.kind)};
  }
  std::vector<std::string> names = job.columns;
  if (names.empty()) names.assign(wanted.begin(), wanted.end());
  if (names.size() != wanted.size()) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{} takes {} columns ({}), not {}", job.kind, wanted.size(),
                             fmt::join(wanted, ", "), names.size())};
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    const bool is_negated = names[i].starts_with('-');
    const std::string name = names[i].substr(is_negated ? 1 : 0);
    const auto factor = factorOf(name, wanted[i]);
    if (!factor) return ofTable(job, factor.error());
    auto column = loadColumns(job.file, {name});
    if (!column) return column.error();
    for (double& one : column->front()) one *= is_negated ? -*factor : *factor;
    table.values.push_back(std::move(column->front()));
  }
  return table;
}

void addTraits(const TableColumns& table, const std::vector<double>& f, const char* of, TraitCollector& all) {
  const auto& c = table.values;
  const std::string kind = table.kind->name;
  NamedRows rows = rowsOf(table, of);
  if (kind == "drift") return all.add(std::move(rows), driftTraits(c[0], c[1]));
  if (kind == "harmonics") return all.add(std::move(rows), fittedHarmonics(c[0], c[1], f));
  if (kind == "noise_law") return all.add(std::move(rows), fittedNoiseLaw(c[0], c[1], f));
  all.draw(std::move(rows));
  const std::map<std::string, std::function<Traits()>> rest{
      {"wraps", [&] { return wrapTraits(c[0], unambiguousRange(std::ranges::max(f) * hertz).in(metre)); }},
      {"corner", [&] { return cornerTraits(c[0], c[1]); }},
      {"lens_scatter", [&] { return scatterOf(c, f); }},
      {"flying_pixels", [&] { return flyingTraits(imageOf(c[0], c[1])); }},
      {"edge", [&] { return edgeTraits(c[0], c[1]); }},
      {"amplitude", [&] { return amplitudeTraits(c[0], c[1]); }},
      {"ambient", [&] { return ambientTraits(c[0], c[1], c[2]); }},
      {"motion", [&] { return motionTraits(c[0], c[1]); }},
      {"lag", [&] { return lagTraits(c[0], c[1]); }},
      {"frame_timing", [&] { return timingTraits(c[0]); }}};
  all.add(kind, of, rest.at(kind)());
}

Result<Report> judgeTables(const std::vector<TableJob>& jobs) {
  constexpr std::array kOf{"A", "B"};
  TraitCollector all;
  std::vector<std::string> files;
  const TableKind* kind = nullptr;
  for (std::size_t i = 0; i < std::min(jobs.size(), kOf.size()); ++i) {
    const auto table = loadTable(jobs[i]);
    if (!table) return table.error();
    kind = table->kind;
    addTraits(*table, jobs[i].frequency_hz, kOf[i], all);
    files.push_back(
        fmt::format("{} ({}, {} rows)", kOf[i], jobs[i].file.filename().string(), table->values[0].size()));
  }
  if (kind == nullptr) return Error{Error::Code::InvalidArgument, "no table is named"};
  NamedTraits traits = std::move(all).found();
  pairRows(traits, *kind);
  if (traits.traits.empty())
    return Error{Error::Code::InvalidArgument, fmt::format("{}", fmt::join(traits.untold, "; "))};
  const auto verdicts = verdictsOf(traits);
  Report report{.title = fmt::format("Characteristics of tables: {}", kind->name),
                .subtitle = fmt::format("{}", fmt::join(files, " and "))};
  report.verdict = verdicts.empty() ? fmt::format("{} numbers told: {}.", traits.traits.size(), kind->tells)
                                    : headlineOf(verdicts) + ".";
  report.cards = cardsOf(verdicts);
  Section section{.id = "table", .title = kind->tells};
  if (!verdicts.empty()) section.blocks.push_back(verdictTable(verdicts));
  section.blocks.push_back(figureOf(traits, *kind));
  section.blocks.push_back(traitTable(traits));
  if (!traits.untold.empty())
    section.blocks.push_back(whatIsNotTold("What these tables cannot tell", traits));
  report.sections.push_back(std::move(section));
  report.data.set("kind", kind->name)
      .set("characteristics", toJson(traits))
      .set("verdicts", toJson(verdicts));
  report.explained_in = "docs/characteristics.md";
  return report;
}

}  // namespace toftwin::compare
