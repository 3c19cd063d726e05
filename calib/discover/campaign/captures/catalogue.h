// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "calib/discover/evidence.h"
#include "sim/effects/effects.h"

namespace toftwin::discover {

/// A number of an effect that can be changed, by its key in a camera file.
struct EffectNumber {
  std::string key{};
  double value = 0.0;
  double low = 0.0, high = 0.0;
  bool is_whole = false;
  bool is_label = false;  ///< of a device, without order: an unsigned whole number
};
std::vector<EffectNumber> numbersOf(const sim::AnyEffect& effect);
/// The same effect with one number changed; within its bounds, whole where it must be.
sim::AnyEffect withNumber(const sim::AnyEffect& effect, const std::string& key, double value);

/// The same kind of effect switched off, and with its defaults.
sim::AnyEffect noneOf(const sim::AnyEffect& effect);
sim::AnyEffect defaultsOf(const sim::AnyEffect& effect);

/// Whether it makes the effect strong: it differs between the effect's `none()` and its defaults.
bool isStrength(const sim::AnyEffect& effect, const std::string& key);

std::string nameOf(const sim::AnyEffect& effect);
Stage stageOf(const sim::AnyEffect& effect);
std::vector<std::string> covariatesOf(const sim::AnyEffect& effect);
/// Where light meets it: in the order of sim::AllEffects, what was learned at the end of its stage's imperfections.
std::size_t placeOf(const sim::AnyEffect& effect);

/// The list with one effect more, where light meets it, behind others of its kind.
std::vector<sim::AnyEffect> withInserted(std::vector<sim::AnyEffect> effects,
                                         const sim::AnyEffect& effect);

/// One way in which an effect can differ from not being there: from `off` to `on`.
struct Variation {
  sim::AnyEffect off, on;
  std::string key{};  ///< of the number that changes
  double step = 1.0;  ///< by how much it changes
  bool is_shape =
      false;  ///< a number that does nothing by itself was changed, such as a time constant
};

/// How much the camera's readings change between two effects, on some captures that stand for all:
/// root mean squares of range [mm] and of 100 ln amplitude, of which the larger counts. Infinite
/// where it cannot be told.
using Sensitivity = std::function<std::vector<float>(const Variation&)>;

/// An effect that may be missing, with the ways in which it can show: made from its `none()`, its
/// defaults and its `visit`, the same for every effect.
struct Candidate {
  sim::AnyEffect example;  ///< with its defaults
  std::vector<Variation> variations{};
  /// Numbers that do something by themselves: those that differ between `none()` and the defaults, and those that
  /// are the same in both and show when they alone are changed.
  std::vector<std::string> strengths{};
};

/// Whether a camera may have it several times, each at another place that a number of it names: a raw
/// exposure.
bool choosesAPlace(const sim::AnyEffect& effect);
/// That place: "step 1, tap 0"; empty where it names none.
std::string placeInWords(const sim::AnyEffect& effect);

/// All effects but noise, those that `probe` cannot see, and those that are declared; of one that chooses a
/// place, the places where none is declared stay. `probe` gives the changes of some pixels' readings in units
/// of about a millimetre.
std::vector<Candidate> candidatesOf(const Sensitivity& probe, const std::vector<sim::AnyEffect>& declared,
                                    const std::vector<std::string>& left_out);
/// The numbers of an effect that is there, each by a small step.
Candidate declaredCandidate(const sim::AnyEffect& effect, const Sensitivity& probe);

}  // namespace toftwin::discover
