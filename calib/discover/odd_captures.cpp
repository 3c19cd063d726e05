// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/odd_captures.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "calib/compare/statistics.h"
#include "protocol/types/counted.h"

namespace toftwin::discover {
namespace {

/// A median's deviation over a mean's, of Gaussian noise.
constexpr double kOfMedian = 1.2533;

struct RowsTogether {
  std::size_t first_line = 0, last_line = 0;
  int session = 0;
  std::vector<double> values{};
  double variance = 0.0;  ///< of all its rows
  double middle = 0.0, noise = 0.0;
};

/// Number of each row's capture, or of its group of rows.
std::vector<int> numbersOf(const TableSource& source) {
  if (source.hasCaptures()) return source.captureOf();
  constexpr std::size_t kFewest = 5, kMostGroups = 100;
  const TableData& data = source.data();
  const std::size_t size = std::max(kFewest, data.rows() / kMostGroups);
  std::map<int, std::size_t> seen;  // rows of each session so far
  std::map<std::pair<int, std::size_t>, int> known;
  std::vector<int> numbers;
  for (const int session : data.session)
    numbers.push_back(
        known.try_emplace({session, seen[session]++ / size}, static_cast<int>(known.size())).first->second);
  return numbers;
}

std::vector<RowsTogether> rowsTogether(const TableSource& source, const std::vector<double>& left) {
  const TableData& data = source.data();
  const std::vector<int> numbers = numbersOf(source);
  std::vector<RowsTogether> all(1 + static_cast<std::size_t>(*std::ranges::max_element(numbers)));
  for (std::size_t i = 0; i < left.size(); ++i) {
    RowsTogether& one = all[static_cast<std::size_t>(numbers[i])];
    if (one.values.empty()) one.first_line = data.line[i], one.session = data.session[i];
    one.last_line = std::max(one.last_line, data.line[i]);
    one.values.push_back(left[i]);
    one.variance += source.noise().sigma[i] * source.noise().sigma[i];
  }
  // Two rows are no witnesses that all of them are off: such rows are outliers.
  std::erase_if(all, [](const RowsTogether& one) { return one.values.size() < 3; });
  for (RowsTogether& one : all) {
    one.middle = compare::quantile(one.values, 0.5);
    one.noise = kOfMedian * std::sqrt(one.variance) / static_cast<double>(one.values.size());
  }
  return all;
}

}  // namespace

std::vector<OddRows> oddCaptures(const TableSource& source, const std::vector<double>& left) {
  constexpr std::size_t kFewest = 10;
  constexpr double kFar = 5.0;
  std::vector<OddRows> odd;
  if (left.empty()) return odd;
  const std::vector<RowsTogether> all = rowsTogether(source, left);
  if (all.size() < kFewest) return odd;
  std::vector<double> middles, off;
  for (const RowsTogether& one : all) middles.push_back(one.middle);
  const double middle = compare::quantile(middles, 0.5);
  for (const double one : middles) off.push_back(std::abs(one - middle));
  const double spread = 1.4826 * compare::quantile(off, 0.5);
  // Of few captures the spread itself is hardly known.
  const double far = kFar * (1.0 + kFar / static_cast<double>(all.size()));
  bool goes_on = false;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const RowsTogether& one = all[i];
    const double size = one.middle - middle;
    const bool is_far = std::abs(size) > far * std::max(spread, one.noise);
    const bool is_more =
        is_far && goes_on && all[i - 1].session == one.session && (size > 0.0) == (odd.back().size > 0.0);
    if (is_far && !is_more) odd.push_back({one.first_line, 0, 0, 0.0});
    if (is_far) {
      OddRows& here = odd.back();
      const auto before = static_cast<double>(here.captures++);
      here.last_line = one.last_line, here.size = (before * here.size + size) / (before + 1.0);
    }
    goes_on = is_far;
  }
  if (!source.hasCaptures())
    for (OddRows& one : odd) one.captures = 0;
  return odd;
}

std::string inWords(const std::vector<OddRows>& odd, const std::string& unit) {
  std::vector<std::string> words;
  for (const OddRows& one : odd) {
    const std::string captures = one.captures > 0 ? counted(one.captures, "capture") + ", " : "";
    words.push_back(
        fmt::format("lines {} to {} ({}{:+.3g}{})", one.first_line, one.last_line, captures, one.size, unit));
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

}  // namespace toftwin::discover
