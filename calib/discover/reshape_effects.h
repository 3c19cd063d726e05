// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/discover/found_effects.h"

namespace toftwin::discover {

/// What is left goes with the covariates of an effect that is known: its shape was not it. Another single
/// shape, if one does as well as both together; else their sum.
void reshape(Found& found, Effect& effect, const Effect& more);

/// What was found first of an effect may be nothing beside the rest of it: raw exposures that are unequal beside waves
/// of the range and of the gain. Numbers that answer for each other would be fitted far off.
void dropNeedlessParts(Found& found);

/// Each effect's shape once more, now that the others no longer stand in its way.
void revise(Found& found);

/// A formula whose one coefficient is less than two standard errors from nothing, though it predicts, is a piece of a curve
/// so wide that its inner numbers stand for one another: a simpler shape or a free curve says the same with numbers that
/// mean something. Effects must be estimated; whether any is told otherwise now.
bool retellUndetermined(Found& found);

/// An effect that the others explain as well was a step on the way to them: it goes, the least useful
/// first.
void prune(Found& found);

}  // namespace toftwin::discover
