// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "calib/discover/shape_choice.h"

namespace toftwin::discover {

/// What was found so far, and what a search knows with it.
struct Found {
  Context context{};
  std::vector<Effect> effects{};
};

/// Effects that were fitted as themselves are in the source's model from now on.
void include(Found& found);
std::vector<std::shared_ptr<const NamedFit>> fitsOf(const std::vector<Effect>& effects);
/// The source with some of those that are included.
std::shared_ptr<const RowSource> sourceOf(const Context& context,
                                          const std::vector<std::shared_ptr<const NamedFit>>& some);

/// A search that knows these effects, and the fitted ones of all that were found, which its source includes.
Context knowingOnly(const Found& found, const std::vector<Effect>& effects);

/// An effect's terms as they are written once they are known. What was estimated from all captures has had
/// its share of their noise, so that it competes no more.
void settle(Found& found, Effect& effect);

/// Place of the explanation that is taken: the catalogue's are fitted first.
std::optional<std::size_t> chosenOf(const Context& context, std::vector<Explanation>& explanations);

/// With the catalogue only where an effect of it was found that is not in the source.
Evidence evidenceOf(const Context& context, std::span<const TermGroup> extra);

/// What an effect explains of held-out captures beside all others.
Gain gainBeside(const Found& found, std::size_t which);

}  // namespace toftwin::discover
