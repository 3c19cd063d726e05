// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "calib/compare/traits/traits.h"

namespace toftwin::compare {

/// Trials in their order, of which those that happen may come in bursts: frames that are lost one after the other,
/// lines of an edge that have one fault.
class Trials {
 public:
  void add(bool happened, std::size_t times = 1);
  /// What follows is of another series, between which and this one nothing is known.
  void endSeries() { is_new_series_ = true; }

  /// How many of them count as one. Where bursts come at any time alike, however many trials each has, a share p of n
  /// has the variance p (1 − p) D/n with D = (1 − p) b − p, b = Σ L²/Σ L over the sizes L of the bursts: of that in
  /// which one that happened is on the mean. Of independent trials b is (1 + p)/(1 − p) and D is 1; less is taken for
  /// 1. What happens in over a half of them is looked at the other way round. Bursts that are nearer to each other
  /// than a tenth of the mean gap are one, where so near ones are more than chance makes (1 %). D is (t/1.96)² as
  /// large for what so few bursts tell of it, Student's quantile t of Satterthwaite's degrees of freedom, at most one
  /// less than the bursts. It is no more than if all that happened were one burst: of one of size S nothing says how
  /// sizes differ, and b is 2 S − 1, as where each trial of a burst is its last by the same chance. So few bursts are
  /// no surer than many.
  [[nodiscard]] double together() const;
  /// Their share, Jeffreys' interval of so many fewer trials (E. L. Korn, B. I. Graubard, Surv. Methodol. 24 (1998)
  /// 193). `together`: that of the same trials in another order, if it is more.
  [[nodiscard]] Trait share(std::string name, double together = 1.0) const;

 private:
  struct Run {
    bool happened = false;
    double length = 0.0;
    bool begins_series = false;
  };
  /// How many trials a burst has, and how many others are between it and the one before; of a series' first:
  /// infinitely.
  struct Burst {
    double size = 0.0, gap = 0.0;
  };
  [[nodiscard]] std::vector<Burst> burstsOf(bool happened) const;
  [[nodiscard]] double all() const { return count_[0] + count_[1]; }

  std::vector<Run> runs_{};
  std::array<double, 2> count_{};  ///< of trials that did not happen, and that did
  bool is_new_series_ = true;
};

}  // namespace toftwin::compare
