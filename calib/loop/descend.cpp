// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/descend.h"

#include <algorithm>
#include <string>
#include <utility>

namespace toftwin::loop {
namespace {

/// The middle between the values on both sides of a place.
double betweenRows(const Covariate& c, double place) {
  const auto above = std::ranges::lower_bound(c.sorted, place);
  if (above == c.sorted.begin() || above == c.sorted.end()) return place;
  return 0.5 * (*(above - 1) + *above);
}

/// A place where the shape jumps goes to where less is left, by steps that shrink to a row.
void moveJump(const Left& left, const Covariate& c, std::size_t which, Shape& shape, double& least) {
  for (double step = c.span() / 96.0; step > 0.25 * c.spacing && step > 1e-5 * c.span();) {
    bool has_moved = false;
    for (const double sign : {1.0, -1.0}) {
      Inner inner = shape.inner;
      inner[which] = betweenRows(c, inner[which] + sign * step);
      Shape other = moved(shape, left.evidence(), inner);
      const double now = left(other);
      if (now >= least) continue;
      least = now, shape = std::move(other), has_moved = true;
      break;
    }
    if (!has_moved) step *= 0.5;
  }
}

/// By how much an inner number is moved to see what that changes.
double differenceOf(char move, double value, const Covariate& c) { return move == 's' ? 1e-4 * value : 1e-4 * c.span(); }

/// One step of Gauss and Newton by all smooth inner numbers at once: the shape's derivatives are columns beside it, and their
/// coefficients say how far to go. Halved until less is left. False if none does.
bool stepSmooth(const Left& left, const Covariate& c, const std::string& moves, Shape& shape, double& least) {
  const Eigen::MatrixXd at = columnsOf(left.evidence(), shape.columns);
  const Eigen::VectorXd coefficient = left.coefficients(at);
  std::vector<std::size_t> which;
  Eigen::MatrixXd slopes(at.rows(), 0);
  for (std::size_t i = 0; i < moves.size(); ++i) {
    if (moves[i] != 's' && moves[i] != 'l') continue;
    Inner inner = shape.inner;
    const double difference = differenceOf(moves[i], inner[i], c);
    inner[i] += difference;
    const Eigen::MatrixXd beside = columnsOf(left.evidence(), moved(shape, left.evidence(), inner).columns);
    if (!beside.allFinite()) continue;
    slopes.conservativeResize(Eigen::NoChange, slopes.cols() + 1);
    slopes.col(slopes.cols() - 1) = (beside - at) * coefficient / difference;
    which.push_back(i);
  }
  if (which.empty()) return false;
  const Eigen::VectorXd step = left.coefficients(sideBySide(at, slopes)).tail(slopes.cols());
  for (double share = 1.0; share > 0.01; share *= 0.4) {
    Inner inner = shape.inner;
    for (std::size_t k = 0; k < which.size(); ++k) {
      const double to = share * step[static_cast<Eigen::Index>(k)];
      const std::size_t i = which[k];
      // What must stay positive goes by at most a third.
      inner[i] += moves[i] == 's' ? std::clamp(to, -0.33 * inner[i], 0.5 * inner[i]) : std::clamp(to, -0.2 * c.span(), 0.2 * c.span());
    }
    Shape other = moved(shape, left.evidence(), inner);
    const double now = left(other);
    if (!(now < least)) continue;
    const bool is_little = least - now < 1e-7 * least;
    least = now, shape = std::move(other);
    return !is_little;
  }
  return false;
}

}  // namespace

Shape descend(const Left& left, Shape shape) {
  constexpr int kSteps = 12;
  const std::string moves = shape.moves();
  const Covariate& c = *left.evidence().find(shape.covariates.front());
  double least = left(shape);
  for (int round = 0; round < 2; ++round) {
    for (std::size_t i = 0; i < moves.size(); ++i)
      if (moves[i] == 'b') moveJump(left, c, i, shape, least);
    for (int step = 0; step < kSteps && stepSmooth(left, c, moves, shape, least); ++step) {}
    if (moves.find('b') == std::string::npos) break;
  }
  return shape;
}

}  // namespace toftwin::loop
