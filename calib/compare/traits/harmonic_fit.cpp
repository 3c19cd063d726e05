// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/harmonic_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/clusters.h"
#include "calib/compare/traits/odd_rows.h"
#include "calib/compare/traits/phasor.h"
#include "calib/compare/traits/repeats.h"
#include "calib/compare/traits/sessions.h"
#include "calib/compare/traits/waves.h"

namespace toftwin::compare {
namespace {

/// Of two parameters from `first` on: the delta method far from 0, amplitudeOf() near it, as if both parts had one
/// error: that of the mean of their variances, or along the wave's own phase where it is larger. Over part of a
/// period, or where rows scatter unevenly, the two differ.
Trait amplitudeTrait(const Fit& fit, const std::string& name, std::size_t first) {
  const double a = fit.at[first], b = fit.at[first + 1], size = std::hypot(a, b);
  const std::array along{size > 0.0 ? a / size : 1.0, size > 0.0 ? b / size : 0.0};
  const double mean = 0.5 * (std::pow(fit.error(first), 2) + std::pow(fit.error(first + 1), 2));
  const double sigma = std::sqrt(std::max(mean, fit.varianceOf(along, first)));
  const WaveParts phasor{fit.at[first], fit.at[first + 1], sigma, fit.degrees};
  Trait trait = fit.trait(name, "mm",
                          [first](std::span<const double> p) { return std::hypot(p[first], p[first + 1]); });
  if (isNearNothing(phasor)) {
    const Trait near = amplitudeOf(phasor);
    trait.low = near.low, trait.high = near.high;
  }
  trait.refers_to = phasor;
  return trait;
}

OnLine lineOf(const Fit& fit, Column distance_m, double at_m) {
  std::vector<double> value(fit.at.size(), 0.0), slope = value, both = value;
  value[0] = both[0] = 1.0, value[1] = at_m, slope[1] = 1.0, both[1] = at_m + 1.0;
  const double of_value = fit.varianceAlong(value), of_slope = fit.varianceAlong(slope);
  const auto [nearest, farthest] = std::ranges::minmax(distance_m);
  return {.at_m = at_m,
          .from_m = nearest,
          .to_m = farthest,
          .slope = fit.at[1],
          .variance = of_value,
          .slope_variance = of_slope,
          .covariance = 0.5 * (fit.varianceAlong(both) - of_value - of_slope),
          .degrees = fit.degrees};
}

/// Waves, what is left of a line c + s d at the rows' mean distance and its slope, and what no wave explains.
std::vector<Trait> traitsOf(const Fit& fit, double square_degrees, const std::vector<Wave>& waves,
                            Column distance_m) {
  std::vector<Trait> traits;
  for (std::size_t w = 0; w < waves.size(); ++w) {
    traits.push_back(amplitudeTrait(fit, waves[w].name, 2 + 2 * w));
  }
  // Not c: nobody measured at distance 0, and c is the less certain the farther the rows are from it.
  const double mean_m = summarise(distance_m).mean;
  traits.push_back(
      fit.trait("offset", "mm", [mean_m](std::span<const double> p) { return p[0] + p[1] * mean_m; }));
  traits.back().refers_to = lineOf(fit, distance_m, mean_m);
  traits.push_back(fit.trait("scale", "mm/m", 1));
  const double sd = std::sqrt(fit.squares / fit.free), half = 1.96 / std::sqrt(2.0 * square_degrees);
  traits.push_back({.name = "residual",
                    .unit = "mm",
                    .value = sd,
                    .low = sd * std::exp(-half),
                    .high = sd * std::exp(half),
                    .n = fit.n,
                    .doubt = fit.doubt,
                    .odd_rows = fit.odd_rows});
  return traits;
}

/// c + s d + Σ a cos + b sin, for a distance in metres.
double seriesAt(std::span<const double> p, const std::vector<Wave>& waves, double d) {
  double sum = p[0] + p[1] * d;
  for (std::size_t w = 0; w < waves.size(); ++w)
    sum += p[2 + 2 * w] * std::cos(waves[w].per_m * d) + p[3 + 2 * w] * std::sin(waves[w].per_m * d);
  return sum;
}

/// `square_degrees`: by which the rows' scatter is known.
FittedTraits fittedOf(const Fit& fit, double square_degrees, const std::vector<Wave>& waves,
                      Column distance_m) {
  return {.traits = traitsOf(fit, square_degrees, waves, distance_m),
          .curve = {waves.size() == 1 ? "a line and one wave" : fmt::format("a line and {} waves", waves.size()),
                    [=, p = fit.at](double d) { return seriesAt(p, waves, d); }},
          .together = wavesTogether(fit, 2, waves, distance_m),
          .bic = fit.bic()};
}

/// Rows by themselves.
Result<FittedTraits> fitRows(Column distance_m, Column error_mm, Column session, const std::vector<Wave>& waves) {
  const auto rows = finiteRowsOf({distance_m, error_mm}, session, 2 * waves.size() + 4, "harmonics");
  if (!rows) return rows.error();
  const auto &d = rows->columns[0], &e = rows->columns[1];
  const std::size_t count = 2 + 2 * waves.size();
  std::vector<double> basis;  // of all rows: a fit asks for each some thousand times
  for (const double one : d) {
    basis.insert(basis.end(), {1.0, one});
    for (const Wave& wave : waves)
      basis.insert(basis.end(), {std::cos(wave.per_m * one), std::sin(wave.per_m * one)});
  }
  const Model model = [&](std::span<const double> p, std::size_t i) {
    return std::inner_product(p.begin(), p.end(), basis.begin() + static_cast<std::ptrdiff_t>(i * count), 0.0);
  };
  const auto fit = fitBesideSessions(model, e, std::vector<double>(count, 0.0), d, rows->session);
  if (!fit)
    return undetermined("harmonics", "the distances span too little of a period, or two orders coincide");
  return fittedOf(*fit, fit->degreesOfRow(), waves, d);
}

/// How far to the side of a wall each row is, u, and its capture's nearest row, d₀. What a camera errs by its
/// place in the image (a veil, the light's reach) would else be told as a slope over distance: within a
/// capture both go alike.
struct Sideways {
  std::vector<double> u{}, nearest_m{};
  static constexpr std::size_t kColumns = 4;

  Sideways(Column distance_m, std::span<const std::size_t> cluster) {
    std::map<std::size_t, double> nearest;
    for (std::size_t i = 0; i < distance_m.size(); ++i) {
      const double d = distance_m[i];
      if (const auto [at, is_new] = nearest.try_emplace(cluster[i], d); !is_new)
        at->second = std::fmin(at->second, d);
    }
    for (std::size_t i = 0; i < distance_m.size(); ++i) {
      nearest_m.push_back(nearest[cluster[i]]);
      u.push_back(distance_m[i] / nearest_m.back() - 1.0);
    }
  }
  /// Less tells no slope of its own.
  [[nodiscard]] bool isWide() const {
    return std::ranges::any_of(u, [](double one) { return one >= 0.05; });
  }
  [[nodiscard]] std::array<double, kColumns> at(std::size_t i) const {
    return {u[i], u[i] * u[i], nearest_m[i] * u[i], nearest_m[i] * u[i] * u[i]};
  }
};

/// How clusters differ is not known of two of them, whatever many rows each has; nor where what they tell of the
/// numbers themselves leaves two degrees of freedom or less: Student's distribution has no variance then.
void doubtFewClusters(std::size_t count, const ClusterFit& fit, const char* what,
                      std::vector<Trait>& traits) {
  std::string why;
  if (count < 3)
    why = fmt::format("it is from {} {} only, and it takes three", count, what);
  else if (fit.degrees <= 2.0)
    why = fmt::format("it is by how {} {} differ, which are too few to say how uncertain that is", count, what);
  for (Trait& one : traits) one.doubt = why;
}

/// Rows that are finite, in their clusters.
struct ClusterRows {
  std::vector<double> distance_m{}, error_mm{};
  std::vector<std::size_t> cluster{};
  std::vector<double> session{};
  RowErrors errors{};
  std::size_t clusters = 0;
};

Result<ClusterRows> clusterRowsOf(Column distance_m, Column error_mm, const RowClusters& clusters,
                                 std::size_t least) {
  const auto orAll = [&](std::span<const double> column, double value) {
    return column.empty() ? std::vector<double>(distance_m.size(), value)
                          : std::vector<double>(column.begin(), column.end());
  };
  const std::vector<double> numbers(clusters.of.begin(), clusters.of.end());
  const auto pixels = orAll(clusters.pixels, 1.0), shared_mm = orAll(clusters.shared_mm, 0.0),
             session = orAll(clusters.session, 0.0);
  auto rows = finiteRows({distance_m, error_mm, numbers, pixels, shared_mm, session}, least, "harmonics");
  if (!rows) return rows.error();
  const auto logOf = [](std::vector<double> column) {
    for (double& one : column) one = std::log(std::max(1e-3, one));
    return column;
  };
  ClusterRows all{.cluster = {(*rows)[2].begin(), (*rows)[2].end()},
                  .session = std::move((*rows)[5]),
                  .errors = {.powers_of = {logOf((*rows)[0]), logOf((*rows)[3])}, .shared = (*rows)[4]}};
  all.distance_m = std::move((*rows)[0]), all.error_mm = std::move((*rows)[1]);
  all.clusters = std::set<std::size_t>{all.cluster.begin(), all.cluster.end()}.size();
  return all;
}

/// A column for each cluster: its rows' distances less their mean, 0 elsewhere.
std::vector<std::vector<double>> slopesOfEach(const ClusterRows& rows) {
  std::map<std::size_t, Running> means;
  for (std::size_t i = 0; i < rows.cluster.size(); ++i) means[rows.cluster[i]].add(rows.distance_m[i]);
  std::vector<std::vector<double>> columns;
  for (const auto& [number, mean] : means) {
    if (mean.n() < 2) continue;
    auto& column = columns.emplace_back(rows.cluster.size(), 0.0);
    for (std::size_t i = 0; i < column.size(); ++i) {
      if (rows.cluster[i] == number) column[i] = rows.distance_m[i] - mean.mean();
    }
  }
  return columns;
}

/// RowClusters::what of rows that share a distance.
constexpr const char* kSharedPlaces = "distances";

/// Of rows that share a distance, what they share is part of what no wave explains.
void addWhatIsShared(ClusterFit& fit) {
  const double own = fit.squares / fit.free, both = own + fit.of_cluster;
  fit.square_degrees = both * both / (own * own / fit.square_degrees +
                                      fit.of_cluster * fit.of_cluster / std::max(1.0, fit.degrees));
  fit.squares = both * fit.free;
}

MatrixXd matrixOf(const std::vector<std::vector<double>>& columns) {
  MatrixXd all(columns.front().size(), columns.size());
  for (std::size_t k = 0; k < columns.size(); ++k)
    all.col(static_cast<Eigen::Index>(k)) = Eigen::Map<const VectorXd>(columns[k].data(), all.rows());
  return all;
}

VectorXd leftBy(const Fit& fit, const std::vector<std::vector<double>>& columns, const std::vector<double>& y) {
  const auto mapped = [](const std::vector<double>& of) {
    return Eigen::Map<const VectorXd>(of.data(), static_cast<Eigen::Index>(of.size()));
  };
  return mapped(y) - matrixOf(columns) * mapped(fit.at);
}

/// A pose's turn makes a slope within a cluster, which is in the fit, and a bend, which is not: it passes for waves. One
/// of less than what the poses are known to may be no camera's.
void doubtWhatTurnsBend(std::span<const double> shared_mm, FittedTraits& fitted) {
  double squares = 0.0;
  for (const double one : shared_mm) squares += one * one;
  if (!(squares > 0.0)) return;
  const double known_mm = std::sqrt(squares / static_cast<double>(shared_mm.size()));
  const auto doubt = [known_mm](Trait& one) {
    if (one.value < known_mm && one.doubt.empty())
      one.doubt = fmt::format(
          "poses were seen, and known to {:.2g} mm at the wall (one standard error): their turns bend the rows of each "
          "capture, and so small a wave may be that",
          known_mm);
  };
  constexpr auto kNoWaves = 3;  // offset, scale, residual
  for (auto one = fitted.traits.begin(); one != fitted.traits.end() - kNoWaves; ++one) doubt(*one);
  if (fitted.together) doubt(*fitted.together);
}

/// Rows in clusters that share an error.
Result<FittedTraits> fitClusters(Column distance_m, Column error_mm, const std::vector<Wave>& waves,
                                 const RowClusters& clusters) {
  const auto rows = clusterRowsOf(distance_m, error_mm, clusters, 2 * waves.size() + 4);
  if (!rows) return rows.error();
  const auto& d = rows->distance_m;
  std::vector<std::vector<double>> columns{std::vector<double>(d.size(), 1.0), d};
  for (const Wave& wave : waves) {
    std::vector<double> even, odd;
    for (const double one : d)
      even.push_back(std::cos(wave.per_m * one)), odd.push_back(std::sin(wave.per_m * one));
    columns.push_back(std::move(even)), columns.push_back(std::move(odd));
  }
  const Sideways sideways{d, rows->cluster};
  const std::size_t first = columns.size();
  const bool is_sideways = sideways.isWide() && !clusters.are_turned;
  if (clusters.are_turned) {  // what goes sideways goes nearly straight within a cluster, too
    for (auto& column : slopesOfEach(*rows)) columns.push_back(std::move(column));
  }
  if (is_sideways) {
    columns.resize(first + Sideways::kColumns, std::vector<double>(d.size()));
    for (std::size_t i = 0; i < d.size(); ++i) {
      for (std::size_t k = 0; k < Sideways::kColumns; ++k) columns[first + k][i] = sideways.at(i)[k];
    }
  }
  const std::size_t without_offsets = columns.size();
  for (auto& column : offsetColumns(rows->session)) columns.push_back(std::move(column));
  auto fit = fitInClusters(columns, rows->error_mm, rows->cluster, rows->errors);
  if (!fit)
    return undetermined(
        "harmonics",
        fmt::format("the distances span too little of a period, or are of few {} only", clusters.what)
            .c_str());
  const bool are_places = clusters.what == kSharedPlaces;
  const OddRows odd =
      are_places ? oddRowsOf(matrixOf(columns), leftBy(*fit, columns, rows->error_mm), d) : OddRows{};
  leaveOutOffsets(*fit, without_offsets);
  if (are_places) addWhatIsShared(*fit);
  FittedTraits fitted = fittedOf(*fit, fit->square_degrees, waves, d);
  doubtFewClusters(rows->clusters, *fit, clusters.what, fitted.traits);
  for (Trait& one : fitted.traits)
    if (!odd.doubt.empty()) one.doubt = odd.doubt, one.odd_rows = odd.rows;
  if (clusters.are_turned) {
    fitted.curve = {};  // it says nothing of the rows as they are
    fitted.traits.back().doubt = "the poses' turns and the board itself bend the rows of each capture, too";
    doubtWhatTurnsBend(clusters.shared_mm, fitted);
  }
  if (!is_sideways) return fitted;
  const Sideways of_all{distance_m, clusters.of};
  double variance = 0.0;  // of what goes sideways, over the rows
  for (std::size_t i = 0; i < distance_m.size(); ++i) {
    const auto at = of_all.at(i);
    fitted.besides.push_back(
        std::inner_product(at.begin(), at.end(), fit->at.begin() + static_cast<long>(first), 0.0));
    variance += fit->varianceOf(at, first) / static_cast<double>(distance_m.size());
  }
  // Two distances do not tell it from the slope: rows less a guess would show what nobody measured.
  if (!(variance <= fit->squares / static_cast<double>(fit->n))) fitted.besides.clear(), fitted.curve = {};
  return fitted;
}

}  // namespace

Result<FittedTraits> fitHarmonics(Column distance_m, Column error_mm, std::span<const double> frequency_hz,
                                  std::span<const int> orders, const RowClusters& clusters) {
  const std::vector<Wave> waves = wavesOf(frequency_hz, orders);
  if (waves.empty()) return undetermined("harmonics", "no frequency or order was given");
  if (!clusters.of.empty()) return fitClusters(distance_m, error_mm, waves, clusters);
  const SharedPlaces places = sharedPlacesOf(distance_m);
  if (!places.areShared()) return fitRows(distance_m, error_mm, clusters.session, waves);
  return fitClusters(distance_m, error_mm, waves,
                     {.of = places.of, .what = kSharedPlaces, .session = clusters.session});
}

}  // namespace toftwin::compare
