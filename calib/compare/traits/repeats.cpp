// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/repeats.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/compare/traits/clusters.h"

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

AtPlaces meansAtPlaces(std::vector<std::vector<double>> columns, std::size_t parameters) {
  const SharedPlaces places = sharedPlacesOf(columns.front());
  AtPlaces all{.columns = std::move(columns)};
  if (!places.areShared()) return all;
  // Student's distribution of one degree of freedom has no mean.
  if (places.count < parameters + 2) {
    all.doubt = doubtOfPlaces(places.of.size(), places.count);
    return all;
  }
  for (auto& column : all.columns) column = clusterMeans(column, places.of);
  return all;
}

std::string doubtOfPlaces(std::size_t rows, std::size_t places) {
  return fmt::format(
      "its {} rows have {} different values of what they go with: rows that share one may err alike, and so few do "
      "not tell how uncertain it is",
      rows, places);
}

}  // namespace toftwin::compare
