// SPDX-License-Identifier: Apache-2.0
#include "tests/loop/laws.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>
#include <sstream>

#include <fmt/format.h>

#include "calib/loop/answer.h"
#include "calib/loop/discover.h"
#include "calib/table/readings.h"

namespace toftwin::testing {
namespace {

bool isLength(const std::string& header) { return header.ends_with("_mm"); }
double numberOf(const std::string& field) { return std::stod(field); }
std::string textOf(double value) { return fmt::format("{:.9g}", value); }

template <class Change>
TextTable withFields(TextTable table, bool (*isMeant)(const std::string&), Change change) {
  for (std::size_t c = 0; c < table.header.size(); ++c) {
    if (!isMeant(table.header[c])) continue;
    for (auto& row : table.rows) row[c] = textOf(change(numberOf(row[c])));
  }
  return table;
}

TextTable shuffled(const TextTable& table, std::uint64_t seed) {
  TextTable out = table;
  std::mt19937_64 random{seed};
  std::ranges::shuffle(out.rows, random);
  return out;
}

TextTable permuted(const TextTable& table, std::uint64_t seed) {
  std::vector<std::size_t> order(table.header.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::mt19937_64 random{seed};
  std::ranges::shuffle(order, random);
  TextTable out = table;
  for (std::size_t i = 0; i < order.size(); ++i) {
    out.header[i] = table.header[order[i]];
    for (std::size_t r = 0; r < out.rows.size(); ++r) out.rows[r][i] = table.rows[r][order[i]];
  }
  return out;
}

/// Other words for the same, in English and in German.
TextTable renamed(const TextTable& table, const std::vector<std::pair<std::string, std::string>>& words) {
  TextTable out = table;
  for (std::string& header : out.header)
    for (const auto& [from, to] : words)
      if (header == from) header = to;
  return out;
}
TextTable synonyms(const TextTable& table, std::uint64_t) {
  return renamed(table, {{"reference_mm", "truth_mm"}, {"depth_mm", "reading_mm"}, {"measured_mm", "reading_mm"}, {"time_s", "elapsed_s"}});
}
TextTable german(const TextTable& table, std::uint64_t) {
  return renamed(table, {{"reference_mm", "Referenz_mm"}, {"depth_mm", "Messwert_mm"}, {"measured_mm", "Messwert_mm"}, {"time_s", "Zeit_s"}, {"column", "Spalte"}, {"row", "Zeile"}});
}

TextTable inMetres(const TextTable& table, std::uint64_t) {
  TextTable out = withFields(table, isLength, [](double mm) { return 1e-3 * mm; });
  for (std::string& header : out.header)
    if (isLength(header)) header = header.substr(0, header.size() - 2) + "m";
  return out;
}

TextTable withIrrelevant(const TextTable& table, std::uint64_t seed) {
  TextTable out = table;
  std::mt19937_64 random{seed};
  std::normal_distribution<double> normal{45.0, 6.0};
  out.header.emplace_back("humidity_percent");
  for (auto& row : out.rows) row.push_back(textOf(normal(random)));
  return out;
}

TextTable inTwoSessions(const TextTable& table, std::uint64_t) {
  if (std::ranges::find(table.header, "run") != table.header.end()) return table;
  TextTable out = table;
  out.header.emplace_back("session");
  for (std::size_t r = 0; r < out.rows.size(); ++r) out.rows[r].emplace_back(r < out.rows.size() / 2 ? "monday" : "tuesday");
  return out;
}

/// One measured value is what a camera gives where it sees nothing.
TextTable withSentinel(const TextTable& table, std::uint64_t seed) {
  TextTable out = table;
  std::mt19937_64 random{seed};
  for (std::size_t c = 0; c < out.header.size(); ++c)
    if (out.header[c] == "depth_mm" || out.header[c] == "measured_mm") out.rows[random() % out.rows.size()][c] = "65535";
  return out;
}

bool isMeasured(const std::string& header) { return header == "depth_mm" || header == "measured_mm"; }
TextTable withConstant(const TextTable& table, std::uint64_t) {
  return withFields(table, isMeasured, [](double mm) { return mm + 17.5; });
}
TextTable doubled(const TextTable& table, std::uint64_t) {
  return withFields(table, isLength, [](double mm) { return 2.0 * mm; });
}
TextTable halved(const TextTable& table, std::uint64_t seed) {
  TextTable out = table;
  std::mt19937_64 random{seed};
  out.rows.clear();
  for (std::size_t r = 0; r + 1 < table.rows.size(); r += 2) out.rows.push_back(table.rows[r + (random() & 1U)]);
  return out;
}

constexpr std::array kLaws{
    Law{"lines shuffled", shuffled},         Law{"columns permuted", permuted},   Law{"synonyms", synonyms},
    Law{"in German", german},                Law{"in metres", inMetres},          Law{"an irrelevant column", withIrrelevant},
    Law{"two named sessions", inTwoSessions}, Law{"one sentinel", withSentinel},   Law{"a constant added", withConstant},
    Law{"all lengths doubled", doubled},     Law{"half of the rows", halved},
};

/// What a column is called, whatever words a law gave it.
std::string known(std::string name) {
  static const std::vector<std::pair<std::string, std::string>> kSame{{"elapsed_s", "time_s"}, {"Zeit_s", "time_s"}, {"Spalte", "column"}, {"Zeile", "row"},
                                                                      {"plate_m", "plate_mm"}};
  for (const auto& [from, to] : kSame)
    if (name == from) name = to;
  return name;
}

}  // namespace

std::span<const Law> laws() { return kLaws; }

TextTable parsedTable(const std::string& csv) {
  TextTable table;
  std::istringstream in{csv};
  const auto fields = [](std::string line) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    std::vector<std::string> all;
    std::istringstream parts{line};
    for (std::string field; std::getline(parts, field, ',');) all.push_back(field);
    return all;
  };
  std::string line;
  std::getline(in, line);
  table.header = fields(line);
  while (std::getline(in, line)) table.rows.push_back(fields(line));
  return table;
}

std::string csvOf(const TextTable& table) {
  std::string out;
  const auto add = [&](const std::vector<std::string>& fields) {
    for (std::size_t i = 0; i < fields.size(); ++i) out += (i > 0 ? "," : "") + fields[i];
    out += '\n';
  };
  add(table.header);
  for (const auto& row : table.rows) add(row);
  return out;
}

std::string verdictOf(const std::string& csv) {
  auto readings = table::parseReadings(csv, {}, "law.csv");
  if (!readings) return "refused: " + readings.error().message;
  const auto found = loop::discover(*std::move(readings), {});
  if (!found) return "refused: " + found.error().message;
  const auto sets = [&](const loop::Explanation& explanation) {
    std::set<std::string> all;
    for (const loop::Effect& effect : explanation.effects) {
      std::set<std::string> names;
      for (const std::string& name : effect.shape.covariates) names.insert(known(name));
      std::string one;
      for (const std::string& name : names) one += (one.empty() ? "" : "*") + name;
      all.insert(one);
    }
    std::string out;
    for (const std::string& one : all) out += (out.empty() ? "" : ", ") + one;
    return out.empty() ? std::string{"nothing"} : out;
  };
  std::string out = "mean " + sets(found->mean) + "; spread " + sets(found->spread);
  std::set<int> kinds;
  for (const loop::NoReadings& none : found->no_readings)
    if (none.rows.size() > 2) kinds.insert(static_cast<int>(none.kind));
  for (const int kind : kinds) out += fmt::format("; no readings {}", kind);
  if (found->share) out += "; share " + sets(*found->share);
  return out;
}

}  // namespace toftwin::testing
