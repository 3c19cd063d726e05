// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/model_choice.h"

#include <algorithm>
#include <cmath>

namespace toftwin::intrinsics {
namespace {

double meanSquare(const Bundle& bundle, const Observed& view, const BoardPose& pose) {
  const double rms = rmsOf(residuals(bundle.surface, view, bundle.lens, pose));
  return rms * rms;
}

double pooledRms(const std::vector<Observed>& views, const std::vector<double>& mean_squares) {
  double sum = 0.0, corners = 0.0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    sum += mean_squares[v] * static_cast<double>(views[v].corners.size());
    corners += static_cast<double>(views[v].corners.size());
  }
  return corners > 0.0 ? std::sqrt(sum / corners) : 0.0;
}

/// Views that are fitted when one fold is held out. Neighbours in the file's order are often alike, so folds
/// take every k-th view.
struct Split {
  std::vector<Observed> kept;
  std::vector<BoardPose> poses;
};
Split without(const std::vector<Observed>& views, const Bundle& bundle, std::size_t fold, std::size_t folds) {
  Split split;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (v % folds == fold) continue;
    split.kept.push_back(views[v]);
    split.poses.push_back(bundle.poses[v]);
  }
  return split;
}

std::size_t coordinatesOf(const std::vector<Observed>& views) {
  std::size_t coordinates = 0;
  for (const Observed& view : views) coordinates += 2 * view.corners.size();
  return coordinates;
}

double parametersWith(const Surface& surface, LensModel model, std::size_t views) {
  return static_cast<double>(parametersOf(model) + 6 * views) + static_cast<double>(surface.terms());
}

}  // namespace

Bundle refitted(std::vector<Observed>& views, Bundle bundle, LensModel model) {
  bundle.model = model;
  for (std::size_t i = parametersOf(model); i < kMostParameters; ++i) bundle.lens[i] = 0.0;
  refine(views, bundle);
  return bundle;
}

ModelScore scoreOf(std::vector<Observed> views, const Bundle& start, LensModel model, int wanted_folds) {
  const Bundle full = refitted(views, start, model);
  ModelScore result{.model = model, .degree = full.surface.degree(), .lens = full.lens};
  result.held_out_by_view.resize(views.size());
  std::vector<double> fitted(views.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    fitted[v] = meanSquare(full, views[v], full.poses[v]);
  }
  const std::size_t folds = std::min(views.size(), static_cast<std::size_t>(wanted_folds));
  for (std::size_t fold = 0; fold < folds; ++fold) {
    Split split = without(views, full, fold, folds);
    Bundle bundle{.model = model,
                  .lens = full.lens,
                  .surface = full.surface,
                  .poses = std::move(split.poses)};
    refine(split.kept, bundle, {.is_robust = false, .steps = 20});
    for (std::size_t v = fold; v < views.size(); v += folds) {
      Observed all_alike = views[v];
      std::ranges::fill(all_alike.weights, 1.0);
      BoardPose pose = full.poses[v];
      refinePose(bundle.surface, all_alike, bundle.lens, pose);
      result.held_out_by_view[v] = meanSquare(bundle, all_alike, pose);
    }
  }
  result.fitted_rms_px = pooledRms(views, fitted);
  result.held_out_rms_px = pooledRms(views, result.held_out_by_view);
  return result;
}

std::vector<ModelScore> scoreModels(const std::vector<Observed>& views, const Bundle& start,
                                    int folds) {
  const std::size_t coordinates = coordinatesOf(views);
  std::vector<ModelScore> scores;
  for (const LensModel model : kLensModels) {
    if (static_cast<double>(coordinates) < 2.0 * parametersWith(start.surface, model, views.size())) continue;
    scores.push_back(scoreOf(views, start, model, folds));
  }
  return scores;
}

std::vector<ModelScore> scoreSurfaces(const Target& target, const std::vector<Observed>& views,
                                      const Bundle& start, LensModel model, int folds) {
  constexpr int kDegrees[] = {0, 2, 3, 4, 6};
  std::vector<ModelScore> scores;
  for (const int degree : kDegrees) {
    Bundle bundle = start;
    bundle.surface = Surface{target, degree};
    const bool is_known = std::ranges::any_of(
        scores, [&](const ModelScore& one) { return one.degree == bundle.surface.degree(); });
    const double parameters = parametersWith(bundle.surface, model, views.size());
    if (is_known || static_cast<double>(coordinatesOf(views)) < 2.0 * parameters) continue;
    scores.push_back(scoreOf(views, bundle, model, folds));
  }
  return scores;
}

int chooseDegree(const std::vector<ModelScore>& surfaces) {
  const ModelScore* chosen = nullptr;
  for (const ModelScore& one : surfaces) {
    if (chosen == nullptr || gainOf(*chosen, one).isReal()) chosen = &one;
  }
  return chosen == nullptr ? 0 : chosen->degree;
}

LensModel chooseModel(const std::vector<ModelScore>& scores) {
  const ModelScore* chosen = nullptr;
  for (const ModelScore& one : scores) {
    if (one.model == LensModel::Rational) continue;
    if (chosen == nullptr || gainOf(*chosen, one).isReal()) chosen = &one;
  }
  return chosen == nullptr ? LensModel::Pinhole : chosen->model;
}

}  // namespace toftwin::intrinsics
