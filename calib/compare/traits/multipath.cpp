// SPDX-License-Identifier: Apache-2.0
// Light that came by another way: corners, and a veil in the lens.
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include <toftwin/units.h>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/clusters.h"
#include "calib/compare/traits/least_squares.h"
#include "calib/compare/traits/placed_rows.h"
#include "calib/compare/traits/veil.h"

namespace toftwin::compare {

namespace {

/// Where a fit begins: the line through e over e^(−x/L), each session about its own mean, and ln of L's share. Far
/// from it a fit may end nowhere.
std::vector<double> startAt(double length_m, double share, const PlacedRows& corner) {
  const auto &x = corner.column(0), &e = corner.column(1);
  std::vector<double> fall;
  for (const double one : x) fall.push_back(std::exp(-one / length_m));
  const auto of =
      corner.session().empty() ? std::vector<std::size_t>(x.size(), 0) : sharedPlacesOf(corner.session()).of;
  const auto mean_fall = clusterMeans(fall, of), mean_e = clusterMeans(e, of);
  double both = 0.0, square = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double off = fall[i] - mean_fall[of[i]];
    both += off * (e[i] - mean_e[of[i]]), square += off * off;
  }
  const double size = square > 0.0 ? both / square : 0.0;
  return {summarise(e).mean - size * summarise(fall).mean, size, std::log(share)};
}

/// Whether the rows speak for a fall from the edge against none, by more than what the choice among so many
/// reaches makes of rows that show nothing.
bool isSeen(const Fit& fall, const PlacedRows& corner) {
  constexpr double kPositive = 2.0;  // evidence (Kass and Raftery, J. Am. Stat. Assoc. 90 (1995) 773)
  const auto none = corner.fit([](std::span<const double> p, std::size_t) { return p[0]; }, 1, {0.0});
  return none && none->bic() - fall.bic() > kPositive;
}

}  // namespace

Traits cornerTraits(Column distance_to_edge_m, Column error_mm, Column session) {
  auto finite = finiteRowsOf({distance_to_edge_m, error_mm}, session, 8, "corner");
  if (!finite) return finite.error();
  constexpr std::ptrdiff_t kParameters = 3;
  const PlacedRows corner{*std::move(finite), kParameters};
  const auto &x = corner.column(0), &e = corner.column(1);
  const double reach = std::ranges::max(x);
  if (!(reach > 0.0) || std::ranges::min(x) < 0.0)
    return undetermined("corner", "distances to the edge must not be negative");
  const Model model = [&](std::span<const double> p, std::size_t i) {
    return p[0] + p[1] * std::exp(-x[i] / (reach * std::exp(p[2])));
  };
  std::optional<Fit> fit;
  for (const double share : {0.03, 0.1, 0.3, 1.0}) {
    auto tried = startBesideSessions(model, e, startAt(share * reach, share, corner), corner.session());
    if (tried && (!fit || tried->squares < fit->squares)) fit = std::move(tried);
  }
  if (fit) fit = corner.fit(model, 1, {fit->at.begin(), fit->at.begin() + kParameters});
  constexpr double kMostReaches = 10.0;  // then it bends by a twentieth of itself, and passes for a line
  if (!fit || fit->at[2] > std::log(kMostReaches) || !isSeen(*fit, corner))
    return undetermined("corner", "the error does not fall off from the edge");
  constexpr double kMostAway = 10.0;  // of what the nearest row shows
  if (std::ranges::min(x) > std::log(kMostAway) * reach * std::exp(fit->at[2])) {
    return undetermined("corner", "of an error that falls so fast the nearest row shows less than a tenth");
  }
  Trait length = fit->trait("reach", "m", 2);
  for (double* value : {&length.value, &length.low, &length.high}) *value = reach * std::exp(*value);
  return std::vector{fit->trait("at the edge", "mm", 1), length, fit->trait("far from it", "mm", 0)};
}

Traits scatterTraits(Column own_range_m, Column plate_range_m, Column plate_over_own, Column error_mm,
                     double frequency_hz) {
  const auto rows = finiteRows({own_range_m, plate_range_m, plate_over_own, error_mm}, 3, "lens scatter");
  if (!rows) return rows.error();
  if (!(frequency_hz > 0.0)) return undetermined("lens scatter", "the modulation frequency must be positive");
  const auto &own = (*rows)[0], &plate = (*rows)[1], &ratio = (*rows)[2], &error = (*rows)[3];
  const double radians_per_m = 4.0 * std::numbers::pi * frequency_hz / kSpeedOfLight_m_per_s;
  const Model model = [&](std::span<const double> p, std::size_t i) {
    const double nearer = radians_per_m * (plate[i] - own[i]);
    return 1e3 * std::arg(1.0 + std::polar(p[0] * ratio[i], nearer)) / radians_per_m;
  };
  const auto fit = fitInOrder(model, error, {0.0}, own);
  if (!fit) return undetermined("lens scatter", "the plate is as far as what lies behind, or adds no light");
  return std::vector{fit->trait("veil", "1", 0)};
}

namespace {

/// By how much the range of one frequency moves for a small veil of 1, mm: q sin Δφ · c/4πf.
std::vector<double> slopesOf(const std::vector<double>& own, const std::vector<double>& plate,
                             const std::vector<double>& ratio, double frequency_hz) {
  const double radians_per_m = 4.0 * std::numbers::pi * frequency_hz / kSpeedOfLight_m_per_s;
  std::vector<double> slope_mm;
  for (std::size_t i = 0; i < own.size(); ++i)
    slope_mm.push_back(1e3 * ratio[i] * std::sin(radians_per_m * (plate[i] - own[i])) / radians_per_m);
  return slope_mm;
}

/// The constant, and what the veil does: a column for each frequency, or where it is known what each weighs,
/// one.
std::vector<std::vector<double>> columnsOf(std::span<const std::vector<double>> slopes_mm,
                                           std::span<const double> frequency_hz) {
  std::vector<std::vector<double>> columns{std::vector<double>(slopes_mm.front().size(), 1.0)};
  const std::vector<double> weights = rangeWeights(frequency_hz);
  if (weights.empty()) {
    columns.insert(columns.end(), slopes_mm.begin(), slopes_mm.end());
    return columns;
  }
  std::vector<double>& joined = columns.emplace_back(slopes_mm.front().size(), 0.0);
  for (std::size_t f = 0; f < weights.size(); ++f) {
    for (std::size_t i = 0; i < joined.size(); ++i) joined[i] += weights[f] * slopes_mm[f][i];
  }
  return columns;
}

const char* wordsOf(NoSum why, std::size_t columns) {
  switch (why) {
    case NoSum::FewRows:
      return "there are fewer of them than it takes";
    case NoSum::EmptyColumn:
      return "the plate adds no light that would move a range";
    case NoSum::ColumnsAlike:
      // The first column is the constant.
      return columns > 2 ? "the plate's light moves the ranges of two frequencies alike, or all rows alike"
                         : "the plate's light moves the ranges of all rows alike, as a constant does";
    case NoSum::OneCluster:
      break;
  }
  return "one capture alone tells it, so that nothing says how captures differ";
}

Traits veilByCaptures(const std::vector<std::vector<double>>& columns, Column error_mm,
                      std::span<const std::size_t> capture) {
  const auto told = sumInClusters(columns, error_mm, capture, 1);
  if (const auto* why = std::get_if<NoSum>(&told))
    return undetermined("lens scatter", wordsOf(*why, columns.size()));
  const auto& sum = std::get<ClusterSum>(told);
  const double half = studentT(sum.degrees) * sum.error;
  return std::vector{Trait{"veil", "1", sum.value, sum.value - half, sum.value + half, error_mm.size()}};
}

Traits veilByRows(const std::vector<std::vector<double>>& columns, Column error_mm) {
  const Model model = [&](std::span<const double> p, std::size_t i) {
    double e = 0.0;
    for (std::size_t c = 0; c < p.size(); ++c) e += p[c] * columns[c][i];
    return e;
  };
  const auto fit = fitInOrder(model, error_mm, std::vector<double>(columns.size(), 0.0));
  if (!fit) {
    return undetermined("lens scatter",
                        "the plate adds no light whose share could be told, or the frequencies are "
                        "too near each other");
  }
  return std::vector{fit->trait(
      "veil", "1", [](std::span<const double> p) { return std::accumulate(p.begin() + 1, p.end(), 0.0); })};
}

}  // namespace

std::vector<double> rangeWeights(std::span<const double> frequency_hz) {
  if (frequency_hz.size() == 1) return {1.0};
  std::vector<double> sorted(frequency_hz.begin(), frequency_hz.end());
  std::ranges::sort(sorted);
  const auto isAbout = [](double ratio, double whole) { return std::abs(ratio - whole) < 1e-3 * whole; };
  if (sorted.size() != 3 || !isAbout(sorted[1] / sorted[0], 5.0) || !isAbout(sorted[2] / sorted[0], 7.5))
    return {};
  std::vector<double> weights;
  for (const double f : frequency_hz) weights.push_back(f / (sorted[0] + sorted[1] + sorted[2]));
  return weights;
}

Traits veilTraits(std::span<const std::vector<double>> slopes_mm, Column error_mm,
                  std::span<const double> frequency_hz, std::span<const std::size_t> cluster) {
  if (frequency_hz.empty() || !(std::ranges::min(frequency_hz) > 0.0))
    return undetermined("lens scatter", "the frames say no modulation frequency");
  std::vector<std::vector<double>> slopes(slopes_mm.size());
  std::vector<double> errors;
  std::vector<std::size_t> captures;
  for (std::size_t i = 0; i < error_mm.size(); ++i) {
    const auto isTold = [i](const std::vector<double>& column) { return std::isfinite(column[i]); };
    if (!std::isfinite(error_mm[i]) || !std::ranges::all_of(slopes_mm, isTold)) continue;
    for (std::size_t f = 0; f < slopes.size(); ++f) slopes[f].push_back(slopes_mm[f][i]);
    errors.push_back(error_mm[i]), captures.push_back(cluster[i]);
  }
  if (errors.size() < 8) return undetermined("lens scatter", "fewer than eight of its rows are finite");
  const auto columns = columnsOf(slopes, frequency_hz);
  // Fewer than three captures do not tell how captures differ.
  const bool is_by_captures = std::set<std::size_t>(captures.begin(), captures.end()).size() >= 3;
  return is_by_captures ? veilByCaptures(columns, errors, captures) : veilByRows(columns, errors);
}

Traits veilTraits(Column own_range_m, Column plate_range_m, Column plate_over_own, Column error_mm,
                  std::span<const double> frequency_hz, std::span<const std::size_t> cluster) {
  const std::vector<double> numbers(cluster.begin(), cluster.end());
  const auto rows =
      finiteRows({own_range_m, plate_range_m, plate_over_own, error_mm, numbers}, 8, "lens scatter");
  if (!rows) return rows.error();
  std::vector<std::vector<double>> slopes;
  for (const double f : frequency_hz) slopes.push_back(slopesOf((*rows)[0], (*rows)[1], (*rows)[2], f));
  const std::vector<std::size_t> captures((*rows)[4].begin(), (*rows)[4].end());
  return veilTraits(slopes, (*rows)[3], frequency_hz, captures);
}

Traits veilTraits(Column own_range_m, Column plate_range_m, Column plate_over_own, Column error_mm,
                  std::span<const double> frequency_hz) {
  const std::vector<std::size_t> one_capture(own_range_m.size(), 0);
  return veilTraits(own_range_m, plate_range_m, plate_over_own, error_mm, frequency_hz, one_capture);
}

}  // namespace toftwin::compare
