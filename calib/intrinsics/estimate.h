// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/intrinsics/bundle.h"
#include "calib/intrinsics/seed.h"
#include "calib/intrinsics/uncertainty.h"

namespace toftwin::intrinsics {

struct EstimateOptions {
  std::optional<LensModel> model{};  ///< none: chosen by held-out views
  std::optional<int> degree{};       ///< of the board's surface, 0: flat; none: chosen by held-out views
  int folds = 10;                    ///< 0: nothing is held out, so nothing is chosen
  double most_lost = 0.25;           ///< share of a view's corners, as DetectOptions
};

struct Estimate {
  Bundle bundle{};
  LensUncertainty uncertainty{};
  std::vector<std::size_t> used{};     ///< of the sightings given, in the bundle's order
  std::vector<Observed> views{};       ///< those, with their weights
  std::vector<double> rms_px{};        ///< of each
  std::vector<std::size_t> dropped{};  ///< corners left out of each
  double rms_px_all = 0.0;
  std::vector<ModelScore> scores{};    ///< of all models that the views can tell, with the surface used
  std::vector<ModelScore> surfaces{};  ///< of the surfaces that were tried
  [[nodiscard]] const ModelScore* scoreOf(LensModel model) const;
};

/// Fewest views with which a lens is estimated.
inline constexpr std::size_t kFewestViews = 3;

/// Estimates a lens from what was seen. Views that turn out to be outliers are marked as rejected in
/// `sightings`. Errors: too few views, or views that do not tell the focal length.
Result<Estimate> estimate(const Target& target, std::vector<Sighting>& sightings, ImageSize size,
                          const EstimateOptions& options = {});

}  // namespace toftwin::intrinsics
