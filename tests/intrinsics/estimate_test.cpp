// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/estimate.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <toftwin/camera_info.h>

#include "calib/intrinsics/verdict.h"
#include "synthetic.h"

namespace toftwin::intrinsics {
namespace {

using testing::checkerboard;
using testing::drawViews;
using testing::kinectLike;
using testing::Truth;
using ::testing::HasSubstr;

constexpr double kNoise_px = 0.05;
const Surface kFlat{checkerboard(), 0};

TEST(LensModel, ProjectsAsCameraInfoDoes) {
  const Truth truth = kinectLike();
  const auto& l = truth.lens;
  const CameraInfo camera{.width = truth.size.width,
                          .height = truth.size.height,
                          .fx = l[0],
                          .fy = l[1],
                          .cx = l[2],
                          .cy = l[3],
                          .distortion = {l[4], l[5], l[6], l[7], l[8]},
                          .calibration_id = {}};
  for (const double x : {-0.6, 0.1, 0.5}) {
    const auto expected = pixelOfPoint(camera, {{x, 0.4 * x + 0.1, 1.0}});
    const auto seen = project(l, {x, 0.4 * x + 0.1, 1.0});
    EXPECT_NEAR(seen.x(), expected[0], 1e-10);
    EXPECT_NEAR(seen.y(), expected[1], 1e-10);
  }
}

TEST(LensModel, SlopesAreThoseOfDifferences) {
  Truth truth = kinectLike();
  truth.lens[9] = 0.02;
  truth.lens[10] = -0.03;
  truth.lens[11] = 0.01;
  std::mt19937_64 random{1};
  const BoardPose pose = testing::drawPose(truth, kFlat, random);
  const Eigen::Vector3d at{40.0, 70.0, 1.5};
  const Projection p = projectWithSlopes(truth.lens, pose, at);
  constexpr double kStep = 1e-6;  // the difference errs by about 1e-9 of the slope, and by 1e-13 px / step
  for (std::size_t i = 0; i < kMostParameters; ++i) {
    LensParameters more = truth.lens, less = truth.lens;
    more[i] += kStep;
    less[i] -= kStep;
    const Eigen::Vector2d slope = (projectWithSlopes(more, pose, at).at - projectWithSlopes(less, pose, at).at) / (2 * kStep);
    EXPECT_LT((slope - p.by_lens.col(static_cast<Eigen::Index>(i))).norm(), 1e-5) << kParameterNames[i];
  }
  for (Eigen::Index i = 0; i < 6; ++i) {
    Eigen::Matrix<double, 6, 1> step = Eigen::Matrix<double, 6, 1>::Zero();
    step[i] = kStep;
    const Eigen::Vector2d slope = (projectWithSlopes(truth.lens, moved(pose, step), at).at -
                                   projectWithSlopes(truth.lens, moved(pose, -step), at).at) /
                                  (2 * kStep);
    EXPECT_LT((slope - p.by_pose.col(i)).norm(), 1e-4) << "of pose parameter " << i;
  }
  const Eigen::Vector3d up{0.0, 0.0, kStep};
  const Eigen::Vector2d slope =
      (projectWithSlopes(truth.lens, pose, at + up).at - projectWithSlopes(truth.lens, pose, at - up).at) / (2 * kStep);
  EXPECT_LT((slope - p.by_height).norm(), 1e-5);
}

TEST(Estimate, RecoversALensExactlyWithoutNoise) {
  const Truth truth = kinectLike();
  std::mt19937_64 random{2};
  auto views = drawViews(truth, kFlat, 8, 0.0, random);
  const auto result = estimate(checkerboard(), views, truth.size, {.model = LensModel::FiveTerms, .degree = 0, .folds = 0});
  ASSERT_TRUE(result.ok()) << result.error().message;
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_NEAR(result->bundle.lens[i], truth.lens[i], 1e-4 * std::max(1.0, std::abs(truth.lens[i])))
        << kParameterNames[i];
  }
  EXPECT_LT(result->rms_px_all, 1e-5);
}

/// How often the stated 95 % intervals hold the truth, over `runs` calibrations of `views` views.
struct Coverage {
  double share = 0.0;
  double least = 1.0;  ///< of the parameters
};
template <class Disturb>
Coverage coverageOver(int runs, std::size_t views, LensModel model, const Surface& board, int degree,
                      std::uint64_t seed, const Disturb& disturb) {
  std::printf("seed %lu\n", static_cast<unsigned long>(seed));
  const Truth truth = kinectLike();
  std::mt19937_64 random{seed};
  const std::size_t parameters = parametersOf(model);
  std::vector<int> held(parameters, 0);
  Truth known = truth;
  for (std::size_t i = parameters; i < kMostParameters; ++i) known.lens[i] = 0.0;
  for (int run = 0; run < runs; ++run) {
    auto seen = drawViews(known, board, views, kNoise_px, random);
    disturb(seen, random);
    const auto result = estimate(checkerboard(), seen, truth.size, {.model = model, .degree = degree, .folds = 0});
    EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().message);
    if (!result.ok()) return {};
    for (std::size_t i = 0; i < parameters; ++i) {
      const double off = std::abs(result->bundle.lens[i] - known.lens[i]);
      held[i] += off <= result->uncertainty.half_width[static_cast<Eigen::Index>(i)] ? 1 : 0;
    }
  }
  Coverage coverage;
  for (std::size_t i = 0; i < parameters; ++i) {
    const double share = static_cast<double>(held[i]) / runs;
    std::printf("  %s held in %.1f %%\n", kParameterNames[i].data(), 100.0 * share);
    coverage.share += share / static_cast<double>(parameters);
    coverage.least = std::min(coverage.least, share);
  }
  return coverage;
}
constexpr auto kUndisturbed = [](std::vector<Sighting>&, std::mt19937_64&) {};

// 95 % of 200 runs is 190 with a standard deviation of 3.1: one parameter stays within 90 to 98 % (3.2 and 1.9 of
// these) but for one case in 30, the mean of eight but for far fewer. The bar is the mean; no single one may be
// below 90 %.
TEST(Estimate, StatedIntervalsHoldTheTruthIn90To98PercentOf200Runs) {
  const Coverage coverage = coverageOver(200, 15, LensModel::Tangential, kFlat, 0, 20261121, kUndisturbed);
  EXPECT_GE(coverage.share, 0.90);
  EXPECT_LE(coverage.share, 0.98);
  EXPECT_GE(coverage.least, 0.90);
}

TEST(Estimate, IntervalsHoldTheTruthWhereCornersOfAViewErrTogether) {
  // Each view is seen through a bend of its own that no parameter describes: 0.3 px at its corners.
  const auto disturb = [](std::vector<Sighting>& views, std::mt19937_64& random) {
    std::normal_distribution<double> normal{0.0, 0.15};
    for (Sighting& view : views) {
      const double bend_u = normal(random), bend_v = normal(random);
      for (Corner& corner : view.corners) {
        const double x = static_cast<double>(corner.index % 8) / 3.5 - 1.0;
        corner.at.u += bend_u * (x * x - 0.4);
        corner.at.v += bend_v * (x * x - 0.4);
      }
    }
  };
  const Coverage coverage = coverageOver(200, 15, LensModel::K1K2, kFlat, 0, 20261122, disturb);
  EXPECT_GE(coverage.share, 0.90);
  EXPECT_LE(coverage.share, 0.98);
}

TEST(Estimate, IntervalsHoldTheTruthWithABentBoard) {
  Surface bent{checkerboard(), 2};
  bent.bendBy(Eigen::Vector3d{0.8, -0.3, 0.4});
  const Coverage coverage = coverageOver(60, 15, LensModel::K1K2, bent, 2, 20261123, kUndisturbed);
  EXPECT_GE(coverage.share, 0.88) << "95 % less 2.5 standard deviations of 60 runs";
}

}  // namespace
}  // namespace toftwin::intrinsics
