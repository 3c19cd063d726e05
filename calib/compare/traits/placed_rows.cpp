// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/placed_rows.h"

#include <utility>

#include "calib/compare/traits/clusters.h"
#include "calib/linear/linear.h"

namespace toftwin::compare {
namespace {

/// How many of the sessions' offsets take a degree of freedom from the places: none where each place has as many rows
/// of each session, all where each session has places of its own.
std::size_t offsetsOfPlaces(const SharedPlaces& places, Column session) {
  const auto rows = static_cast<Eigen::Index>(places.count);
  Eigen::MatrixXd means = Eigen::MatrixXd::Ones(rows, 1);
  for (const auto& column : offsetColumns(session)) {
    const auto of_places = clusterMeans(column, places.of);
    means.conservativeResize(rows, means.cols() + 1);
    means.rightCols(1) = Eigen::Map<const Eigen::VectorXd>(of_places.data(), rows);
  }
  return static_cast<std::size_t>(linear::basisOf(means).cols()) - 1;
}

}  // namespace

PlacedRows::PlacedRows(RowsOfSessions rows, std::size_t parameters) : session_{std::move(rows.session)} {
  if (session_.empty()) {
    rows_ = meansAtPlaces(std::move(rows.columns), parameters);
    return;
  }
  SharedPlaces places = sharedPlacesOf(rows.columns.front());
  rows_ = asTheyAre(std::move(rows.columns));
  if (!places.areShared()) return;
  if (places.areTooFewFor(parameters + offsetsOfPlaces(places, session_)))
    rows_.doubt = doubtOfPlaces(places.of.size(), places.count);
  else
    places_ = std::move(places);
}

std::optional<Fit> PlacedRows::fit(const Model& model, std::size_t of_column, const std::vector<double>& start) const {
  const auto &x = rows_.columns[0], &y = rows_.columns[of_column];
  auto fit = rows_.own[of_column].empty() ? fitBesideSessions(model, y, start, x, session_, places_.of)
                                          : fitMeans(model, y, rows_.own[of_column], start, x);
  if (fit && fit->odd_rows.empty() && !rows_.doubt.empty()) fit->doubt = rows_.doubt;
  return fit;
}

}  // namespace toftwin::compare
