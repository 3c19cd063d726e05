// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/sessions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/linearised.h"
#include "calib/compare/traits/repeats.h"
#include "calib/compare/traits/uneven.h"
#include "calib/linear/linear.h"

namespace toftwin::compare {
namespace {

using Eigen::Index;
constexpr double kVeryStrong = 10.0;  // Kass and Raftery, J. Am. Stat. Assoc. 90 (1995) 773
constexpr Index kRowsPerParameter = 10;

/// By how much a step before the best of rows makes Σ r² less, and which that is.
struct BestStep {
  double gain = 0.0;
  Index row = 0;

  BestStep(const MatrixXd& jacobian, const VectorXd& left) {
    constexpr Index kFewestOfSession = 5;
    const linear::Ldlt normal{jacobian.transpose() * jacobian};
    VectorXd of_later = VectorXd::Zero(jacobian.cols());
    double together = 0.0;
    for (Index i = left.size() - 1; i >= kFewestOfSession; --i) {
      of_later += jacobian.row(i).transpose(), together += left[i];
      const double later = static_cast<double>(left.size() - i), own = later - of_later.dot(normal.solve(of_later));
      if (left.size() - i < kFewestOfSession || !(own > 1e-6 * later)) continue;
      if (const double one = together * together / own; one > gain) gain = one, row = i;
    }
  }
};

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
                         most = of_low.max(of_high), both = most + ((of_low - most).exp() + (of_high - most).exp()).log(),
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
/// errors that go on from row to row; or what is left of the fit lies in two heaps, by as much. Empty: nothing says so, as
/// where sessions are mixed and nearer to each other than some three σ of a row, or there are fewer than ten rows for each
/// parameter.
std::string doubtOfSessions(const MatrixXd& jacobian, const VectorXd& left) {
  constexpr double kOpposite = 3.0;
  constexpr const char* kSessions = "rows may be of two sessions, each with an offset of its own that no interval knows of";
  const Index rows = left.size();
  if (rows < kRowsPerParameter * jacobian.cols()) return {};
  const double n = static_cast<double>(rows), log_n = std::log(n), squares = left.squaredNorm(),
               together = left.head(rows - 1).dot(left.tail(rows - 1)) / squares;
  // Each parameter takes about 1/n of correlation away.
  if (together + static_cast<double>(jacobian.cols()) * (1.0 + together) / n < -kOpposite / std::sqrt(n))
    return fmt::format("neighbours err oppositely: {}", kSessions);
  // A step has a size and a place, and neighbours that go with each other have one number.
  const BestStep step{jacobian, left};
  const double gains = (n - static_cast<double>(jacobian.cols())) *
                       std::log(squares * (1.0 - together * together) / (squares - step.gain));
  if (gains > log_n + kVeryStrong) return fmt::format("there is a step before row {}: {}", step.row + 1, kSessions);
  const VectorXd fresh = left.tail(rows - 1) - std::max(0.0, together) * left.head(rows - 1);
  if (byTwoHeaps(fresh) + 2.0 * log_n + kVeryStrong < 0.0)
    return fmt::format("what they are off lies in two heaps: {}", kSessions);
  return {};
}

/// A fit of `k` parameters and of so many offsets, of which the last is what makes their sum 0: without these, and with
/// what they scatter by in the first parameter.
Fit withoutOffsets(Fit fit, std::size_t k) {
  const std::size_t all = fit.at.size(), sessions = all - k + 1;
  std::vector<double> offsets(fit.at.begin() + static_cast<std::ptrdiff_t>(k), fit.at.end());
  offsets.push_back(-std::accumulate(offsets.begin(), offsets.end(), 0.0));
  const double sd = summarise(offsets).sd, wider = studentT(static_cast<double>(sessions - 1)) / studentT(fit.degrees),
               variance = wider * wider * sd * sd / static_cast<double>(sessions);
  const auto keep = [&](std::vector<double>& covariance) {
    std::vector<double> kept;
    for (std::size_t a = 0; a < k; ++a)
      for (std::size_t b = 0; b < k; ++b) kept.push_back(covariance[a * all + b] + (a + b == 0 ? variance : 0.0));
    covariance = std::move(kept);
  };
  keep(fit.covariance);
  for (Fit::Possible& one : fit.possible) keep(one.covariance), one.away.resize(k);
  fit.at.resize(k);
  return fit;
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

}  // namespace

std::optional<Fit> fitBesideSessions(const Model& model, Column y, std::vector<double> start, Column x, Column session) {
  const SharedPlaces sessions = sharedPlacesOf(session);
  if (sessions.count < 2) {
    auto fit = fitInOrder(model, y, std::move(start), x);
    const bool is_exact = fit && fit->possible.empty();  // or rows are too few to say how they err
    if (fit && fit->doubt.empty() && !is_exact) fit->doubt = doubtOf(*fit, model, y, x);
    return fit;
  }
  const std::size_t k = start.size(), last = sessions.count - 1;
  const Model beside = [&, k](std::span<const double> p, std::size_t i) {
    const auto offsets = p.subspan(k);
    const double offset = sessions.of[i] < last ? offsets[sessions.of[i]] : -std::accumulate(offsets.begin(), offsets.end(), 0.0);
    return model(p.first(k), i) + offset;
  };
  start.resize(k + last, 0.0);
  auto fit = fitInOrder(beside, y, std::move(start), x);
  if (!fit) return fit;
  return withoutOffsets(*std::move(fit), k);
}

}  // namespace toftwin::compare
