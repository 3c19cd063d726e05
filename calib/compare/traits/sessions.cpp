// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/sessions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/clusters.h"
#include "calib/compare/traits/linearised.h"
#include "calib/compare/traits/odd_rows.h"
#include "calib/compare/traits/repeats.h"
#include "calib/compare/traits/uneven.h"
#include "calib/linear/linear.h"

namespace toftwin::compare {
namespace {

using Eigen::Index;
constexpr double kVeryStrong = 10.0;  // Kass and Raftery, J. Am. Stat. Assoc. 90 (1995) 773
constexpr Index kRowsPerParameter = 10;

constexpr Index kFewestOfSession = 5;

/// By how much a step before each row makes Σ r² less; 0 where one side has too few rows, or the model has such a step.
VectorXd gainsOfSteps(const MatrixXd& jacobian, const VectorXd& left) {
  const linear::Ldlt normal{jacobian.transpose() * jacobian};
  VectorXd of_later = VectorXd::Zero(jacobian.cols()), gains = VectorXd::Zero(left.size());
  double together = 0.0;
  for (Index i = left.size() - 1; i >= kFewestOfSession - 1; --i) {
    of_later += jacobian.row(i).transpose(), together += left[i];
    const double later = static_cast<double>(left.size() - i), own = later - of_later.dot(normal.solve(of_later));
    if (left.size() - i >= kFewestOfSession - 1 && own > 1e-6 * later) gains[i] = together * together / own;
  }
  return gains;
}

/// By how much neighbours go with each other.
double togetherOf(const VectorXd& left) {
  return left.head(left.size() - 1).dot(left.tail(left.size() - 1)) / left.squaredNorm();
}

/// 2 ln of how much likelier rows are with a step of such a gain than with errors that go on from row to row.
double saysOf(double gain, const MatrixXd& jacobian, const VectorXd& left) {
  const double squares = left.squaredNorm(), together = togetherOf(left);
  return static_cast<double>(left.size() - jacobian.cols()) *
         std::log(squares * (1.0 - together * together) / (squares - gain));
}

/// The same of the step before that row, without the row of the shorter side that is farthest off: a single one makes a
/// step of five.
double saysWithoutItsOddest(Index row, const MatrixXd& jacobian, const VectorXd& left) {
  const Index rows = left.size(), from = 2 * row < rows ? 0 : row, count = 2 * row < rows ? row : rows - row;
  Index odd = 0;
  left.segment(from, count).cwiseAbs().maxCoeff(&odd);
  odd += from;
  MatrixXd others(rows - 1, jacobian.cols());
  others << jacobian.topRows(odd), jacobian.bottomRows(rows - 1 - odd);
  VectorXd rest(rows - 1);
  rest << left.head(odd), left.tail(rows - 1 - odd);
  rest -= (others * linear::leastSquares(others, rest)).eval();
  return saysOf(gainsOfSteps(others, rest)[odd < row ? row - 1 : row], others, rest);
}

/// The row before which there is a step that says so much, also without one odd row.
std::optional<Index> stepOf(const MatrixXd& jacobian, const VectorXd& left, double least) {
  const VectorXd gains = gainsOfSteps(jacobian, left);
  Index row = 0;
  const double most = gains.segment(kFewestOfSession, left.size() - 2 * kFewestOfSession + 1).maxCoeff(&row);
  row += kFewestOfSession;
  if (!(saysOf(most, jacobian, left) > least) || !(saysWithoutItsOddest(row, jacobian, left) > least))
    return std::nullopt;
  return row;
}

/// −2 ln of the likelihood of numbers of two normal distributions with one σ, from halves on, less that of one
/// distribution. 0 where one of them is less than a tenth of all: those are odd rows, and no session.
double byTwoHeaps(const VectorXd& numbers) {
  constexpr int kRounds = 200;
  constexpr double kLeastShare = 0.1;
  const double n = static_cast<double>(numbers.size()), mean = numbers.mean(),
               variance = (numbers.array() - mean).square().mean();
  double low = mean - std::sqrt(variance), high = mean + std::sqrt(variance), share = 0.5, own = 0.5 * variance,
         log_likelihood = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    // Logarithms: a number may be so far off that both densities are 0.
    const Eigen::ArrayXd of_low = std::log(1.0 - share) - (numbers.array() - low).square() / (2.0 * own),
                         of_high = std::log(share) - (numbers.array() - high).square() / (2.0 * own),
                         most = of_low.max(of_high),
                         both = most + ((of_low - most).exp() + (of_high - most).exp()).log(),
                         are_high = (of_high - both).exp();
    log_likelihood = both.sum() - 0.5 * n * std::log(own);
    share = are_high.mean();
    if (share < kLeastShare || share > 1.0 - kLeastShare) return 0.0;
    high = (are_high * numbers.array()).sum() / (n * share);
    low = ((1.0 - are_high) * numbers.array()).sum() / (n * (1.0 - share));
    own = (are_high * (numbers.array() - high).square() + (1.0 - are_high) * (numbers.array() - low).square()).mean();
    if (!(own > 1e-9 * variance)) return 0.0;  // few values, each many times
  }
  return -2.0 * log_likelihood - n * (std::log(variance) + 1.0);
}

/// Why rows, in the order in which they stand, may be of two sessions, each with an offset of its own: neighbours err
/// oppositely, as where sessions take turns (3/√n); there is a step between two rows that says more (10 in BIC) than
/// errors that go on from row to row, and not of one row alone; or what is left of the fit lies in two heaps, by as
/// much. Empty: nothing says so, as where sessions are mixed and nearer to each other than some three σ of a row, or
/// there are fewer than ten rows for each parameter.
std::string doubtOfSessions(const MatrixXd& jacobian, const VectorXd& left) {
  constexpr double kOpposite = 3.0;
  constexpr const char* kSessions =
      "rows may be of two sessions, each with an offset of its own that no interval knows of";
  const Index rows = left.size();
  if (rows < kRowsPerParameter * jacobian.cols()) return {};
  const double n = static_cast<double>(rows), log_n = std::log(n), together = togetherOf(left);
  // Each parameter takes about 1/n of correlation away.
  if (together + static_cast<double>(jacobian.cols()) * (1.0 + together) / n < -kOpposite / std::sqrt(n))
    return fmt::format("neighbours err oppositely: {}", kSessions);
  // A step has a size and a place, and neighbours that go with each other have one number.
  if (const auto row = stepOf(jacobian, left, log_n + kVeryStrong))
    return fmt::format("there is a step before row {}: {}", *row + 1, kSessions);
  const VectorXd fresh = left.tail(rows - 1) - std::max(0.0, together) * left.head(rows - 1);
  if (byTwoHeaps(fresh) + 2.0 * log_n + kVeryStrong < 0.0)
    return fmt::format("what they are off lies in two heaps: {}", kSessions);
  return {};
}

/// Rows that scatter unevenly over their σ.
std::string doubtOf(const Fit& fit, const Model& model, Column y, Column x) {
  MatrixXd j = jacobian(model, y.size(), fit.at);
  VectorXd left = residuals(model, y, fit.at);
  const auto sigmas = unevenSigmas({left.data(), left.data() + left.size()}, x, fit.at.size());
  for (std::size_t i = 0; i < sigmas.size(); ++i) {
    const auto row = static_cast<Index>(i);
    j.row(row) /= sigmas[i], left[row] /= sigmas[i];
  }
  left -= (j * linear::leastSquares(j, left)).eval();  // as least squares leave them
  return doubtOfSessions(j, left);
}

/// The model with an offset of each session: all but the last's are parameters.
Model besideSessions(const Model& model, const SharedPlaces& sessions, std::size_t k) {
  return [&, k](std::span<const double> p, std::size_t i) {
    const auto offsets = p.subspan(k);
    const bool is_last = sessions.of[i] + 1 == sessions.count;
    return model(p.first(k), i) +
           (is_last ? -std::accumulate(offsets.begin(), offsets.end(), 0.0) : offsets[sessions.of[i]]);
  };
}

/// fitInClusters() of a model that may bend, by what it is straight where it ends.
std::optional<Fit> fitAtPlaces(const Model& model, Column y, std::vector<double> start,
                               std::span<const std::size_t> place) {
  constexpr int kRounds = 30;
  constexpr double kNear = 1e-3;  // of a standard error
  const auto first = fitLeastSquares(model, y, std::move(start));
  if (!first) return std::nullopt;
  std::vector<double> at = first->at;
  for (int round = 0; round < kRounds; ++round) {
    const MatrixXd j = jacobian(model, y.size(), at);
    const VectorXd left = residuals(model, y, at);
    if (!j.allFinite() || !left.allFinite()) return std::nullopt;
    std::vector<std::vector<double>> columns;
    for (const auto& column : j.colwise()) columns.emplace_back(column.begin(), column.end());
    auto fit = fitInClusters(columns, {left.data(), left.data() + left.size()}, place);
    if (!fit) return std::nullopt;
    bool is_settled = true;
    for (std::size_t k = 0; k < at.size(); ++k)
      is_settled = is_settled && std::abs(fit->at[k]) <= kNear * fit->error(k), at[k] += fit->at[k];
    fit->at = at;
    if (is_settled) return *std::move(fit);
  }
  return std::nullopt;
}

}  // namespace

Result<RowsOfSessions> finiteRowsOf(std::vector<Column> columns, Column session, std::size_t least,
                                    const char* of_what) {
  if (!session.empty()) columns.push_back(session);
  auto rows = finiteRows(columns, least, of_what);
  if (!rows) return rows.error();
  RowsOfSessions all{.columns = *std::move(rows)};
  if (session.empty()) return all;
  all.session = std::move(all.columns.back()), all.columns.pop_back();
  if (sharedPlacesOf(all.session).count < 2) all.session.clear();
  return all;
}

std::vector<std::vector<double>> offsetColumns(Column session) {
  const SharedPlaces sessions = sharedPlacesOf(session);
  std::vector<std::vector<double>> columns;
  for (std::size_t s = 0; s + 1 < sessions.count; ++s) {
    auto& column = columns.emplace_back();
    for (const std::size_t of : sessions.of) column.push_back(of == s ? 1.0 : of + 1 == sessions.count ? -1.0 : 0.0);
  }
  return columns;
}

void leaveOutOffsets(Fit& fit, std::size_t first) {
  const std::size_t all = fit.at.size(), sessions = all - first + 1;
  if (sessions < 2) return;
  std::vector<double> offsets(fit.at.begin() + static_cast<std::ptrdiff_t>(first), fit.at.end());
  offsets.push_back(-std::accumulate(offsets.begin(), offsets.end(), 0.0));
  const double sd = summarise(offsets).sd, wider = studentT(static_cast<double>(sessions - 1)) / studentT(fit.degrees),
               variance = wider * wider * sd * sd / static_cast<double>(sessions);
  const auto keep = [&](std::vector<double>& covariance) {
    std::vector<double> kept;
    for (std::size_t a = 0; a < first; ++a)
      for (std::size_t b = 0; b < first; ++b) kept.push_back(covariance[a * all + b] + (a + b == 0 ? variance : 0.0));
    covariance = std::move(kept);
  };
  keep(fit.covariance);
  for (Fit::Possible& one : fit.possible) keep(one.covariance), one.away.resize(first);
  fit.at.resize(first);
}

std::optional<Fit> startBesideSessions(const Model& model, Column y, std::vector<double> start, Column session) {
  const SharedPlaces sessions = sharedPlacesOf(session);
  if (sessions.count < 2) return fitLeastSquares(model, y, std::move(start));
  const std::size_t k = start.size();
  start.resize(k + sessions.count - 1, 0.0);
  return fitLeastSquares(besideSessions(model, sessions, k), y, std::move(start));
}

std::optional<Fit> fitBesideSessions(const Model& model, Column y, std::vector<double> start, Column x, Column session,
                                     std::span<const std::size_t> place) {
  const SharedPlaces sessions = sharedPlacesOf(session);
  // A row that is odd may look like much else, and is said before that.
  const auto doubtOdd = [&](Fit& fit, const Model& of) {
    OddRows odd = oddRowsOf(of, y, fit.at, x);
    if (!odd.doubt.empty()) fit.doubt = std::move(odd.doubt), fit.odd_rows = std::move(odd.rows);
  };
  if (sessions.count < 2) {
    auto fit = fitInOrder(model, y, std::move(start), x);
    const bool is_exact = fit && fit->possible.empty();  // or rows are too few to say how they err
    if (fit) doubtOdd(*fit, model);
    if (fit && fit->doubt.empty() && !is_exact) fit->doubt = doubtOf(*fit, model, y, x);
    return fit;
  }
  const std::size_t k = start.size();
  start.resize(k + sessions.count - 1, 0.0);
  const Model beside = besideSessions(model, sessions, k);
  auto fit = place.empty() ? fitInOrder(beside, y, std::move(start), x) : fitAtPlaces(beside, y, std::move(start), place);
  if (!fit) return fit;
  doubtOdd(*fit, beside);
  leaveOutOffsets(*fit, k);
  return fit;
}

}  // namespace toftwin::compare
