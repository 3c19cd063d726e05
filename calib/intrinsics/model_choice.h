// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calib/intrinsics/bundle.h"
#include "calib/intrinsics/target.h"

namespace toftwin::intrinsics {

/// The bundle with another model's terms, refined. `views` get its weights.
Bundle refitted(std::vector<Observed>& views, Bundle bundle, LensModel model);

/// Fits each model to all views, and again without one fold after the other to judge it there.
std::vector<ModelScore> scoreModels(const std::vector<Observed>& views,
                                    const Bundle& start, int folds);

/// Fits a lens model and a board's surface to all views, and again without one fold after the other to judge
/// them there.
ModelScore scoreOf(std::vector<Observed> views, const Bundle& start, LensModel model, int folds);

/// Fits flat and bent boards, each judged on held-out views.
std::vector<ModelScore> scoreSurfaces(const Target& target, const std::vector<Observed>& views,
                                      const Bundle& start, LensModel model, int folds);

/// The simplest surface that no richer one really betters on held-out views.
int chooseDegree(const std::vector<ModelScore>& surfaces);
/// The simplest model that no richer one (that a camera file can hold) really betters on held-out views.
LensModel chooseModel(const std::vector<ModelScore>& scores);

}  // namespace toftwin::intrinsics
