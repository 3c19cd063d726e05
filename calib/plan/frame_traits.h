// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/plan/run_traits.h"

namespace toftwin::plan {

/// Gathers what blocks tell, and why others do not.
class TraitCollector {
 public:
  void add(const std::string& what, const char* of, const compare::Traits& traits,
           const std::string& detail = {});
  /// What no block of the run tells, and which would.
  void untold(std::string why) { found_.untold.push_back(std::move(why)); }
  RunTraits found() && { return std::move(found_); }

 private:
  RunTraits found_;
};

/// Those that are told from whole frames, each camera by itself: timing, wraps, noise, error over distance,
/// corners, lens scatter, flying pixels, edges, shadow, lag, motion; of both together, latency.
void addFrameTraits(const ComparedRun& run, TraitCollector& all);

}  // namespace toftwin::plan
