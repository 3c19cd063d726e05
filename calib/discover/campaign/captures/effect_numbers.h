// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "calib/discover/campaign/captures/catalogue.h"

/// Numbers of effects: as they were fitted, and how they are changed for that.
namespace toftwin::discover {

/// A number of an effect, as it was found.
struct FittedNumber {
  std::string key{};
  double value = 0.0, error = 0.0;
};

/// An effect that goes into the model.
struct FittedEffect {
  sim::AnyEffect effect;
  std::vector<FittedNumber> numbers{};  ///< those that were fitted
  /// They are of single frames, which noise smears where frames are averaged: locked captures, means over
  /// frames, do not judge them.
  bool is_of_single_frames = false;
  /// A table that was learned, whose numbers are not fitted again.
  bool is_as_learned = false;
  /// Of an update: the place of what it replaces among the camera file's effects.
  std::optional<std::size_t> of_file{};
};

/// A number of an effect of a list that is fitted, and by how much it is changed for its derivative.
struct FreeNumber {
  std::size_t place = 0;  ///< of the effect
  std::string key{};
  double step = 0.0;
};

double valueOf(const sim::AnyEffect& effect, const std::string& key);
/// Whether a strength of the effect, one of these numbers, was fitted to a bound of it.
bool isAtBound(const sim::AnyEffect& effect, const std::vector<std::string>& keys);
/// Of several `strengths` among an effect's fitted numbers, the one that is fewest standard errors from nothing, and how
/// many; none where it has one alone, or none. Those that are `needed` count, but are not the one.
struct LeastStrength {
  std::string key{};
  double errors = 0.0;
};
std::optional<LeastStrength> leastStrength(const FittedEffect& fitted, const std::vector<std::string>& strengths,
                                           const std::vector<std::string>& needed = {});
/// With that number switched off.
sim::AnyEffect without(const sim::AnyEffect& effect, const std::string& key);
std::vector<sim::AnyEffect> moved(std::vector<sim::AnyEffect> effects, const FreeNumber& free,
                                  double by);
/// Whether any of the effects acts on light.
bool actsOnLight(const std::vector<sim::AnyEffect>& effects);
/// Numbers of the effects at these places that are not whole, with steps that suit them.
std::vector<FreeNumber> freeNumbersOf(const std::vector<sim::AnyEffect>& effects,
                                      const std::vector<std::size_t>& places);

}  // namespace toftwin::discover
