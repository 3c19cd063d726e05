// SPDX-License-Identifier: Apache-2.0
// Camera files of before there were terms. That their images are the same to rounding was tested against the types
// themselves, with every covariate and random tables, before those were removed.
#include <gmock/gmock.h>

#include "sim/effects/effects.h"
#include "sim/sensor/sensor_model.h"
#include "tests/sim/camera_testing.h"

namespace toftwin::sim {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::string> textsOf(const std::string& keys) {
  const SensorModel model = modelOf(plainCamera(4, 2, 0.5, "[[effect]]\n" + keys));
  return std::get<Learned>(model.effects().back()).terms.texts();
}

TEST(OlderLearned, RangesAreCurvesOverWhatTheyGoWith) {
  EXPECT_THAT(textsOf("type = 'learned_range'\n"), ElementsAre("range_mm += 1 * curve(range_m, 1, 0, 2, 3, 3, -1)"));
  EXPECT_THAT(textsOf("type = 'learned_range'\nover = 'time_s'\nknots = [0, 60]\noffsets_mm = []\ngains_percent = [1, 2]\n"),
              ElementsAre("amplitude_percent += 1 * curve(time_s, 0, 1, 60, 2)"));
}

TEST(OlderLearned, TablesOfTwoAreHatsTimesCurves) {
  EXPECT_THAT(textsOf("type = 'learned_range'\nknots = [1, 2]\nand_over = 'column'\nand_knots = [0, 10]\n"
                      "offsets_mm = [0, 10, 100, 110]\n"),
              ElementsAre("range_mm += 1 * hat(range_m, -inf, 1, 2) * curve(column, 0, 0, 10, 10)",
                          "range_mm += 1 * hat(range_m, 1, 2, inf) * curve(column, 0, 100, 10, 110)"));
}

TEST(OlderLearned, LightIsADelayAndAGain) {
  EXPECT_THAT(textsOf("type = 'learned_light'\ngains_percent = [1, 0, 2]\n"),
              ElementsAre("delay_mm += 1 * curve(surround_16px, -1, -2, 0, 0, 1, 5)",
                          "light_percent += 1 * curve(surround_16px, -1, 1, 0, 0, 1, 2)"));
}

TEST(OlderLearned, KernelsAreLightOfSquaresLinesAndTheMirroredPlace) {
  EXPECT_THAT(textsOf("type = 'learned_neighbours'\nrow_percent = 2\n"),
              ElementsAre("light_percent += 0.5 * square(1)", "light_percent += 1 * square(15)", "light_percent += 2 * row_mean()"));
  EXPECT_THAT(textsOf("type = 'learned_mirror'\n"),
              ElementsAre("light_percent += 0.5 * mirror(0, 2, 1)", "light_percent += 0.5 * mirror(5, 2, 1)"));
}

TEST(OlderLearned, ShiftsColumnsAndSmearsAreTerms) {
  EXPECT_THAT(textsOf("type = 'learned_shift'\n"), ElementsAre("outward_px += 1 * curve(radius_px, 0, 0, 100, 1)"));
  EXPECT_THAT(textsOf("type = 'learned_columns'\nin_phase_electrons = [3, 0]\nquadrature_electrons = [0, 4]\ngains_percent = []\n"),
              ElementsAre("in_phase_e += 3 * class(column, 2, 0)", "quadrature_e += 4 * class(column, 2, 1)"));
  EXPECT_THAT(textsOf("type = 'learned_smear'\n"),
              ElementsAre("range_mm += 0.01 * across() * curve(amplitude_e, 500, 5, 2000, 1)",
                          "range_mm += 0.01 * around() * curve(amplitude_e, 500, 10, 2000, 2)"));
}

TEST(OlderLearned, IsNotedWithItsPlaceAndItsTerms) {
  const SensorModel model = modelOf(plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'learned_shift'\n"));
  ASSERT_EQ(model.notes().size(), 1U);
  EXPECT_THAT(model.notes().front(),
              testing::AllOf(HasSubstr(".toml:"), HasSubstr("type = \"learned_shift\" is of an older version"),
                             HasSubstr("terms = [\"outward_px += 1 * curve(radius_px, 0, 0, 100, 1)\"]")));
  EXPECT_TRUE(modelOf(plainCamera(4, 2, 0.5)).notes().empty());
}

TEST(OlderLearned, ThatIsWrongIsRefusedAsBefore) {
  const auto wrongWith = [](const std::string& keys) { return errorOf(plainCamera(4, 2, 0.5, "[[effect]]\n" + keys + "\n")); };
  EXPECT_THAT(wrongWith("type = 'learned_range'\nknots = [1, 3, 2]"), HasSubstr("knots and and_knots that ascend"));
  EXPECT_THAT(wrongWith("type = 'learned_range'\nknots = [1, 2]"), HasSubstr("has 3 offsets_mm for 2 knots"));
  EXPECT_THAT(wrongWith("type = 'learned_range'\nand_over = 'time_s'"), HasSubstr("and_over without and_knots"));
  EXPECT_THAT(wrongWith("type = 'learned_range'\nover = 'albedo'"), HasSubstr("the simulator knows no \"albedo\""));
  EXPECT_THAT(wrongWith("type = 'learned_range'\nwidth = 3"), HasSubstr("width"));
  EXPECT_THAT(wrongWith("type = 'learned_neighbours'\nreaches_px = [1, 2, 3]"), HasSubstr("has 2 shares_percent for 3 reaches_px"));
  EXPECT_THAT(wrongWith("type = 'learned_shift'\nradii_px = [2, 1]"), HasSubstr("radii_px that ascend"));
  EXPECT_THAT(wrongWith("type = 'learned_columns'\ngains_percent = [1]"), HasSubstr("as many in_phase_electrons"));
  EXPECT_THAT(wrongWith("type = 'learned_smear'\nalong_percent = [1]"), HasSubstr("as many across_percent"));
}

}  // namespace
}  // namespace toftwin::sim
