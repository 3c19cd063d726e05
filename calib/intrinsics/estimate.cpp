// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/intrinsics/median.h"
#include "calib/intrinsics/model_choice.h"

namespace toftwin::intrinsics {
namespace {

/// The views that still count, with their place among the sightings.
struct Working {
  std::vector<std::size_t> used;
  std::vector<Observed> views;
  std::vector<std::size_t> dropped;
  Bundle bundle;
  void erase(std::size_t v) {
    const auto at = static_cast<std::ptrdiff_t>(v);
    used.erase(used.begin() + at);
    views.erase(views.begin() + at);
    dropped.erase(dropped.begin() + at);
    bundle.poses.erase(bundle.poses.begin() + at);
  }
};

Working gather(const std::vector<Sighting>& sightings) {
  Working working;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (!sightings[i].isUsed()) continue;
    working.used.push_back(i);
    working.views.push_back(observed(sightings[i].corners));
    working.dropped.push_back(0);
  }
  return working;
}

/// Leaves out corners that lie far from where the rest of their view puts them: 8 of its typical lengths, which
/// normal errors exceed once in 10^19 corners, yet a finger on the board or a reflection does.
bool dropCorners(Working& working, std::size_t v) {
  constexpr double kFar = 8.0;
  Observed& view = working.views[v];
  const auto left = residuals(working.bundle, view, v);
  std::vector<double> lengths;
  for (const auto& r : left) lengths.push_back(r.norm());
  const double far = kFar * std::max(median(lengths), 0.01);
  Observed kept;
  for (std::size_t i = 0; i < left.size(); ++i) {
    if (left[i].norm() > far) continue;
    kept.corners.push_back(view.corners[i]);
    kept.weights.push_back(view.weights[i]);
  }
  const std::size_t lost = left.size() - kept.corners.size();
  working.dropped[v] += lost;
  view = std::move(kept);
  return lost > 0;
}

/// RMS of a view from which it is an outlier: twice the median view, and more where views differ much.
double outlierLimit(const std::vector<double>& rms) {
  std::vector<double> logs, deviations;
  for (const double one : rms) logs.push_back(std::log(std::max(one, 1e-6)));
  const double middle = median(logs);
  for (const double one : logs) deviations.push_back(std::abs(one - middle));
  constexpr double kSigmas = 4.0, kToSigma = 1.4826;
  return std::exp(middle + std::max(std::log(2.0), kSigmas * kToSigma * median(deviations)));
}

std::vector<double> rmsByView(const Working& working) {
  std::vector<double> rms;
  for (std::size_t v = 0; v < working.views.size(); ++v) {
    rms.push_back(rmsOf(residuals(working.bundle, working.views[v], v)));
  }
  return rms;
}

/// Takes the worst offenders out; true if anything was.
bool rejectOutliers(Working& working, std::vector<Sighting>& sightings,
                    const EstimateOptions& options) {
  bool has_changed = false;
  for (std::size_t v = working.views.size(); v-- > 0;) {
    has_changed |= dropCorners(working, v);
    const std::size_t left = working.views[v].corners.size(), seen = left + working.dropped[v];
    if (static_cast<double>(working.dropped[v]) <= options.most_lost * static_cast<double>(seen)) continue;
    Sighting& sighting = sightings[working.used[v]];
    sighting.rejection = Rejection::CornerOutliers;
    sighting.detail = fmt::format("{} of {} corners lie where the others put them", left, seen);
    working.erase(v);
  }
  if (working.views.size() <= kFewestViews) return has_changed;
  const auto rms = rmsByView(working);
  const double limit = outlierLimit(rms);
  const auto worst = static_cast<std::size_t>(std::ranges::max_element(rms) - rms.begin());
  if (rms[worst] <= limit) return has_changed;
  Sighting& sighting = sightings[working.used[worst]];
  sighting.rejection = Rejection::ReprojectionOutlier;
  sighting.detail = fmt::format("{:.3f} px RMS, the other views have {:.3f} px (median); the limit is {:.3f} px",
                                rms[worst], median(rms), limit);
  working.erase(worst);
  return true;
}

Error tooFew(const std::vector<Sighting>& sightings, std::size_t used) {
  std::string reasons;
  for (const Rejection reason : kRejections) {
    const auto count = std::ranges::count(sightings, reason, &Sighting::rejection);
    if (count > 0) reasons += fmt::format("; {}: {}", nameOf(reason), count);
  }
  return {Error::Code::InvalidArgument,
          fmt::format("of {} images {} show the board well enough, but a lens needs {} (20 are good), with the "
                      "board tilted differently{}",
                      sightings.size(), used, kFewestViews, reasons)};
}

/// A second look at each pose: a flat board seen from afar may have been taken for its mirror image.
void reconsiderPoses(Working& working) {
  Bundle& bundle = working.bundle;
  for (std::size_t v = 0; v < working.views.size(); ++v) {
    const auto other = poseOf(bundle.surface, working.views[v], bundle.lens);
    if (!other) continue;
    const double then = rmsOf(residuals(bundle.surface, working.views[v], bundle.lens, *other));
    if (then < rmsOf(residuals(bundle, working.views[v], v))) bundle.poses[v] = *other;
  }
}

void fit(Working& working, LensModel model) {
  working.bundle = refitted(working.views, working.bundle, model);
  reconsiderPoses(working);
  working.bundle = refitted(working.views, working.bundle, model);
}

/// Flat or bent: as asked, else as held-out views say.
std::vector<ModelScore> fitSurface(const Target& target, Working& working, LensModel model,
                                   const EstimateOptions& options) {
  std::vector<ModelScore> scores;
  if (!options.degree && options.folds > 0) {
    scores = scoreSurfaces(target, working.views, working.bundle, model, options.folds);
  }
  working.bundle.surface = Surface{target, options.degree.value_or(chooseDegree(scores))};
  fit(working, model);
  return scores;
}

/// All terms that a file can hold, if there are views for them.
LensModel generalFor(const std::vector<Observed>& views) {
  constexpr std::size_t kMany = 8;
  return views.size() >= kMany ? LensModel::FiveTerms : LensModel::Tangential;
}

Result<Working> fitRobustly(const Target& target, std::vector<Sighting>& sightings, ImageSize size,
                            const EstimateOptions& options, std::vector<ModelScore>& surfaces) {
  Working working = gather(sightings);
  if (working.views.size() < kFewestViews) return tooFew(sightings, working.views.size());
  auto seeded = seedBundle(Surface{target, 0}, working.views, size);
  if (!seeded) {
    return Error{Error::Code::InvalidArgument,
                 "no focal length fits the views; is --board right, and is it the same board in all?"};
  }
  working.bundle = *std::move(seeded);
  const LensModel general = options.model.value_or(generalFor(working.views));
  fit(working, general);
  std::size_t views_before = 0;
  while (views_before != working.views.size()) {
    // What a bent board does to oblique views must not make them outliers, so its surface comes first.
    views_before = working.views.size();
    surfaces = fitSurface(target, working, general, options);
    while (rejectOutliers(working, sightings, options)) {
      if (working.views.size() < kFewestViews) return tooFew(sightings, working.views.size());
      fit(working, general);
    }
  }
  return working;
}

/// Views square to the axis fit any focal length: it is known if its 95 % interval, the one that is printed,
/// is narrower than ± a fifth of it.
Result<> checkFocalLength(const Estimate& estimate) {
  constexpr double kMostShare = 0.2;
  const LensUncertainty& known = estimate.uncertainty;
  const double most = std::max({known.half_width[0], known.from_corners[0], known.from_views[0]});
  const double share = most / estimate.bundle.lens[0];
  if (std::isfinite(known.half_width[0]) && std::isfinite(share) && share < kMostShare) return {};
  return Error{
      Error::Code::InvalidArgument,
      fmt::format("the focal length is only known to ± {:.0f} %: add views with the board tilted by 30 "
                  "to 50 degrees, to the left, right, up and down",
                  100.0 * share)};
}

}  // namespace

const ModelScore* Estimate::scoreOf(LensModel model) const {
  const auto found = std::ranges::find(scores, model, &ModelScore::model);
  return found == scores.end() ? nullptr : &*found;
}

Result<Estimate> estimate(const Target& target, std::vector<Sighting>& sightings, ImageSize size,
                          const EstimateOptions& options) {
  Estimate result;
  auto working = fitRobustly(target, sightings, size, options, result.surfaces);
  if (!working) return working.error();
  if (options.folds > 0) result.scores = scoreModels(working->views, working->bundle, options.folds);
  const LensModel model = options.model.value_or(
      options.folds > 0 ? chooseModel(result.scores) : working->bundle.model);
  result.bundle = refitted(working->views, working->bundle, model);
  working->bundle = result.bundle;
  result.used = working->used;
  result.views = working->views;
  result.dropped = working->dropped;
  result.rms_px = rmsByView(*working);
  std::vector<Eigen::Vector2d> all;
  for (std::size_t v = 0; v < result.views.size(); ++v) {
    const auto left = residuals(result.bundle, result.views[v], v);
    all.insert(all.end(), left.begin(), left.end());
  }
  result.rms_px_all = rmsOf(all);
  result.uncertainty = uncertaintyOf(result.views, result.bundle);
  if (auto known = checkFocalLength(result); !known) return known.error();
  return result;
}

}  // namespace toftwin::intrinsics
