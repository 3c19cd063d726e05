// SPDX-License-Identifier: Apache-2.0
#include "calib/table/reference.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "calib/table/line_fit.h"
#include "calib/table/units.h"
#include "calib/table/words.h"

namespace toftwin::table {
namespace {

constexpr std::size_t kFewestPairs = 12;
constexpr double kLeastGain = 0.2, kMostGain = 5.0;

/// Whether a gain is that of one unit of length said for another. Beyond what a camera's gain can be, a gain
/// of 30 % may come on top; within it only a ratio that is nearly exact is taken for one, and only where a
/// header says no unit.
bool isRatioOfUnits(double gain, double tolerance) {
  constexpr std::array kMillimetres{1.0, 10.0, 1e3, 1e-3, 25.4, 304.8};
  for (const double a : kMillimetres)
    for (const double b : kMillimetres)
      if (a != b && std::abs(std::log(gain * a / b)) < tolerance) return true;
  return false;
}

enum class Follows { Not, Yes, InOtherUnits };

struct Candidate {
  std::size_t column = 0;
  Follows follows = Follows::Not;
  LineFit fit{};
  double gain = 1.0;  ///< in the same unit, as far as the headers say one
  [[nodiscard]] bool varies() const { return fit.pairs >= kFewestPairs && fit.spread_x > 0.0; }
};

/// `most_beside`: of the measured values' spread, what a line may leave.
Candidate lookAt(const Table& table, std::size_t column, std::size_t measured, double most_beside) {
  const TableColumn &x = table.columns[column], &y = table.columns[measured];
  Candidate one{.column = column, .fit = lineThrough(x.values, y.values)};
  const double x_mm = millimetresIn(x), y_mm = millimetresIn(y);
  const bool are_both_said = x_mm > 0.0 && y_mm > 0.0;
  one.gain = one.fit.slope * (are_both_said ? y_mm / x_mm : 1.0);
  // A line that most rows are near is one, whatever wrapped rows do to the ranks.
  constexpr double kNear = 0.25;
  const double certain = 4.0 / std::sqrt(static_cast<double>(std::max<std::size_t>(one.fit.pairs, 1)));
  const bool is_line = one.fit.beside < most_beside && (one.fit.rank > certain || one.fit.beside < kNear);
  if (!one.varies() || !(one.gain > 0.0) || !is_line) return one;
  const bool is_gain = one.gain > kLeastGain && one.gain < kMostGain;
  constexpr double kThirtyPercent = 0.3, kFivePercent = 0.05, kTwoPercent = 0.02;
  const double tolerance = is_gain ? kTwoPercent : are_both_said ? kThirtyPercent : kFivePercent;
  if (isRatioOfUnits(one.gain, tolerance) && !(is_gain && are_both_said)) {
    one.follows = Follows::InOtherUnits;
  } else if (is_gain) {
    one.follows = Follows::Yes;
  }
  return one;
}

class Search {
 public:
  Search(const Table& table, Roles& roles, std::vector<std::string>& notes)
      : table_(table), roles_(roles), notes_(notes), measured_(*roles.measured) {}

  /// Of a reference that the map or a header's words name.
  Result<> checkNamed() {
    const Candidate named = lookAt(table_, *roles_.reference, measured_, 0.5);
    if (named.follows == Follows::InOtherUnits) return inOtherUnits(named);
    const bool has_gain = named.varies() && named.fit.beside < 0.5 && named.gain > 0.0;
    if (has_gain && (named.gain < kLeastGain || named.gain > kMostGain)) return inOtherUnits(named);
    if (roles_.is_reference_said || named.follows == Follows::Yes || !contradicts(named)) return {};
    const auto others = candidates(Meaning::Target, 0.3);
    if (!others.empty())
      return ask({named.column, others.front().column}, "is called so, but the values follow the other");
    return Error{
        Error::Code::InvalidArgument,
        fmt::format(
            "{}: {} is called the reference, but {} does not follow it (rank correlation {:.2f}). Say in "
            "a map which column is: reference = \"…\"; or ignore = [\"{}\"] (docs/tables.md)",
            table_.file.string(), name(named.column), name(measured_), named.fit.rank, name(named.column))};
  }

  /// By the words of a target, then by what the rows do alone.
  Result<> find() {
    std::vector<Candidate> found;
    for (const std::size_t column : roles_.other_references)
      add(lookAt(table_, column, measured_, 0.5), found);
    if (found.empty()) found = candidates(Meaning::Target, 0.5);
    const bool is_by_words = !found.empty();
    if (found.empty()) found = plainCandidates();
    if (found.empty()) return {};
    for (const Candidate& one : found)
      if (one.follows == Follows::InOtherUnits && found.size() == 1) return inOtherUnits(one);
    std::erase_if(found, [](const Candidate& one) { return one.follows != Follows::Yes; });
    if (found.empty()) return {};
    if (found.size() > 1) {
      std::vector<std::size_t> columns;
      for (const Candidate& one : found) columns.push_back(one.column);
      return ask(columns, "follow it");
    }
    roles_.reference = found.front().column;
    std::erase_if(roles_.covariates, [&](const auto& one) { return one.first == found.front().column; });
    notes_.push_back(
        fmt::format("{1} follows {0}{2} at a gain of {3:+.1f} % and is taken for what it should be; if it is "
                    "none, write a map: reference = \"…\", or ignore = [\"{0}\"]",
                    name(found.front().column), name(measured_),
                    is_by_words ? "" : ", whose words say nothing,", 100.0 * (found.front().gain - 1.0)));
    return {};
  }

 private:
  [[nodiscard]] const std::string& name(std::size_t column) const { return table_.columns[column].header; }
  static void add(Candidate one, std::vector<Candidate>& found) {
    if (one.follows != Follows::Not) found.push_back(one);
  }
  [[nodiscard]] bool mayBe(std::size_t c) const {
    const TableColumn& column = table_.columns[c];
    const Unit* unit = findUnit(column.unit);
    const bool is_length = column.unit.empty() || (unit != nullptr && unit->quantity == Quantity::Length);
    return c != measured_ && !roles_.isUsed(c) && isCovariate(c) && column.kind == Kind::Number &&
           !column.odd && is_length && !says(column.stem, Meaning::Sigma) &&
           !says(column.stem, Meaning::Error);
  }
  [[nodiscard]] bool isCovariate(std::size_t c) const {
    return std::ranges::any_of(roles_.covariates, [&](const auto& one) { return one.first == c; });
  }
  [[nodiscard]] std::vector<Candidate> candidates(Meaning meaning, double most_beside) const {
    std::vector<Candidate> found;
    for (std::size_t c = 0; c < table_.columns.size(); ++c)
      if (says(table_.columns[c].stem, meaning) && mayBe(c))
        add(lookAt(table_, c, measured_, most_beside), found);
    return found;
  }
  /// Lengths of any name that are followed closely at a gain near 1; what is the measured value again is
  /// none.
  [[nodiscard]] std::vector<Candidate> plainCandidates() const {
    constexpr double kMostBeside = 0.1, kLeast = 0.7, kMost = 1.4;
    std::vector<Candidate> found;
    for (std::size_t c = 0; c < table_.columns.size(); ++c) {
      const TableColumn& column = table_.columns[c];
      const bool is_reading =
          says(column.stem, Meaning::Measured) || says(column.stem, Meaning::Range) ||
          hasWord(column.stem, {"mean", "median", "raw", "filtered", "min", "max", "avg", "mittel"});
      if (is_reading || !(millimetresIn(column) > 0.0) || !mayBe(c)) continue;
      const Candidate one = lookAt(table_, c, measured_, kMostBeside);
      if (one.follows == Follows::Yes && one.gain > kLeast && one.gain < kMost) found.push_back(one);
    }
    return found;
  }
  /// What changes widely while the measured values neither go with it nor change as much.
  [[nodiscard]] bool contradicts(const Candidate& one) const {
    const double x_mm = millimetresIn(table_.columns[one.column]),
                 y_mm = millimetresIn(table_.columns[measured_]);
    const double factor = x_mm > 0.0 && y_mm > 0.0 ? x_mm / y_mm : 1.0;
    const double chance = 3.0 / std::sqrt(static_cast<double>(std::max<std::size_t>(one.fit.pairs, 1)));
    return one.varies() && one.fit.rank < chance && factor * one.fit.spread_x > 2.0 * one.fit.spread_y;
  }
  [[nodiscard]] Error ask(const std::vector<std::size_t>& columns, const char* why) const {
    std::string names;
    for (const std::size_t column : columns) names += (names.empty() ? "" : ", ") + name(column);
    return {
        Error::Code::InvalidArgument,
        fmt::format(
            "{}: which column is the reference of {}: {}? {}. Write a map: reference = \"…\", and ignore = "
            "[\"…\"] for what is none (docs/tables.md)",
            table_.file.string(), name(measured_), names,
            columns.size() > 1 && std::string_view{why} == "follow it" ? "All of them go with it"
                                                                       : "The first " + std::string{why})};
  }
  [[nodiscard]] Error inOtherUnits(const Candidate& one) const {
    const bool are_said =
        millimetresIn(table_.columns[measured_]) > 0.0 && millimetresIn(table_.columns[one.column]) > 0.0;
    return {Error::Code::InvalidArgument,
            fmt::format(
                "{}: {} changes by {:.4g} for each 1 of {}: {}, as in reference_m beside measured_mm. If it "
                "is no "
                "matter of units, write their difference into a column and say it in a map: error = \"…\"",
                table_.file.string(), name(measured_), one.fit.slope, name(one.column),
                are_said ? "one of the headers ends in the wrong unit; end both in their own"
                         : "they are in other units; end both headers in their own")};
  }

  const Table& table_;
  Roles& roles_;
  std::vector<std::string>& notes_;
  std::size_t measured_;
};

}  // namespace

double millimetresIn(const TableColumn& column) {
  const Unit* unit = findUnit(column.unit);
  return unit != nullptr && unit->quantity == Quantity::Length ? unit->in_base : 0.0;
}

Result<> findReference(const Table& table, const TableMap& map, Roles& roles,
                       std::vector<std::string>& notes) {
  if (roles.error || !roles.measured) return {};
  Search search{table, roles, notes};
  if (roles.reference) return search.checkNamed();
  return map.covariates.empty() ? search.find() : Result<>{};
}

}  // namespace toftwin::table
