// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/table_traits.h"

#include <algorithm>
#include <array>
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
#include "calib/compare/fitted_figure.h"
#include "calib/compare/nearness.h"
#include "calib/compare/same_rows.h"
#include "calib/compare/trait_verdict.h"
#include "calib/compare/verdict_words.h"
#include "calib/compare/without_odd_rows.h"

namespace toftwin::compare {
namespace {

constexpr std::array kOf{"A", "B"};

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
  const table::Unit* unit = unitOf(kind.columns[has_two ? 1 : 0]);
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

/// All that tables of one kind tell.
NamedTraits traitsOf(const std::vector<TableColumns>& tables, const std::vector<TableJob>& jobs) {
  TraitCollector all;
  const bool are_waves = tables.back().kind == findTableKind("harmonics") && tables.size() == kOf.size();
  if (are_waves && jobs[0].frequency_hz == jobs[1].frequency_hz) {
    addSameWaves(tables, jobs[0].frequency_hz, all);
  } else {
    for (std::size_t i = 0; i < tables.size(); ++i) addTraits(tables[i], jobs[i].frequency_hz, kOf[i], all);
  }
  return std::move(all).found();
}

/// Beside what all rows say, not instead of it.
void addWithout(const NamedTraits& traits, const WithoutOddRows& without, Section& section) {
  section.blocks.push_back(besideAllRows(traits, without));
  if (without.verdicts.empty()) return;
  TableBlock verdicts = verdictTable(without.verdicts);
  verdicts.caption = "B against A once more, without these rows";
  section.blocks.push_back(std::move(verdicts));
}

/// Nothing where no row is odd.
std::optional<WithoutOddRows> withoutOddRows(const NamedTraits& traits, std::vector<TableColumns> tables,
                                             const std::vector<TableJob>& jobs) {
  WithoutOddRows without{.left_out = oddRowsOfTables(traits)};
  if (without.left_out.empty()) return std::nullopt;
  for (const OddRowsOfTable& odd : without.left_out) {
    TableColumns& table = tables[odd.of == kOf[0] ? 0 : 1];
    table = withoutRows(std::move(table), odd.rows);
  }
  without.traits = traitsOf(tables, jobs);
  without.verdicts = verdictsOf(without.traits);
  return without;
}

}  // namespace

Result<Report> judgeTables(const std::vector<TableJob>& jobs) {
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
  NamedTraits traits = traitsOf(tables, jobs);
  pairRows(traits, *kind);
  if (traits.traits.empty())
    return Error{Error::Code::InvalidArgument, fmt::format("{}", fmt::join(traits.untold, "; "))};
  std::ranges::copy(doubtsIn(traits), std::back_inserter(notes));
  const auto verdicts = verdictsOf(traits);
  const auto without = withoutOddRows(traits, tables, jobs);
  Report report{.title = fmt::format("Characteristics of tables: {}", kind->name),
                .subtitle = fmt::format("{}", fmt::join(files, " and "))};
  const std::string same = sameRowsInWords(tables);
  report.verdict = same + (verdicts.empty() ? clearestOf(traits) : headlineOf(verdicts)) + ".";
  if (without) report.verdict += " " + inWords(*without) + ".";
  report.cards = cardsOf(verdicts);
  if (!same.empty()) takeGreenOff(report.cards);
  Section section{.id = "table", .title = kind->tells};
  for (const std::string& note : notes) section.blocks.push_back(Paragraph{.text = note});
  if (!verdicts.empty()) section.blocks.push_back(verdictTable(verdicts));
  if (without) addWithout(traits, *without, section);
  section.blocks.push_back(figureOf(traits, *kind));
  section.blocks.push_back(traitTable(traits));
  if (!traits.untold.empty())
    section.blocks.push_back(whatIsNotTold("What these tables cannot tell", traits));
  report.sections.push_back(std::move(section));
  report.data.set("kind", kind->name)
      .set("characteristics", toJson(traits))
      .set("verdicts", toJson(verdicts));
  if (tables.size() > 1) report.data.set("are_same_rows", !same.empty());
  if (without) report.data.set("without_odd_rows", toJson(*without));
  Json said = Json::array();
  for (const std::string& note : notes) said.push(note);
  report.data.set("notes", std::move(said));
  report.notes = std::move(notes);
  report.explained_in = "docs/characteristics.md";
  return report;
}

}  // namespace toftwin::compare
