// SPDX-License-Identifier: Apache-2.0
#include "calib/table/sums.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "calib/table/number.h"

namespace toftwin::table {
namespace {

constexpr std::size_t kFewestRows = 8, kMostSums = 6;

/// The numbers of a column above a row, and how finely they are written.
struct Above {
  std::vector<double> values{};
  int decimals = 0;  ///< the most
  double low = 0.0, high = 0.0;
};

char signIn(const ColumnFields& fields, std::size_t rows) {
  std::size_t points = 0, commas = 0;
  for (std::size_t i = 0; i < rows; ++i) {
    const Signs signs = signsOf(fields[i]);
    points += signs == Signs::Point, commas += signs == Signs::Comma;
  }
  return commas > points ? ',' : '.';
}

/// Nothing where the column holds a text, or too few numbers.
std::optional<Above> aboveOf(const ColumnFields& fields, std::size_t rows, char sign) {
  Above above;
  for (std::size_t i = 0; i < rows; ++i) {
    const auto value = numberIn(fields[i], sign);
    if (!value) return std::nullopt;
    if (!std::isfinite(*value)) continue;
    above.values.push_back(*value);
    above.decimals = std::max(above.decimals, decimalsOf(fields[i], sign));
  }
  if (above.values.size() < kFewestRows) return std::nullopt;
  const auto [low, high] = std::ranges::minmax(above.values);
  above.low = low, above.high = high;
  return above;
}

enum class Function { Sum, Mean, Median, Deviation };
constexpr std::array kFunctions{std::pair{Function::Sum, "the sum"}, std::pair{Function::Mean, "the mean"},
                                std::pair{Function::Median, "the median"},
                                std::pair{Function::Deviation, "the standard deviation"}};

double valueOf(Function function, const Above& above) {
  const auto n = static_cast<double>(above.values.size());
  double sum = 0.0, squares = 0.0;
  for (const double v : above.values) sum += v;
  const double mean = sum / n;
  if (function == Function::Sum) return sum;
  if (function == Function::Mean) return mean;
  if (function == Function::Median) {
    std::vector<double> sorted = above.values;
    std::ranges::sort(sorted);
    const std::size_t half = sorted.size() / 2;
    return sorted.size() % 2 == 1 ? sorted[half] : 0.5 * (sorted[half - 1] + sorted[half]);
  }
  for (const double v : above.values) squares += (v - mean) * (v - mean);
  return std::sqrt(squares / (n - 1.0));
}

/// By how much rounding may put it off: half a step of its own, and what the rows' rounding adds up to.
double slackOf(Function function, const Above& above, int decimals) {
  const auto n = static_cast<double>(above.values.size());
  const double step = std::pow(10.0, -above.decimals), own = 0.5 * std::pow(10.0, -decimals);
  const double of_rows = 3.0 * step * std::sqrt((function == Function::Sum ? n : 1.0 / n) / 12.0);
  const double arithmetic = 1e-12 * n * std::max(std::abs(above.low), std::abs(above.high));
  return own + of_rows + arithmetic;
}

/// How unlikely it is that a number agrees with the function by chance, in powers of two; nothing where it does not.
std::optional<double> agreement(Function function, const Above& above, double value, int decimals) {
  const double slack = slackOf(function, above, decimals);
  if (std::abs(value - valueOf(function, above)) > slack) return std::nullopt;
  const double width = above.high - above.low;
  if (!(width > 0.0) || value == above.values.back()) return 0.0;
  return std::max(0.0, std::log2(width / (2.0 * slack)));
}

/// Which function of the rows above it a row is; empty: none.
std::string sumIn(const std::vector<ColumnFields>& columns, std::size_t row, std::size_t rows) {
  constexpr double kMillionTables = 20.0, kTried = 5.0;  // powers of two: 4 functions of up to 6 rows
  for (const auto& [function, what] : kFunctions) {
    double certain = 0.0;
    bool agrees = true;
    for (const ColumnFields& fields : columns) {
      const std::string_view field = fields[row];
      if (saysNothing(field)) continue;
      const char sign = signIn(fields, rows);
      const auto above = aboveOf(fields, rows, sign);
      const auto value = numberIn(field, sign);
      if (!above || !value) continue;  // a column of texts, or one that names the row
      const auto bits = agreement(function, *above, *value, decimalsOf(field, sign));
      if (!bits) agrees = false;
      certain += bits.value_or(0.0);
    }
    if (agrees && certain > kMillionTables + kTried) return std::string{what} + " of the rows above";
  }
  return {};
}

}  // namespace

bool saysSum(std::string_view field) {
  constexpr std::array<std::string_view, 40> kWords{
      "total",    "totals",   "sum",      "sums",     "summe",      "summen",   "gesamt",   "gesamtsumme", "somme",
      "suma",     "somma",    "totale",   "mean",     "means",      "average",  "averages", "avg",         "mittel",
      "mittelwert", "durchschnitt", "moyenne", "media", "promedio", "median",   "mediana",  "mediane",     "std",
      "stdev",    "stddev",   "stabw",    "standardabweichung", "ecart-type", "desvest", "devst", "min",   "max",
      "minimum",  "maximum",  "count",    "anzahl"};
  if (field.empty() || field.size() > 30) return false;
  std::string word = folded(field);
  while (!word.empty() && (word.back() == ':' || word.back() == '.' || word.back() == '=' || word.back() == ' ')) word.pop_back();
  return std::ranges::find(kWords, word) != kWords.end();
}

std::vector<SumRow> sumRows(const std::vector<ColumnFields>& columns) {
  std::vector<SumRow> found;
  if (columns.empty() || columns.front().size() <= kFewestRows) return found;
  const std::size_t rows = columns.front().size();
  const std::size_t first = rows - std::min(rows - kFewestRows, kMostSums);
  for (std::size_t begin = first; begin < rows; ++begin) {
    found.clear();
    for (std::size_t row = begin; row < rows; ++row) {
      std::string_view name;
      for (const ColumnFields& fields : columns)
        if (saysSum(fields[row])) name = fields[row];
      // In a column of names "max" may be one of them.
      const bool is_name_of_many = std::ranges::any_of(columns, [&](const ColumnFields& fields) {
        return !name.empty() && fields[row] == name && std::ranges::count(fields, name) > 1;
      });
      std::string what = !name.empty() && !is_name_of_many ? fmt::format("it is called \"{}\"", name)
                                                           : sumIn(columns, row, begin);
      if (what.empty()) break;
      found.push_back({row, std::move(what)});
    }
    if (found.size() == rows - begin) return found;
  }
  return {};
}

}  // namespace toftwin::table
