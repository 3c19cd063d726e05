// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/repeats.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/clusters.h"
#include "calib/compare/traits/uneven.h"

namespace toftwin::compare {

SharedPlaces sharedPlacesOf(Column x) {
  std::vector<double> places(x.begin(), x.end());
  std::erase_if(places, [](double one) { return !std::isfinite(one); });
  std::ranges::sort(places);
  const auto same = std::ranges::unique(places);
  places.erase(same.begin(), same.end());
  SharedPlaces all{.count = places.size()};
  for (const double one : x)
    all.of.push_back(static_cast<std::size_t>(std::ranges::lower_bound(places, one) - places.begin()));
  return all;
}

namespace {

/// σ of the mean of each place's rows, from what they are off from it.
std::vector<double> ownSigmas(Column values, Column x, const SharedPlaces& places, Column means) {
  std::vector<double> count(places.count, 0.0), left, at;
  for (const std::size_t one : places.of) count[one] += 1.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double n = count[places.of[i]];
    if (n < 2.0) continue;  // it is its own mean
    left.push_back((values[i] - means[places.of[i]]) / std::sqrt(1.0 - 1.0 / n)), at.push_back(x[i]);
    squares += left.back() * left.back() * (1.0 - 1.0 / n);
  }
  const double free = static_cast<double>(values.size() - places.count), even = std::sqrt(squares / free);
  const auto sigmas = sigmasOver(left, at, places.count);
  std::vector<double> own;
  for (const double one : count) own.push_back(even / std::sqrt(one));
  for (std::size_t i = 0, row = 0; i < values.size() && !sigmas.empty(); ++i) {
    const std::size_t place = places.of[i];
    if (count[place] > 1.0) own[place] = even * sigmas[row++] / std::sqrt(count[place]);
  }
  return own;
}

/// √(τ² + own²), of which the mean square is 1.
std::vector<double> sigmasWith(double place_variance, Column own) {
  std::vector<double> sigmas;
  double mean = 0.0;
  for (const double one : own) {
    sigmas.push_back(std::sqrt(place_variance + one * one));
    mean += sigmas.back() * sigmas.back() / static_cast<double>(own.size());
  }
  for (double& one : sigmas) one /= std::sqrt(mean);
  return sigmas;
}

}  // namespace

AtPlaces asTheyAre(std::vector<std::vector<double>> columns) {
  const std::size_t count = columns.size();
  return {.columns = std::move(columns), .own = std::vector<std::vector<double>>(count), .doubt = {}};
}

AtPlaces meansAtPlaces(std::vector<std::vector<double>> columns, std::size_t parameters) {
  const SharedPlaces places = sharedPlacesOf(columns.front());
  AtPlaces all = asTheyAre(std::move(columns));
  if (!places.areShared()) return all;
  if (places.areTooFewFor(parameters)) {
    all.doubt = doubtOfPlaces(places.of.size(), places.count);
    return all;
  }
  const std::vector<double> x = all.columns.front();
  for (std::size_t c = 0; c < all.columns.size(); ++c) {
    auto means = clusterMeans(all.columns[c], places.of);
    all.own[c] = ownSigmas(all.columns[c], x, places, means);
    all.columns[c] = std::move(means);
  }
  return all;
}

std::optional<Fit> fitMeans(const Model& model, Column y, Column own, const std::vector<double>& start, Column x) {
  const bool are_even = own.empty() || std::ranges::max(own) <= (1.0 + 1e-9) * std::ranges::min(own);
  const auto beyond = [&](double place_variance) {  // Σ r²/(τ² + own²) less n − k
    const auto sigmas = sigmasWith(place_variance, own);
    const auto fit = fitLeastSquares(over(model, sigmas), over(y, sigmas), start);
    const double scale = (place_variance + own[0] * own[0]) / (sigmas[0] * sigmas[0]);
    return fit ? fit->squares / scale - fit->degrees : 0.0;
  };
  if (are_even || !(std::ranges::min(own) > 0.0)) return fitInOrder(model, y, start, x);
  double low = 0.0, high = 0.0;
  if (beyond(0.0) > 0.0) {
    const Summary all = summarise(y);
    for (high = std::max(all.rms * all.rms, own[0] * own[0]); beyond(high) > 0.0; ) low = high, high *= 4.0;
    constexpr int kHalvings = 40;
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = 0.5 * (low + high);
      (beyond(middle) > 0.0 ? low : high) = middle;
    }
  }
  return fitOver(sigmasWith(high, own), model, y, start, x);
}

std::string doubtOfPlaces(std::size_t rows, std::size_t places) {
  return fmt::format(
      "its {} rows have {} different values of what they go with: rows that share one may err alike, and so few do "
      "not tell how uncertain it is",
      rows, places);
}

}  // namespace toftwin::compare
