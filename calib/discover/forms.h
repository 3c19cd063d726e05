// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/discover/marginal.h"
#include "calib/discover/term.h"

/// Short formulas that a term could be, and their inner numbers.
namespace toftwin::discover {

/// A number inside a formula, such as a time constant, and where it is looked for.
struct Inner {
  std::vector<double> grid{};
  bool is_ratio = false;  ///< its grid is geometric
  int price = 1;          ///< what having searched for it costs, in units of deviance, beside its column
};

/// A family of formulas with the same inner numbers to be found.
struct Form {
  std::string name{};  ///< "exponential in time_s"
  std::vector<std::string> covariates{};
  std::vector<Inner> inner{};
  TermGroup (*build)(const Form& form, std::span<const double> inner) = nullptr;
  std::vector<double> fixed{};  ///< what build needs besides: powers, origins
  std::vector<CovariateInfo> of{};
  std::optional<Stage> stage{};  ///< where its terms act; none: where its covariates say
  std::string carrier{};         ///< what its terms are multiplied with (see Term)
  std::optional<Factor> times{};  ///< all of its terms are multiplied with that, too
  bool keeps_own = false;         ///< and stand there without it as well
};
TermGroup built(const Form& form, std::span<const double> inner);

/// All formulas of one covariate, or of two: powers, logarithm, exponential, sine, step, hinge, harmonics of
/// the modulation's period, tan² and 1/cos of an angle, and products of two of them.
std::vector<Form> formsIn(const CovariateInfo& covariate);
std::vector<Form> formsIn(const CovariateInfo& a, const CovariateInfo& b);

/// A form whose inner numbers were found.
struct FittedForm {
  Form form{};
  std::vector<double> inner{};
  TermGroup group{};
  double statistic = 0.0;  ///< what it explains of the data that it was found in
};

/// The same whose strength goes with another covariate: multiplied with one of its powers or its logarithm, and, as that
/// zero may not be nothing's, with itself added. A smooth curve: the latter alone, straight.
std::vector<FittedForm> crossedWith(const FittedForm& one, const CovariateInfo& other);

/// The inner numbers that explain most on top of `known` (in the model) — the grid, and then ever finer ones
/// around the best. All forms are searched in the same few passes over the data.
std::vector<FittedForm> findInnerNumbers(const RowSource& source, std::span<const TermGroup> known,
                                         std::span<const double> scales, std::vector<Form> forms);

}  // namespace toftwin::discover
