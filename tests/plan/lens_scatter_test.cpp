// SPDX-License-Identifier: Apache-2.0
// A veil that a plate before a wall tells, beside what the wall shows alone.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>

#include "calib/plan/run_traits.h"
#include "planted_runs.h"

namespace toftwin::plan {
namespace {

/// Cells of a wall, a row each 25 mm of range: an error of 5 sin d besides `veil` times what a veil of 1
/// does, w_f · v_f summed over the frequencies, w_f = f / Σ f of a Kinect v2.
CameraSeen wallWith(double veil, double from_m, const std::function<double(double, double)>& slope_mm) {
  const std::array frequency_mhz{16.0, 80.0, 120.0};
  CameraSeen seen;
  seen.wall_veil_mm.resize(frequency_mhz.size());
  for (int i = 0; i < 40; ++i) {
    const double d = from_m + 0.025 * i;
    double moved_mm = 0.0;
    for (std::size_t f = 0; f < frequency_mhz.size(); ++f) {
      seen.wall_veil_mm[f].push_back(slope_mm(frequency_mhz[f], d));
      moved_mm += frequency_mhz[f] / 216.0 * seen.wall_veil_mm[f].back();
    }
    seen.wall_range_m.push_back(d), seen.wall_error_mm.push_back(5.0 * std::sin(d) + veil * moved_mm);
  }
  return seen;
}

void addCapture(ComparedRun& run, const char* kind, const CameraSeen& seen, const char* pose_by = "command") {
  ComparedCapture& one = run.captures.emplace_back();
  one.record.number = run.captures.size(), one.record.kind = kind, one.record.pose_by = pose_by;
  one.seen = {seen, seen};
}

/// What a wall by itself shows, its own error and its own light's veil, and a plate before it in three
/// captures.
ComparedRun veiledRun(double veil, const char* plates) {
  const auto of_wall = [](double mhz, double d) { return 40.0 * std::cos(0.02 * mhz * d); };
  ComparedRun run;
  run.frequency_hz = {std::vector{16e6, 80e6, 120e6}, std::vector{16e6, 80e6, 120e6}};
  addCapture(run, "distance", wallWith(veil, 1.0, of_wall)),
      addCapture(run, "distance", wallWith(veil, 2.0, of_wall));
  for (const double plate_m : {0.6, 0.8, 1.1}) {
    addCapture(run, plates, wallWith(veil, 1.5, [&](double mhz, double d) {
                 return of_wall(mhz, d) + 300.0 * std::sin(0.04 * mhz * (d - plate_m));
               }));
  }
  return run;
}

/// Rows are exact, so the share is, too: to rounding in 120 rows of some 100 mm.
constexpr double kRounding = 1e-9;

TEST(RunTraits, TellLensScatterOfAPlateBesideTheWallAlone) {
  for (const char* kind : {"scatter", "foreground"}) {
    const RunTraits all = traitsOf(veiledRun(0.03, kind));
    for (const char* of : {"A", "B"}) {
      const RunTrait* veil = find(all, "lens scatter", of, "veil");
      ASSERT_NE(veil, nullptr) << kind;
      EXPECT_NEAR(veil->trait.value, 0.03, kRounding) << kind;
    }
  }
}

TEST(RunTraits, TakeLensScatterOfTheBlocksThatAreMadeForIt) {
  ComparedRun run = veiledRun(0.03, "scatter");
  const ComparedRun other = veiledRun(0.5, "foreground");
  run.captures.insert(run.captures.end(), other.captures.begin() + 2, other.captures.end());
  EXPECT_NEAR(find(traitsOf(run), "lens scatter", "A", "veil")->trait.value, 0.03, kRounding);
}

TEST(RunTraits, TakeNoLensScatterWhereThePoseIsFittedToThePlanes) {
  ComparedRun run = veiledRun(0.03, "scatter");
  addCapture(run, "scatter",
             wallWith(0.5, 1.5, [](double mhz, double d) { return 300.0 * std::sin(0.01 * mhz * d); }),
             "planes");
  EXPECT_NEAR(find(traitsOf(run), "lens scatter", "A", "veil")->trait.value, 0.03, kRounding);
}

/// A cell of the wall alone without an amplitude says nothing of a veil, so its error is not what the others'
/// is less.
TEST(RunTraits, TakeErrorAndVeilOfTheWallAloneOfTheSameCells) {
  ComparedRun run = veiledRun(0.03, "scatter");
  CameraSeen dim = wallWith(0.03, 1.5, [](double, double) { return std::nan(""); });
  for (double& error : dim.wall_error_mm) error = 40.0;
  addCapture(run, "distance", dim);
  EXPECT_NEAR(find(traitsOf(run), "lens scatter", "A", "veil")->trait.value, 0.03, kRounding);
}

}  // namespace
}  // namespace toftwin::plan
