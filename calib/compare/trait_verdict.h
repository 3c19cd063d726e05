// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/compare/named_traits.h"

namespace toftwin::compare {

/// One number of two cameras: how far B is from A, against what the data could tell.
struct TraitVerdict {
  std::string what{};
  std::optional<NamedTrait> a{}, b{};  ///< none where B − A was told directly
  /// B − A. The intervals of all verdicts hold together with 95 %; an end may be NaN: not known.
  Trait difference{};
  bool is_paired = false;  ///< B − A was told row by row of what A and B were told of, too
  bool is_size = false;    ///< the difference is the amplitude of a wave, which has no sign
  std::optional<OnLine> line{};  ///< of an offset and of the scale beside it: the line that both are of
  double on_line_mm = 0.0;       ///< what it is off by where it is told
  bool has_scale = false;        ///< of an offset: the scale of its line differs, too
  bool is_of_scale = false;      ///< a scale alone may make all of the line: it goes through 0 at distance 0
  std::string at{};        ///< what both are told at, where a number hangs on it: "at 1.75 m"
  std::string why_not{};   ///< why the two cannot be held against each other
  /// Of valid pixels: the share of A's that B lacks, and of B's that A lacks. Two cameras that lack as many
  /// of each other's differ in no share.
  Trait lacked_by_b{}, lacked_by_a{};

  [[nodiscard]] bool isTold() const;
  /// It is told, and 0 is not in the interval.
  [[nodiscard]] bool differs() const { return isTold() && (difference.low > 0.0 || difference.high < 0.0); }
  /// The noise floor: what B − A is uncertain by, towards 0. A smaller difference would not show.
  [[nodiscard]] double floor() const;
  [[nodiscard]] double timesFloor() const;
  /// What a line is off by, at a distance.
  [[nodiscard]] bool isOffset() const;
  /// What a line is off by per distance.
  [[nodiscard]] bool isScale() const;
  /// mm that the line of an offset or a scale is off by at a distance; it must have one.
  [[nodiscard]] double offAt(double distance_m) const;
  /// Wrapped readings of the wall, a share that differs by over 1 %.
  [[nodiscard]] bool isWraps() const;
  /// One camera lacks over 5 % of the other's pixels, whether or not shares differ: they are in no number.
  [[nodiscard]] bool isMissing() const;
  /// It is missing as noise alone makes it: each lacks at most twice as many as the other, and no more than if each
  /// had its share of the pixels by chance.
  [[nodiscard]] bool isMissingAlike() const;
};

/// Over 5 % of the other's pixels, and more than the interval.
bool isLack(const Trait& lacked);

/// Of each number that both cameras have, and of those told of B − A that are 0 for equal cameras (so not
/// what is left of a fit). Where a number is told of A, of B and of B − A, the last one is the difference.
/// Those that differ come first, the farthest beyond its floor before the others; behind them what others make: the
/// fixed pattern, and an offset that a scale makes which differs, too. But before them all the wall's
/// wraps and what one camera lacks of the pixels, as what is wrapped or missing is in few of the others; but not what
/// both lack alike. What is extrapolated (Trait::is_extrapolated) is not told.
std::vector<TraitVerdict> verdictsOf(const NamedTraits& traits);

Json toJson(const std::vector<TraitVerdict>& verdicts);

}  // namespace toftwin::compare
