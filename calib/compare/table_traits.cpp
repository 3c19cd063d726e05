// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/table_traits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include <toftwin/units.h>

#include "calib/compare/column_units.h"
#include "calib/compare/csv.h"
#include "calib/compare/fitted_figure.h"
#include "calib/compare/trait_verdict.h"
#include "calib/compare/traits/repeats.h"
#include "calib/compare/verdict_words.h"

namespace toftwin::compare {
namespace {

constexpr std::array kOf{"A", "B"};

Error ofTable(const TableJob& job, const Error& error) {
  return {error.code, fmt::format("{}: {}", job.file.string(), error.message)};
}

bool isOf(Quantity quantity, const char* column) {
  const ColumnUnit* unit = unitOf(column);
  return unit != nullptr && unit->quantity == quantity;
}

/// Of one of the columns, the rows in which all are finite: those that numbers are from.
std::vector<double> ofFiniteRows(const std::vector<double>& column, const std::vector<std::vector<double>>& all) {
  std::vector<double> kept;
  for (std::size_t i = 0; i < column.size(); ++i) {
    if (std::ranges::all_of(all, [i](const auto& c) { return std::isfinite(c[i]); })) kept.push_back(column[i]);
  }
  return kept;
}

/// Rows that no number is from.
std::string noteOnRows(const std::vector<std::vector<double>>& columns) {
  const std::size_t left_out = columns.front().size() - ofFiniteRows(columns.front(), columns).size();
  if (left_out == 0) return {};
  return fmt::format("{} of {} rows hold a value that is not finite, and are left out", left_out,
                     columns.front().size());
}

/// Metres that are more likely to be millimetres.
std::string noteOnSize(const char* column, const std::vector<double>& values) {
  constexpr double kFarthest_m = 300.0;
  double most_m = 0.0;
  for (const double one : values) {
    if (std::isfinite(one)) most_m = std::max(most_m, std::abs(one) * unitOf(column)->in_base);
  }
  if (!(most_m > kFarthest_m)) return {};
  return fmt::format("{} goes up to {:.4g} m, which may be another unit", column, most_m);
}

/// The step that all differences of readings are multiples of, if there is one that many share; 0 where all
/// are alike.
std::optional<double> stepOf(std::vector<double> values) {
  std::erase_if(values, [](double one) { return !std::isfinite(one); });
  constexpr std::size_t kFewest = 12, kRowsPerValue = 3;
  if (values.size() < kFewest) return std::nullopt;
  std::ranges::sort(values);
  std::vector<double> steps;
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (values[i] > values[i - 1]) steps.push_back(values[i] - values[i - 1]);
  }
  if (steps.empty()) return 0.0;
  if (kRowsPerValue * (steps.size() + 1) > values.size()) return std::nullopt;
  const double step = std::ranges::min(steps);
  const bool is_step = std::ranges::all_of(steps, [step](double one) {
    constexpr double kRounding = 1e-3;
    return std::abs(one / step - std::round(one / step)) < kRounding;
  });
  return is_step ? std::optional{step} : std::nullopt;
}

std::string noteOnSteps(const char* column, const std::vector<double>& values) {
  const auto step = stepOf(values);
  if (!step) return {};
  const ColumnUnit& unit = *unitOf(column);
  if (*step == 0.0) {
    return fmt::format(
        "all {} readings of {} are alike: they are rounded to a step that does not show, and "
        "intervals know nothing of it",
        values.size(), column);
  }
  return fmt::format(
      "{} is in steps of {:.3g} {}: a mean of these {} rows is not known better than to about {:.2g} "
      "{} (step/√12n), or half a step where noise is below a third of one",
      column, *step, unit.name, values.size(), *step / std::sqrt(12.0 * static_cast<double>(values.size())),
      unit.name);
}

/// A camera writes 0 where it has no range. Ranges of 0 are taken as missing, and so are readings of 0 that
/// are farther from all others than these are from each other.
std::string takeZerosAsMissing(std::string_view column, std::vector<double>& values) {
  const bool is_range = column.find("range") != std::string_view::npos;
  if (!is_range && !column.starts_with("value")) return {};
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double one : values)
    if (std::isfinite(one) && one != 0.0) low = std::min(low, one), high = std::max(high, one);
  const auto zeros = std::ranges::count(values, 0.0);
  const bool are_far = high >= low && std::max(low, -high) > high - low;
  if (zeros == 0 || (!is_range && !are_far)) return {};
  std::ranges::replace(values, 0.0, std::numeric_limits<double>::quiet_NaN());
  return fmt::format("{} of {} rows have a {} of 0, {}: they are taken as missing", zeros, values.size(),
                     column, is_range ? "which is no range" : "far from all others");
}

constexpr const char* kSession = "session";

/// Why these are no sessions; empty: they may be.
std::string wrongWithSessions(const std::vector<double>& session, std::size_t count, std::size_t rows) {
  constexpr std::size_t kMost = 50, kFewestRows = 3;
  const auto bad = std::ranges::find_if_not(session, [](double one) { return std::isfinite(one); });
  if (bad != session.end()) return fmt::format("is {} in row {}", *bad, bad - session.begin() + 1);
  if (count > kMost || (count > 1 && kFewestRows * count > rows))
    return fmt::format("has {} values in {} rows: it takes {} rows of each, and at most {}", count, rows, kFewestRows,
                       kMost);
  return {};
}

/// The column that says of which session a row is: of a kind that heeds it, and where there are several.
Result<> addSessions(const std::filesystem::path& file, TableColumns& table) {
  if (!hasColumn(file, kSession)) return {};
  auto column = loadColumns(file, {kSession});
  if (!column && !table.kind->shares_places) return {};
  if (!column) return Error{column.error().code, column.error().message + "; sessions are numbered"};
  const auto of_rows = ofFiniteRows(column->front(), table.values);
  const std::size_t count = sharedPlacesOf(of_rows).count;
  const std::string wrong = wrongWithSessions(column->front(), count, of_rows.size());
  if (table.kind->shares_places && !wrong.empty()) {
    return Error{Error::Code::Malformed,
                 fmt::format("{}: column \"{}\" {}; if it does not number sessions, call it otherwise", file.string(),
                             kSession, wrong)};
  }
  const bool is_heeded = table.kind->shares_places && count > 1;
  table.notes.push_back(
      is_heeded ? fmt::format("rows are of {} sessions, each of which may have an offset of its own: what it is in is the "
                              "mean over sessions, and as uncertain as these differ",
                              count)
                : fmt::format("column \"{}\", of {} value{}, is not heeded", kSession, count, count == 1 ? "" : "s"));
  if (is_heeded) table.session = std::move(column->front());
  return {};
}

std::string noteOnPlaces(const TableColumns& table) {
  if (!table.kind->shares_places) return {};
  const SharedPlaces places = sharedPlacesOf(ofFiniteRows(table.values.front(), table.values));
  if (!places.areShared()) return {};
  return fmt::format(
      "{} has {} values in {} rows: what is read at one of them may be off together, so intervals are by how "
      "these {} "
      "scatter",
      table.kind->columns.front(), places.count, places.of.size(), places.count);
}

/// Readings are what characteristics are told from: values and errors.
bool isReading(std::string_view column) { return column.starts_with("value") || column.starts_with("error"); }

void addNote(TableColumns& table, std::string note) {
  if (!note.empty()) table.notes.push_back(std::move(note));
}

void addNotes(TableColumns& table) {
  const auto add = [&](std::string note) { addNote(table, std::move(note)); };
  add(noteOnPlaces(table));
  for (std::size_t i = 0; i < table.values.size(); ++i) {
    const char* column = table.kind->columns[i];
    if (!isOf(Quantity::Length, column)) continue;
    add(noteOnSize(column, table.values[i]));
    if (isReading(column)) add(noteOnSteps(column, table.values[i]));
  }
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

/// Rows are of the same condition where both tables have the same x, row by row; a row's number is no
/// condition.
void pairRows(NamedTraits& traits, const TableKind& kind) {
  if (kind.columns.size() < 2 || traits.rows.size() != 2 || traits.rows[0].x != traits.rows[1].x) return;
  for (NamedRows& rows : traits.rows) {
    rows.condition.resize(rows.x.size());
    std::iota(rows.condition.begin(), rows.condition.end(), std::size_t{0});
  }
}

Figure figureOf(const NamedTraits& traits, const TableKind& kind) {
  const bool has_two = kind.columns.size() > 1, is_law = std::string_view{kind.name} == "noise_law";
  const ColumnUnit* unit = unitOf(kind.columns[has_two ? 1 : 0]);
  auto figure = fittedFigure(traits, kind.name,
                             {.title = kind.tells,
                              .caption = "The tables' rows, and what was fitted to them.",
                              .x_label = has_two ? kind.columns[0] : "row",
                              .y_label = kind.columns[has_two ? 1 : 0],
                              .log_x = is_law,
                              .log_y = is_law,
                              .compact = false,
                              .rest_unit = std::string{unit == nullptr ? "" : unit->name}});
  return figure.value_or(Figure{"Too few rows to draw."});
}

}  // namespace

const std::vector<TableKind>& tableKinds() {
  static const std::vector<TableKind> kinds{
      {"drift", "warm-up drift and its model", {"time_s", "value_mm"}},
      {"harmonics",
       "error over distance: waves per period, scale, residual",
       {"distance_m", "error_mm"},
       true,
       true},
      {"noise_law", "floor, shot noise and read noise", {"signal", "sigma_mm"}},
      {"wraps", "share of errors of whole periods", {"error_m"}, true},
      {"corner", "multipath's fall from the edge", {"distance_to_edge_m", "error_mm"}, false, true},
      {"lens_scatter",
       "share of a plate's light that veils what lies behind",
       {"own_range_m", "plate_range_m", "plate_over_own", "error_mm"},
       true},
      {"flying_pixels", "flying pixels of scan lines", {"line", "range_m"}},
      {"edge", "an edge's width and the lateral resolution", {"place_px", "value"}},
      {"amplitude", "amplitude-related error", {"amplitude", "error_mm"}, false, true},
      {"ambient", "ambient-related error and noise", {"ambient_klx", "error_mm", "sigma_mm"}, false, true},
      {"motion", "motion artefact", {"speed_m_per_s", "error_mm"}, false, true},
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
    const ColumnName name = columnNameOf(names[i]);
    const auto factor = factorOf(name, wanted[i]);
    if (!factor) return ofTable(job, factor.error());
    auto column = loadColumns(job.file, {name.in_file});
    if (!column) return column.error();
    if (!*factor) {
      table.notes.push_back(fmt::format("column \"{}\" says no unit and is taken as {}", name.in_file,
                                        unitOf(wanted[i])->name));
    }
    for (double& one : column->front()) one *= (name.is_negated ? -1.0 : 1.0) * factor->value_or(1.0);
    table.values.push_back(std::move(column->front()));
  }
  addNote(table, noteOnRows(table.values));  // of the file, before zeros are none
  for (std::size_t i = 0; i < wanted.size(); ++i)
    if (isOf(Quantity::Length, wanted[i])) addNote(table, takeZerosAsMissing(wanted[i], table.values[i]));
  if (auto added = addSessions(job.file, table); !added) return added.error();
  addNotes(table);
  return table;
}

void addTraits(const TableColumns& table, const std::vector<double>& f, const char* of, TraitCollector& all) {
  const auto& c = table.values;
  const auto& session = table.session;
  const std::string kind = table.kind->name;
  NamedRows rows = rowsOf(table, of);
  if (kind == "drift") return all.add(std::move(rows), driftTraits(c[0], c[1]));
  if (kind == "harmonics") return all.add(std::move(rows), fittedHarmonics(c[0], c[1], f, {.session = session}));
  if (kind == "noise_law") return all.add(std::move(rows), fittedNoiseLaw(c[0], c[1], f));
  all.draw(std::move(rows));
  const std::map<std::string, std::function<Traits()>> rest{
      {"wraps", [&] { return wrapTraits(c[0], unambiguousRange(std::ranges::max(f) * hertz).in(metre)); }},
      {"corner", [&] { return cornerTraits(c[0], c[1], session); }},
      {"lens_scatter", [&] { return scatterOf(c, f); }},
      {"flying_pixels", [&] { return flyingTraits(imageOf(c[0], c[1])); }},
      {"edge", [&] { return edgeTraits(c[0], c[1]); }},
      {"amplitude", [&] { return amplitudeTraits(c[0], c[1], {}, session); }},
      {"ambient", [&] { return ambientTraits(c[0], c[1], c[2], session); }},
      {"motion", [&] { return motionTraits(c[0], c[1], session); }},
      {"lag", [&] { return lagTraits(c[0], c[1]); }},
      {"frame_timing", [&] { return timingTraits(c[0]); }}};
  all.add(kind, of, rest.at(kind)());
}

namespace {

/// Why numbers are in doubt, each reason once with the numbers that have it.
std::vector<std::string> doubtsIn(const NamedTraits& traits) {
  std::map<std::pair<std::string, std::string>, std::vector<std::string>> names;
  for (const NamedTrait& one : traits.traits)
    if (!one.trait.doubt.empty()) names[{one.of, one.trait.doubt}].push_back(one.trait.name);
  std::vector<std::string> notes;
  for (const auto& [reason, of] : names)
    notes.push_back(fmt::format("{}, in doubt ({}): {}.", reason.first, fmt::join(of, ", "), reason.second));
  return notes;
}

}  // namespace

/// Of two tables at the same frequencies, both with the same waves.
void addSameWaves(const std::vector<TableColumns>& tables, const std::vector<double>& f,
                  TraitCollector& all) {
  const auto fitOf = [&f](const TableColumns& table) -> HarmonicFit {
    return [&f, &table](std::size_t least) {
      return fittedHarmonics(table.values[0], table.values[1], f, {.session = table.session}, least);
    };
  };
  const auto both = withTheSameWaves({fitOf(tables[0]), fitOf(tables[1])});
  for (std::size_t i = 0; i < both.size(); ++i) all.add(rowsOf(tables[i], kOf[i]), both[i]);
}

Result<Report> judgeTables(const std::vector<TableJob>& jobs) {
  TraitCollector all;
  std::vector<std::string> files, notes;
  std::vector<TableColumns> tables;
  for (std::size_t i = 0; i < std::min(jobs.size(), kOf.size()); ++i) {
    auto table = loadTable(jobs[i]);
    if (!table) return table.error();
    for (const std::string& note : table->notes)
      notes.push_back(fmt::format("{} ({}): {}.", kOf[i], jobs[i].file.filename().string(), note));
    files.push_back(
        fmt::format("{} ({}, {} rows)", kOf[i], jobs[i].file.filename().string(), table->values[0].size()));
    tables.push_back(std::move(*table));
  }
  if (tables.empty()) return Error{Error::Code::InvalidArgument, "no table is named"};
  const TableKind* kind = tables.back().kind;
  const bool are_waves = kind == findTableKind("harmonics") && tables.size() == kOf.size();
  if (are_waves && jobs[0].frequency_hz == jobs[1].frequency_hz) {
    addSameWaves(tables, jobs[0].frequency_hz, all);
  } else {
    for (std::size_t i = 0; i < tables.size(); ++i) addTraits(tables[i], jobs[i].frequency_hz, kOf[i], all);
  }
  NamedTraits traits = std::move(all).found();
  pairRows(traits, *kind);
  if (traits.traits.empty())
    return Error{Error::Code::InvalidArgument, fmt::format("{}", fmt::join(traits.untold, "; "))};
  std::ranges::copy(doubtsIn(traits), std::back_inserter(notes));
  const auto verdicts = verdictsOf(traits);
  Report report{.title = fmt::format("Characteristics of tables: {}", kind->name),
                .subtitle = fmt::format("{}", fmt::join(files, " and "))};
  report.verdict = (verdicts.empty() ? clearestOf(traits) : headlineOf(verdicts)) + ".";
  report.cards = cardsOf(verdicts);
  Section section{.id = "table", .title = kind->tells};
  for (const std::string& note : notes) section.blocks.push_back(Paragraph{.text = note});
  if (!verdicts.empty()) section.blocks.push_back(verdictTable(verdicts));
  section.blocks.push_back(figureOf(traits, *kind));
  section.blocks.push_back(traitTable(traits));
  if (!traits.untold.empty())
    section.blocks.push_back(whatIsNotTold("What these tables cannot tell", traits));
  report.sections.push_back(std::move(section));
  report.data.set("kind", kind->name)
      .set("characteristics", toJson(traits))
      .set("verdicts", toJson(verdicts));
  Json said = Json::array();
  for (const std::string& note : notes) said.push(note);
  report.data.set("notes", std::move(said));
  report.notes = std::move(notes);
  report.explained_in = "docs/characteristics.md";
  return report;
}

}  // namespace toftwin::compare
