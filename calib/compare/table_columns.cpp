// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/table_columns.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "calib/compare/column_units.h"
#include "calib/compare/traits/repeats.h"
#include "calib/table/covariate.h"
#include "calib/table/sentinels.h"
#include "calib/table/table.h"
#include "calib/table/table.h"
#include "protocol/types/counted.h"

namespace toftwin::compare {
namespace {

bool isOf(table::Quantity quantity, const char* column) {
  const table::Unit* unit = unitOf(column);
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
    if (std::isfinite(one)) most_m = std::max(most_m, 1e-3 * std::abs(one) * unitOf(column)->in_base);
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
  const table::Unit& unit = *unitOf(column);
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
Result<> addSessions(const table::Table& rows, TableColumns& table) {
  const auto at = rows.find(kSession);
  if (!at) return at.error().code == Error::Code::NotFound || !table.kind->shares_places ? Result<>{} : at.error();
  const bool has_names = rows.columns[*at].kind == table::Kind::Text;
  auto numbers = has_names ? table::categoryOf(rows, *at).values : rows.numbers(*at);
  if (!numbers) return table.kind->shares_places ? numbers.error() : Result<>{};
  std::vector<double> column = *std::move(numbers);
  const auto of_rows = ofFiniteRows(column, table.values);
  const std::size_t count = sharedPlacesOf(of_rows).count;
  const std::string wrong = wrongWithSessions(column, count, of_rows.size());
  if (table.kind->shares_places && !wrong.empty()) {
    return Error{Error::Code::Malformed,
                 fmt::format("{}: column \"{}\" {}; if it does not number sessions, call it otherwise", rows.file.string(),
                             kSession, wrong)};
  }
  const bool is_heeded = table.kind->shares_places && count > 1;
  table.notes.push_back(
      is_heeded
          ? fmt::format(
                "rows are of {} sessions, each of which may have an offset of its own: what it is in is the "
                "mean over sessions, and as uncertain as these differ",
                count)
          : fmt::format("column \"{}\", of {}, is not heeded", kSession, counted(count, "value")));
  if (is_heeded) table.session = std::move(column);
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
    if (!isOf(table::Quantity::Length, column)) continue;
    add(noteOnSize(column, table.values[i]));
    if (isReading(column)) add(noteOnSteps(column, table.values[i]));
  }
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

/// The file's names of the kind's columns. Errors: an unknown kind, no frequency, another number of names.
static Result<std::vector<std::string>> namesIn(const TableJob& job, const TableKind& kind) {
  if (kind.needs_frequency && job.frequency_hz.empty()) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{} takes the modulation frequencies: --frequency-mhz", job.kind)};
  }
  if (job.columns.empty()) return std::vector<std::string>{kind.columns.begin(), kind.columns.end()};
  if (job.columns.size() == kind.columns.size()) return job.columns;
  return Error{Error::Code::InvalidArgument, fmt::format("{} takes {} columns ({}), not {}", job.kind, kind.columns.size(),
                                                         fmt::join(kind.columns, ", "), job.columns.size())};
}

/// One column in the unit that is wanted.
static Result<std::vector<double>> columnIn(const table::Table& rows, ColumnName name, const char* wanted,
                                            std::vector<std::string>& notes) {
  const auto at = rows.find(name.in_file);
  if (at && name.unit.empty()) name.unit = rows.columns[*at].unit;  // of a line of units
  const bool is_time = at && rows.columns[*at].kind == table::Kind::Time && isOf(table::Quantity::Time, wanted);
  if (is_time) name.unit = "s";
  const auto factor = factorOf(name, wanted);
  if (!factor) return Error{factor.error().code, fmt::format("{}: {}", rows.file.string(), factor.error().message)};
  if (!at) return at.error();
  auto values = rows.numbers(*at);
  if (!values) return values;
  if (!*factor)
    notes.push_back(fmt::format("column \"{}\" says no unit and is taken as {}", name.in_file, unitOf(wanted)->name));
  const double first = is_time ? std::ranges::min(*values, std::ranges::less{}, [](double v) { return std::isnan(v) ? INFINITY : v; }) : 0.0;
  for (double& one : *values) one = (name.is_negated ? -1.0 : 1.0) * (one - first) * factor->value_or(1.0);
  return values;
}

/// Sets what stands for no reading to NaN, in the columns that are used.
static void setNoReadingsAside(const std::vector<ColumnName>& names, const TableKind& kind, table::Table& rows,
                               std::vector<std::string>& notes) {
  std::set<std::size_t> used, readings;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto at = rows.find(names[i].in_file);
    if (!at) continue;
    used.insert(*at);
    if (isReading(kind.columns[i])) readings.insert(*at);
  }
  for (std::string& one : table::inWords(table::setSentinelsAside(rows, used, readings))) notes.push_back(std::move(one));
}

Result<TableColumns> loadTable(const TableJob& job) {
  TableColumns table{.kind = findTableKind(job.kind)};
  if (table.kind == nullptr)
    return Error{Error::Code::InvalidArgument, fmt::format("there is no kind of table \"{}\"", job.kind)};
  const auto& wanted = table.kind->columns;
  const auto given = namesIn(job, *table.kind);
  if (!given) return given.error();
  auto rows = table::readTable(job.file);
  if (!rows) return rows.error();
  for (std::string& one : table::inWords(rows->aside)) table.notes.push_back(std::move(one));
  std::vector<ColumnName> names;
  for (const std::string& name : *given) names.push_back(columnNameOf(name));
  setNoReadingsAside(names, *table.kind, *rows, table.notes);
  for (std::size_t i = 0; i < names.size(); ++i) {
    auto column = columnIn(*rows, names[i], wanted[i], table.notes);
    if (!column) {
      Error error = column.error();
      const bool is_missing = error.code == Error::Code::NotFound;
      if (is_missing && job.columns.empty())
        error.message += fmt::format("; --columns says which of its own stand for {}", fmt::join(wanted, ", "));
      return error;
    }
    table.values.push_back(*std::move(column));
  }
  addNote(table, noteOnRows(table.values));  // of the file, before zeros are none
  for (std::size_t i = 0; i < wanted.size(); ++i)
    if (isOf(table::Quantity::Length, wanted[i])) addNote(table, takeZerosAsMissing(wanted[i], table.values[i]));
  if (auto added = addSessions(*rows, table); !added) return added.error();
  addNotes(table);
  return table;
}

TableColumns withoutRows(TableColumns table, const std::vector<std::size_t>& rows) {
  std::vector<bool> is_kept;
  std::size_t finite = 0;
  for (std::size_t i = 0; i < table.values.front().size(); ++i) {
    const bool is_finite = std::ranges::all_of(table.values, [i](const auto& c) { return std::isfinite(c[i]); });
    is_kept.push_back(!is_finite || std::ranges::find(rows, finite) == rows.end());
    finite += is_finite;
  }
  const auto keep = [&](std::vector<double>& column) {
    std::size_t i = 0;
    std::erase_if(column, [&](double) { return !is_kept[i++]; });
  };
  for (auto& column : table.values) keep(column);
  keep(table.session);
  return table;
}

}  // namespace toftwin::compare
