// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/telling/numbers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include <boost/math/distributions/students_t.hpp>

#include "calib/loop/projection.h"

namespace toftwin::loop {
namespace {

/// What inner numbers are called, by what their first family is.
struct Named {
  std::string_view family;
  std::array<std::string_view, 2> inner;
};
constexpr std::array kNames{Named{"wave", {"wavelength", ""}}, Named{"decay", {"constant of the decay", ""}},
                            Named{"two decays", {"constant of the first decay", "constant of the second decay"}},
                            Named{"sigmoid", {"place", "width"}}, Named{"bump", {"place", "width"}}, Named{"hinge", {"place", ""}},
                            Named{"sawtooth", {"period", "place of a jump"}}};
std::string nameOf(const Family& family, std::size_t inner) {
  const std::string_view own = family.first ? std::string_view{family.first->name} : std::string_view{family.name};
  const auto row = std::ranges::find(kNames, own, &Named::family);
  return row == kNames.end() || inner >= 2 ? "inner number" : std::string{row->inner[inner]};
}
std::string nameOf(const Product& product) {
  const std::string text = terms::toText({.coefficient = 1.0, .factors = product});
  const std::size_t star = text.find(" * ");
  return star == std::string::npos ? "1" : text.substr(star + 3);
}

/// Columns of a fit and whose numbers they are.
struct Design {
  Eigen::MatrixXd columns;
  std::vector<std::pair<std::size_t, Number>> numbers{};  ///< the effect, and the number without its error
};

/// The effect's columns, and how its curve changes with each smooth inner number.
void add(const Evidence& e, const Effect& effect, std::size_t which, Design& design) {
  const Eigen::MatrixXd at = columnsOf(e, effect.shape.columns);
  design.columns = sideBySide(design.columns, at);
  for (std::size_t c = 0; c < effect.shape.columns.size(); ++c)
    design.numbers.push_back({which, {.name = nameOf(effect.shape.columns[c]), .is_coefficient = true, .value = effect.coefficient[static_cast<Eigen::Index>(c)]}});
  std::size_t number = 0;
  for (const Part& part : partsOf(effect.shape)) {
    for (std::size_t i = 0; i < part.inner.size(); ++i, ++number) {
      const char move = part.family->moves[i];
      if (move != 's' && move != 'l') continue;
      Inner inner = effect.shape.inner;
      const double step = move == 's' ? 1e-4 * inner[number] : 1e-4 * e.find(effect.shape.covariates.front())->span();
      inner[number] += step;
      const Eigen::MatrixXd beside = columnsOf(e, moved(effect.shape, e, inner).columns);
      if (!beside.allFinite() || step == 0.0) continue;
      design.columns = sideBySide(design.columns, (beside - at) * effect.coefficient / step);
      design.numbers.push_back({which, {.name = nameOf(*part.family, i), .value = effect.shape.inner[number]}});
    }
  }
}

/// Covariance of the numbers where rows of a block err alike: G⁺ (Σ s sᵀ) G⁺ with the scores s of the blocks, and for how many numbers
/// were fitted to them.
Eigen::MatrixXd byBlocks(const Evidence& e, const Eigen::VectorXd& weight, const Eigen::MatrixXd& x, const LeastSquares& fit, Eigen::Index length) {
  const Projection offsets{e, weight, Eigen::MatrixXd(x.rows(), 0)};
  const Eigen::MatrixXd scaled = offsets(x);
  const Eigen::VectorXd left = fit.residual.cwiseProduct(weight.cwiseSqrt());
  Eigen::MatrixXd middle = Eigen::MatrixXd::Zero(x.cols(), x.cols());
  double blocks = 0.0;
  for (Eigen::Index from = 0; from < x.rows(); from += length, blocks += 1.0) {
    const Eigen::Index count = std::min(length, x.rows() - from);
    const Eigen::VectorXd score = scaled.middleRows(from, count).transpose() * left.segment(from, count);
    middle += score * score.transpose();
  }
  return blocks / std::max(1.0, blocks - static_cast<double>(x.cols())) * (fit.covariance * middle * fit.covariance);
}

}  // namespace

double Number::half() const {
  if (!(freedom >= 1.0)) return INFINITY;
  return error * boost::math::quantile(boost::math::complement(boost::math::students_t{freedom}, 0.025));
}

std::vector<std::vector<Number>> numbersOf(const Evidence& e, const std::vector<Effect>& effects, Eigen::Index length) {
  std::vector<std::vector<Number>> all(effects.size());
  Design design{.columns = Eigen::MatrixXd(e.rows(), 0)};
  for (std::size_t i = 0; i < effects.size(); ++i) {
    if (effects[i].rests_on == 0) {
      add(e, effects[i], i, design);
      continue;
    }
    const auto k = static_cast<Eigen::Index>(effects[i].shape.columns.size());
    for (Eigen::Index c = 0; c < k; ++c)
      all[i].push_back({.name = nameOf(effects[i].shape.columns[static_cast<std::size_t>(c)]), .is_coefficient = true, .value = effects[i].coefficient[c],
                        .error = std::sqrt(effects[i].covariance(c, c)), .freedom = static_cast<double>(effects[i].rests_on - 1 - k)});
  }
  if (design.numbers.empty()) return all;
  Evidence beside = e;
  for (std::size_t i = 0; i < effects.size(); ++i)
    if (effects[i].rests_on > 0) beside.y -= columnsOf(e, effects[i].shape.columns) * effects[i].coefficient;
  const Eigen::VectorXd weight = robustWeights(robustLeastSquares(beside, beside.y, design.columns).residual, e.sigma);
  const LeastSquares fit = leastSquares(beside, beside.y, weight, design.columns);
  const double freedom = std::max(1.0, static_cast<double>(e.rows() - design.columns.cols() - e.groups()));
  const double variance = (fit.residual.array().square() * weight.array()).sum() / freedom;
  const Eigen::MatrixXd covariance = length > 1 ? byBlocks(beside, weight, design.columns, fit, length) : (variance * fit.covariance).eval();
  for (std::size_t n = 0; n < design.numbers.size(); ++n) {
    auto& [which, number] = design.numbers[n];
    number.error = std::sqrt(std::max(0.0, covariance(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n))));
    number.freedom = std::max(1.0, freedom / static_cast<double>(std::max<Eigen::Index>(1, length)));
    all[which].push_back(std::move(number));
  }
  return all;
}

}  // namespace toftwin::loop
