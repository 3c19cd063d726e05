// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "calib/loop/score.h"
#include "calib/loop/shape_fit.h"

namespace toftwin::loop {

/// Another set of covariates that explains what an effect explains about as well.
struct Alternative {
  std::vector<std::string> covariates{};
  double correlation = 0.0;  ///< of both curves over the rows
};

/// Something that the response goes with.
struct Effect {
  Shape shape{};
  double p = 1.0;  ///< chance of seeing it without any effect
  HeldOut::Gain gain{};  ///< over the model without it, on rows it was not fitted to
  std::vector<Alternative> alternatives{};
  /// Coefficients of the shape's columns, and their covariance while its inner numbers are what they are (all of them: numbersOf()).
  Eigen::VectorXd coefficient{};
  Eigen::MatrixXd covariance{};
  int rests_on = 0;  ///< groups, where it changes only from one to the next: as many as its information is; 0: it changes within them
};

struct ExplainOptions {
  double alpha = 0.01;  ///< chance that something is found where there is nothing
  int draws = 400;
  std::uint64_t seed = 1;
  int most_effects = 6;
  bool is_robust = true;  ///< rows far from all others count less; not of a response that is yes or no
};

/// What a response goes with: effects in the order of what they explain, and what is left.
struct Explanation {
  std::vector<Effect> effects{};
  double p = 1.0;         ///< of the first test: that nothing at all is there
  double last_p = 1.0;    ///< of the last test: that nothing is left
  /// Where something stands out that no shape predicts on held-out rows: what it goes with.
  std::vector<Score> unexplained{};
  Eigen::VectorXd residual{};
  double scale = 1.0;     ///< deviation of what is left, in units of sigma
  Eigen::Index block_length = 1;
  double correlation = 0.0;  ///< of neighbouring rows of what is left beside a flexible model
};

/// Forward search within groups: screen all families, fit the shapes of the covariates that stand out, take the best on held-out
/// rows, choose all shapes anew beside it, drop what became useless, and again.
Explanation explain(Evidence& evidence, const ExplainOptions& options);

/// Coefficients and their covariance, of a fit over all effects' columns. `variance`: of the noise, in units of the fit's weights.
void takeNumbers(std::vector<Effect>& effects, const LeastSquares& fit, double variance);

/// The response less the effects.
Eigen::VectorXd lessEffects(const Evidence& evidence, const std::vector<Effect>& effects);

/// All effects' columns, in their order.
Eigen::MatrixXd columnsOf(const Evidence& evidence, const std::vector<Effect>& effects);

}  // namespace toftwin::loop
