// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "calib/compare/csv.h"
#include "calib/compare/scan_line.h"
#include "calib/compare/statistics.h"

namespace toftwin::compare {
namespace {

/// The facts below are those that the data's own README states.
class RealData : public testing::Test {
 protected:
  void SetUp() override {
    const auto found = findThesisData();
    if (!found) GTEST_SKIP() << "no tof-thesis-2018 in $TOFTWIN_DATA or ../shared/data";
    folder = *found;
  }
  std::filesystem::path folder;
};

struct CornerFact {
  const char* camera;
  double min, median, max;
};
void PrintTo(const CornerFact& fact, std::ostream* out) { *out << fact.camera; }

class RealCorner : public RealData, public testing::WithParamInterface<CornerFact> {};

TEST_P(RealCorner, MeasuredMinusReferenceIsAsTheReadmeSays) {
  const auto& fact = GetParam();
  const auto measured =
      loadScanLine(folder / "corner" / (std::string{fact.camera} + "_measured.csv"));
  const auto reference =
      loadScanLine(folder / "corner" / (std::string{fact.camera} + "_reference.csv"));
  ASSERT_TRUE(measured.ok() && reference.ok());
  std::vector<double> error = rangesAlong(*measured, reference->t);
  for (std::size_t i = 0; i < error.size(); ++i) error[i] -= reference->range_mm[i];
  const Summary s = summarise(error);
  // The README rounds to whole millimetres and does not say how it interpolated: ±1.5 mm.
  EXPECT_NEAR(s.min, fact.min, 1.5);
  EXPECT_NEAR(s.median, fact.median, 1.5);
  EXPECT_NEAR(s.max, fact.max, 1.5);
}

TEST_P(RealCorner, ReferenceIsTwoWallsAtARightAngle) {
  const auto line =
      loadScanLine(folder / "corner" / (std::string{GetParam().camera} + "_reference.csv"));
  ASSERT_TRUE(line.ok());
  const auto fit = fitCorner(*line);
  ASSERT_TRUE(fit.ok()) << fit.error().message;
  RecordProperty("opening_deg", std::to_string(fit->opening_deg));
  EXPECT_NEAR(fit->opening_deg, 90.0, 3.0)
      << "left rms " << fit->left.rms_mm << " right " << fit->right.rms_mm;
  EXPECT_LT(fit->left.rms_mm, 5.0);
  EXPECT_LT(fit->right.rms_mm, 5.0);
}

INSTANTIATE_TEST_SUITE_P(Cameras, RealCorner,
                         testing::Values(CornerFact{"kinect_v2", 22, 48, 69},
                                         CornerFact{"o3d303", 34, 77, 105}),
                         testing::PrintToStringParamName());

TEST_F(RealData, KinectWarmsUpByNearlyFourMillimetres) {
  const auto columns =
      loadColumns(folder / "warmup_drift" / "kinect_v2.csv", {"time_s", "depth_mm"});
  ASSERT_TRUE(columns.ok());
  const auto& time = (*columns)[0];
  const auto& depth = (*columns)[1];
  std::vector<double> first, last;
  for (std::size_t i = 0; i < time.size(); ++i) {
    if (time[i] < 60.0) first.push_back(depth[i]);
    if (time[i] > 900.0) last.push_back(depth[i]);
  }
  EXPECT_NEAR(summarise(last).mean - summarise(first).mean, 3.8, 0.4);
}

TEST_F(RealData, KinectReadsFiveToEighteenMillimetresTooFarBelowTwoMetresThirty) {
  const auto columns = loadColumns(folder / "distance_error" / "kinect_v2.csv",
                                   {"reference_mm", "reference_minus_measured_mm"});
  ASSERT_TRUE(columns.ok());
  for (double from = 700.0; from < 2300.0; from += 100.0) {
    std::vector<double> too_far;
    for (std::size_t i = 0; i < (*columns)[0].size(); ++i) {
      const double at = (*columns)[0][i];
      if (at >= from && at < from + 100.0) too_far.push_back(-(*columns)[1][i]);
    }
    EXPECT_GE(quantile(too_far, 0.5), 5.0) << from;
    EXPECT_LE(quantile(too_far, 0.5), 18.0) << from;
  }
}

}  // namespace
}  // namespace toftwin::compare
