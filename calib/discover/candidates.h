// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "calib/discover/term.h"

/// What an effect without a name could look like, before it is known.
namespace toftwin::discover {

struct CandidateOptions {
  std::size_t captures = 100;   ///< that the columns are to be fitted to: few captures, few columns
  /// Of covariates that act together: those of which one is of the capture, and all.
  std::size_t most_state_pairs = 28, most_pairs = 36;
  /// A plane with a twist for each pair, which few captures can show, too: a·b, a and b.
  bool has_straight_pairs = false;
};

/// Whether nothing is looked for that acts together with it, nor waves along it.
bool isByItself(const CovariateInfo& covariate);

/// For each covariate: a smooth function of it; waves of 1 to 20 periods over its spread; for a count of
/// frames, even and odd. For each pair: a smooth surface.
std::vector<TermGroup> genericCandidates(std::span<const CovariateInfo> covariates,
                                         const CandidateOptions& options);

/// A smooth function: hats between `knots` quantiles, without the first, whose place an offset takes. Levels:
/// one hat for each; rates: straight, whatever the knots.
TermGroup smoothIn(const CovariateInfo& covariate, std::size_t knots);
/// A surface over two covariates.
TermGroup smoothIn(const CovariateInfo& a, const CovariateInfo& b, std::size_t knots);

/// The group's name for people: "a smooth function of time_s".
inline constexpr std::size_t kSmoothKnots = 9;
inline constexpr std::size_t kSurfaceKnots = 4;

/// Terms that span the same functions as a product of all terms of both groups.
std::vector<Term> products(const std::vector<Term>& a, const std::vector<Term>& b);

}  // namespace toftwin::discover
