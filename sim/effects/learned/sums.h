// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "sim/effects/effect.h"
#include "sim/terms/image_terms.h"
#include "sim/terms/term.h"

namespace toftwin::sim {

/// Learned terms of one quantity that the same carrier carries, ready for one image.
struct CarriedTerms {
  terms::Carrier carrier = terms::Carrier::One;
  std::vector<double> carried{};
  terms::ImageTerms sum;
};

/// One for each carrier (with its numbers) of the quantity's terms, in the order in which they come.
std::vector<CarriedTerms> carriedTermsOf(const std::vector<terms::Term>& all, terms::Quantity quantity, int width,
                                         int height, const Conditions& now);

/// The terms of a quantity that no carrier carries; nothing where there are none.
std::optional<terms::ImageTerms> plainTermsOf(const std::vector<terms::Term>& all, terms::Quantity quantity, int width,
                                              int height, const Conditions& now);

}  // namespace toftwin::sim
