// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/plan/compared_run.h"

namespace toftwin::plan {

/// Those that are told from whole frames, each camera by itself: timing, wraps, noise, error over distance,
/// corners, lens scatter, flying pixels, edges, shadow, lag, motion; of both together, latency.
void addFrameTraits(const ComparedRun& run, compare::TraitCollector& all);

}  // namespace toftwin::plan
