// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <any>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "calib/discover/cross_validation.h"
#include "calib/discover/term.h"

/// Effects that are known by name, each with its own numbers instead of free columns.
namespace toftwin::discover {

/// A number with its standard error.
struct Estimate {
  std::string name{};
  double value = 0.0, error = 0.0;
};

/// An effect of the catalogue as it fits the data best.
struct NamedFit {
  std::string name{};
  std::vector<Estimate> numbers{};  ///< those that the data need
  Gain gain{};                      ///< on held-out captures, beyond what is known
  bool is_at_bound = false;  ///< it would have to be stronger than it can be
  std::any effect{};         ///< as its source knows it
};

/// A source whose catalogue can be fitted as it is. The columns of Kind::Catalogue only say, to first order
/// and with more freedom than the effect has, which ones are worth it.
class NamedEffects {
 public:
  virtual ~NamedEffects() = default;
  /// Fits each of them on top of what the source includes and of `known`; one that cannot be fitted is left
  /// out.
  [[nodiscard]] virtual std::vector<NamedFit> fitNamed(std::span<const std::string> names,
                                                       std::span<const TermGroup> known,
                                                       std::span<const double> scales) const = 0;
  /// The source with these effects in its model and no others: residuals are what they leave, their numbers
  /// are nuisances, and they are no candidates any more. Without its catalogue it is for a look only: less work.
  [[nodiscard]] virtual std::shared_ptr<const RowSource> including(std::span<const NamedFit* const> fits,
                                                                   bool with_catalogue) const = 0;
};

}  // namespace toftwin::discover
