// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "calib/compare/traits/traits.h"

namespace toftwin::compare {

/// Two numbers of a characteristic as they are to be held against each other: both at one distance, at one
/// signal, over one time.
struct HeldTogether {
  Trait difference{};     ///< second less first; of waves the amplitude of the difference, which has no sign
  bool is_size = false;   ///< it has no sign
  std::optional<OnLine> line{};  ///< of an offset: the difference of the two lines, over the distances that both have
  std::string at{};       ///< what both are told at, where that is another than their own: "at 1.75 m"
  std::string why_not{};  ///< why they cannot be held against each other; empty: they can
};

/// By what the numbers refer to (Trait::refers_to); where they refer to nothing, or to different things, as
/// they are. `wider` is differenceOf()'s.
HeldTogether heldTogether(const Trait& first, const Trait& second, double wider = 1.0);

/// The signal that a part of a noise law is told at; null: it is no such part.
const AtSignal* signalOf(const Trait& trait);
AtSignal* signalOf(Trait& trait);

/// "at 1.75 m"
std::string placeInWords(double at_m);

/// Whether a line that has this value at `line.at_m` is 0 at distance 0, by its interval there.
bool goesThroughNothing(double value, const OnLine& line, double wider = 1.0);

}  // namespace toftwin::compare
