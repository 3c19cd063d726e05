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

/// A column's numbers, read where they are first asked for.
class ColumnNumbers {
 public:
  explicit ColumnNumbers(const ColumnFields& fields) : fields_(&fields) {}

  /// Nothing where the column holds a text above the row, or too few numbers.
  [[nodiscard]] std::optional<Above> above(std::size_t rows) {
    read();
    if (first_text_ < rows) return std::nullopt;
    Above above{.decimals = decimals_};
    for (std::size_t i = 0; i < rows; ++i)
      if (std::isfinite(values_[i])) above.values.push_back(values_[i]);
    if (above.values.size() < kFewestRows) return std::nullopt;
    const auto [low, high] = std::ranges::minmax(above.values);
    above.low = low, above.high = high;
    return above;
  }
  [[nodiscard]] std::string_view field(std::size_t row) const { return (*fields_)[row]; }
  [[nodiscard]] char sign() {
    read();
    return sign_;
  }

 private:
  void read() {
    if (!values_.empty()) return;
    std::size_t points = 0, commas = 0;
    const std::size_t rows = fields_->size() - std::min(fields_->size(), kMostSums);
    for (std::size_t i = 0; i < rows; ++i) {
      const Signs signs = signsOf(field(i));
      points += signs == Signs::Point, commas += signs == Signs::Comma;
    }
    sign_ = commas > points ? ',' : '.';
    first_text_ = fields_->size();
    for (std::size_t i = 0; i < fields_->size(); ++i) {
      const auto value = numberIn(field(i), sign_);
      if (!value) first_text_ = std::min(first_text_, i);
      values_.push_back(value.value_or(std::nan("")));
      if (i < rows && value && std::isfinite(*value))
        decimals_ = std::max(decimals_, decimalsOf(field(i), sign_));
    }
  }

  const ColumnFields* fields_;
  std::vector<double> values_{};
  std::size_t first_text_ = 0;
  int decimals_ = 0;
  char sign_ = '.';
};

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

/// How unlikely it is that a number agrees with the function by chance, in powers of two; nothing where it
/// does not.
std::optional<double> agreement(Function function, const Above& above, double value, int decimals) {
  const double own = 0.5 * std::pow(10.0, -decimals), apart = std::abs(value - valueOf(function, above));
  const bool is_exact = apart <= (1.0 + 1e-6) * own;  // of the numbers as they are written
  const double slack = is_exact ? own : slackOf(function, above, decimals);
  if (apart > slack && !is_exact) return std::nullopt;
  const double width = above.high - above.low;
  if (!(width > 0.0) || value == above.values.back()) return 0.0;
  return std::max(0.0, std::log2(width / (2.0 * slack)));
}

/// How certain it is that a row is this function of the rows above it, in powers of two; nothing where one
/// number is not.
std::optional<double> certainty(Function function, std::vector<ColumnNumbers>& columns, std::size_t row,
                                std::size_t rows) {
  double certain = 0.0;
  for (ColumnNumbers& column : columns) {
    if (saysNothing(column.field(row))) continue;
    const auto above = column.above(rows);
    const auto value = numberIn(column.field(row), column.sign());
    if (!above || !value) continue;  // a column of texts, or one that names the row
    const auto bits = agreement(function, *above, *value, decimalsOf(column.field(row), column.sign()));
    if (!bits) return std::nullopt;
    certain += *bits;
  }
  return certain;
}

/// Which function of the rows above it a row is; empty: none.
std::string sumIn(std::vector<ColumnNumbers>& columns, std::size_t row, std::size_t rows) {
  constexpr double kMillionTables = 20.0, kTried = 5.0;  // powers of two: 4 functions of up to 6 rows
  for (const auto& [function, what] : kFunctions) {
    const auto certain = certainty(function, columns, row, rows);
    if (certain && *certain > kMillionTables + kTried) return std::string{what} + " of the rows above";
  }
  return {};
}

}  // namespace

bool saysSum(std::string_view field) {
  constexpr std::array<std::string_view, 40> kWords{"total",
                                                    "totals",
                                                    "sum",
                                                    "sums",
                                                    "summe",
                                                    "summen",
                                                    "gesamt",
                                                    "gesamtsumme",
                                                    "somme",
                                                    "suma",
                                                    "somma",
                                                    "totale",
                                                    "mean",
                                                    "means",
                                                    "average",
                                                    "averages",
                                                    "avg",
                                                    "mittel",
                                                    "mittelwert",
                                                    "durchschnitt",
                                                    "moyenne",
                                                    "media",
                                                    "promedio",
                                                    "median",
                                                    "mediana",
                                                    "mediane",
                                                    "std",
                                                    "stdev",
                                                    "stddev",
                                                    "stabw",
                                                    "standardabweichung",
                                                    "ecart-type",
                                                    "desvest",
                                                    "devst",
                                                    "min",
                                                    "max",
                                                    "minimum",
                                                    "maximum",
                                                    "count",
                                                    "anzahl"};
  if (field.empty() || field.size() > 30) return false;
  std::string word = folded(field);
  while (!word.empty() &&
         (word.back() == ':' || word.back() == '.' || word.back() == '=' || word.back() == ' '))
    word.pop_back();
  return std::ranges::find(kWords, word) != kWords.end();
}

std::vector<SumRow> sumRows(const std::vector<ColumnFields>& columns) {
  std::vector<SumRow> found;
  if (columns.empty() || columns.front().size() <= kFewestRows) return found;
  const std::size_t rows = columns.front().size();
  std::vector<ColumnNumbers> numbers(columns.begin(), columns.end());
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
                                                           : sumIn(numbers, row, begin);
      if (what.empty()) break;
      found.push_back({row, std::move(what)});
    }
    if (found.size() == rows - begin) return found;
  }
  return {};
}

}  // namespace toftwin::table
