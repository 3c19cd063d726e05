// SPDX-License-Identifier: Apache-2.0
#include "calib/table/sentinels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "calib/table/words.h"

namespace toftwin::table {
namespace {

constexpr std::size_t kFewestOthers = 8;  ///< different values
constexpr double kOfCode = 1.0, kOfCodeAmongFew = 3.0, kOfFew = 5.0, kOfMany = 20.0, kFewShare = 0.03;

/// Equal values of a sorted column.
struct Level {
  double value = 0.0;
  std::size_t count = 0;
};

std::vector<Level> levelsOf(const std::vector<double>& values) {
  std::vector<double> sorted;
  std::ranges::copy_if(values, std::back_inserter(sorted), [](double v) { return std::isfinite(v); });
  std::ranges::sort(sorted);
  std::vector<Level> levels;
  for (const double v : sorted) {
    if (levels.empty() || levels.back().value != v) levels.push_back({v, 0});
    ++levels.back().count;
  }
  return levels;
}

/// By how many times of the others' spread it must be away from them.
double farEnough(const Level& level, std::size_t rows, Screened as) {
  constexpr std::size_t kFewestRepeats = 3;
  if (isCode(level.value)) return kOfCode;
  if (as == Screened::Reading)
    return level.value == 0.0 || level.count >= kFewestRepeats ? kOfMany
                                                               : std::numeric_limits<double>::infinity();
  const auto few = std::max<std::size_t>(1, static_cast<std::size_t>(kFewShare * static_cast<double>(rows)));
  return level.count <= few && level.value != 0.0 ? kOfFew : kOfMany;
}

/// Whether the outermost level is isolated from the others, which reach from `low` to `high`.
bool isIsolated(const Level& level, double low, double high, std::size_t others, std::size_t rows,
                Screened as) {
  if (2 * level.count > rows) return false;
  const double gap = level.value > high ? level.value - high : low - level.value, spread = high - low;
  if (others >= kFewestOthers) return gap > farEnough(level, rows, as) * spread;
  return isCode(level.value) && others >= 2 && gap > kOfCodeAmongFew * spread;
}

/// Peels isolated levels off both ends.
std::set<double> isolatedLevels(const std::vector<double>& values, Screened as) {
  constexpr std::size_t kMostLevels = 6;
  const std::vector<Level> levels = levelsOf(values);
  std::set<double> isolated;
  std::size_t begin = 0, end = levels.size();
  const auto rows =
      static_cast<std::size_t>(std::ranges::count_if(values, [](double v) { return std::isfinite(v); }));
  while (end - begin > 2 && isolated.size() < kMostLevels) {
    const std::size_t others = end - begin - 1;
    if (isIsolated(levels[end - 1], levels[begin].value, levels[end - 2].value, others, rows, as)) {
      isolated.insert(levels[--end].value);
    } else if (isIsolated(levels[begin], levels[begin + 1].value, levels[end - 1].value, others, rows, as)) {
      isolated.insert(levels[begin++].value);
    } else {
      break;
    }
  }
  return isolated;
}

/// Whether the column rises or falls steadily all through, so that a far value at its end goes on with it.
bool isSorted(const std::vector<double>& values) {
  std::vector<double> there;
  std::ranges::copy_if(values, std::back_inserter(there), [](double v) { return std::isfinite(v); });
  return std::ranges::is_sorted(there) || std::ranges::is_sorted(there, std::ranges::greater{});
}

}  // namespace

bool isCode(double value) {
  constexpr std::array kCodes{85.0,    -127.0,     -1.0,         255.0,        999.0,    999.9,     999.99,
                              9999.0,  9999.9,     9999.99,      99999.0,      999999.0, 32767.0,   65535.0,
                              65534.0, 16777215.0, 2147483647.0, 4294967295.0, 1e9,      9999999.0, 4095.0,
                              16383.0, 8191.0,     6553.5,       655.35,       99999.9,  850.0};
  const double size = std::abs(value);
  const bool is_signed = std::ranges::find(kCodes, value) != kCodes.end();
  // −999.9, −32768 and their like.
  return is_signed || (value < 0.0 && size >= 99.0 && std::ranges::find(kCodes, size) != kCodes.end()) ||
         value == -32768.0 || value == -2147483648.0 || size > 1e30;
}

std::vector<std::size_t> isolatedRows(const std::vector<double>& values, Screened as) {
  const std::set<double> isolated = isolatedLevels(values, as);
  if (isolated.empty()) return {};
  const bool is_sorted = isSorted(values);
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i]) || !isolated.contains(values[i])) continue;
    if (is_sorted && (as == Screened::Time || !isCode(values[i]))) continue;
    rows.push_back(i);
  }
  return rows;
}

std::vector<SetAside> setSentinelsAside(Table& table, const std::set<std::size_t>& columns,
                                        const std::set<std::size_t>& readings) {
  std::vector<std::vector<std::size_t>> isolated(table.columns.size());
  std::vector<std::size_t> times(table.rows());
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    const TableColumn& column = table.columns[c];
    if (column.kind != Kind::Number || !columns.contains(c)) continue;
    const bool is_time = says(column.stem, Meaning::Time);
    isolated[c] = isolatedRows(column.values, readings.contains(c) ? Screened::Reading
                                              : is_time            ? Screened::Time
                                                                   : Screened::Covariate);
    for (const std::size_t row : isolatedRows(column.values, Screened::Covariate)) ++times[row];
  }
  std::vector<SetAside> aside;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    TableColumn& column = table.columns[c];
    for (const std::size_t row : isolated[c]) {
      const double value = column.values[row];
      if (times[row] > 1 && !isCode(value)) continue;
      aside.push_back({table.line[row], column.header, value,
                       fmt::format("no reading: {:.10g} is far from all other values", value)});
      column.values[row] = std::nan("");
    }
  }
  return aside;
}

std::vector<std::string> inWords(const std::vector<SetAside>& aside) {
  constexpr std::size_t kNamed = 8;
  std::map<std::pair<std::string, std::string>, std::vector<std::size_t>> lines;
  for (const SetAside& one : aside) lines[{one.column, one.why}].push_back(one.line);
  std::vector<std::string> sentences;
  for (auto& [what, where] : lines) {
    const std::size_t more = where.size() - std::min(where.size(), kNamed);
    const char* word = where.size() == 1 ? "line" : "lines";
    where.resize(where.size() - more);
    sentences.push_back(fmt::format("{}{} ({} {}{})", what.first.empty() ? "" : "column " + what.first + ": ", what.second,
                                    word, fmt::join(where, ", "), more == 0 ? "" : fmt::format(" and {} more", more)));
  }
  return sentences;
}

}  // namespace toftwin::table
