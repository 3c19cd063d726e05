// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/bursts.h"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <limits>
#include <utility>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {
namespace {

/// Bursts over the gaps that are short, as long as there are more of these than chance makes.
template <class Burst>
std::vector<Burst> joined(std::vector<Burst> bursts, double others) {
  constexpr double kShort = 0.1, kWrong = 0.01;
  while (bursts.size() > 2) {
    const double mean = others / static_cast<double>(bursts.size()), longest = std::floor(kShort * mean);
    const auto isShort = [=](const Burst& one) { return one.gap <= longest; };
    const auto gaps = std::ranges::count_if(bursts, [](const Burst& one) { return std::isfinite(one.gap); }),
               near = std::ranges::count_if(bursts, isShort);
    if (near == 0) break;
    const boost::math::binomial chance{static_cast<double>(gaps), 1.0 - std::pow(1.0 - 1.0 / mean, longest)};
    if (cdf(complement(chance, static_cast<double>(near - 1))) > kWrong) break;
    std::vector<Burst> fewer;
    for (const Burst& one : bursts) {
      if (isShort(one))
        fewer.back().size += one.size;
      else
        fewer.push_back(one);
    }
    bursts = std::move(fewer);
  }
  return bursts;
}

}  // namespace

void Trials::add(bool happened, std::size_t times) {
  if (times == 0) return;
  if (is_new_series_ || runs_.back().happened != happened)
    runs_.push_back({.happened = happened, .begins_series = is_new_series_});
  runs_.back().length += static_cast<double>(times);
  count_[happened ? 1 : 0] += static_cast<double>(times);
  is_new_series_ = false;
}

std::vector<Trials::Burst> Trials::burstsOf(bool happened) const {
  std::vector<Burst> bursts;
  double gap = std::numeric_limits<double>::infinity();
  for (const Run& run : runs_) {
    if (run.begins_series) gap = std::numeric_limits<double>::infinity();
    if (run.happened == happened)
      bursts.push_back({run.length, gap}), gap = 0.0;
    else
      gap += run.length;
  }
  return bursts;
}

double Trials::together() const {
  const bool rarer = count_[1] <= count_[0];
  const auto bursts = joined(burstsOf(rarer), count_[rarer ? 0 : 1]);
  const auto number = static_cast<double>(bursts.size());
  double sum = 0.0, squares = 0.0, scatter = 0.0;
  for (const Burst& one : bursts) sum += one.size, squares += one.size * one.size;
  if (bursts.empty()) return 1.0;
  const double share = sum / all(), size = squares / sum, together = (1.0 - share) * size - share,
               of_one = (1.0 - share) * (2.0 * sum - 1.0) - share;
  if (!(together > 1.0)) return 1.0;
  if (bursts.size() < 2) return of_one;
  for (const Burst& one : bursts) scatter += std::pow(one.size * one.size - size * one.size, 2);
  const double error = (1.0 - share) * std::sqrt(scatter * number / (number - 1.0)) / sum;
  constexpr double kNormal = 1.959963984540054;
  const double degrees = std::min(number - 1.0, 2.0 * std::pow(together / std::max(error, 1e-9), 2));
  return std::min(together * std::pow(studentT(degrees) / kNormal, 2), of_one);
}

Trait Trials::share(std::string name, double together) const {
  const double one = std::max(together, this->together());
  const auto [low, high] = shareInterval(count_[1] / one, all() / one, ShareRule::Jeffreys);
  return {.name = std::move(name),
          .unit = "1",
          .value = count_[1] / all(),
          .low = low,
          .high = high,
          .n = static_cast<std::size_t>(all())};
}

}  // namespace toftwin::compare
