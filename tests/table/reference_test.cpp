// SPDX-License-Identifier: Apache-2.0
// A reference that no header names, one in another unit than its header says, and one that only its header
// makes it.
#include <gmock/gmock.h>

#include <cmath>
#include <functional>

#include <fmt/format.h>

#include "calib/table/readings.h"

namespace toftwin::table {
namespace {

using testing::Contains;
using testing::HasSubstr;

/// Targets at 1 to 3 m in another order than time's; readings in mm, 3 mm too long with an error of 2 mm.
using Reading = std::function<double(double target_mm, int row)>;
std::string targets(
    const std::string& header, double units_per_metre,
    const Reading& more = [](double, int) { return 0.0; }) {
  std::string text = header + ",measured_mm,t_s\n";
  for (int i = 0; i < 120; ++i) {
    const double metres = 1.0 + 0.05 * (i * 17 % 41);
    text += fmt::format("{:.4f},{:.2f},{}\n", metres * units_per_metre,
                        1000.0 * metres + 3.0 + 2.0 * std::sin(1.7 * i) + more(1000.0 * metres, i), i);
  }
  return text;
}

std::string referenceIn(const std::string& text, const TableMap& map = {}) {
  const auto read = parseReadings(text, map, "t.csv");
  return read ? read->reference_name : read.error().message;
}

TEST(Reference, IsTheTargetThatIsFollowed) {
  for (const auto& [header, units] : {std::pair{"target_m", 1.0},
                                      {"plane_mm", 1000.0},
                                      {"distance_cm", 100.0},
                                      {"Wand [mm]", 1000.0},
                                      {"laser_in", 1.0 / 0.0254},
                                      {"stand_mm", 1000.0}}) {
    const auto read = parseReadings(targets(header, units), {}, "t.csv");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->reference_name, header);
    EXPECT_NEAR(read->error[0], 3.0, 0.6) << header;
    EXPECT_THAT(read->notes, Contains(HasSubstr(fmt::format("measured_mm follows {}", header))));
  }
}

TEST(Reference, IsFollowedAtAnyGain) {
  for (const double gain : {-0.5, -0.23, -0.05, 0.1, 0.5, 2.0})
    EXPECT_EQ(referenceIn(targets("target_mm", 1000.0, [=](double mm, int) { return gain * mm; })),
              "target_mm")
        << gain;
}

TEST(Reference, IsFoundBesideReadingsThatAreStuckOrWrapped) {
  EXPECT_EQ(referenceIn(
                targets("target_mm", 1000.0, [](double mm, int i) { return i % 4 == 0 ? 10.0 - mm : 0.0; })),
            "target_mm");
  EXPECT_EQ(
      referenceIn(targets("laser_mm", 1000.0, [](double mm, int) { return mm > 2500.0 ? -2500.0 : 480.0; })),
      "laser_mm");
}

TEST(Reference, IsNoneThatIsNotFollowedOrIsSaidToBeNone) {
  TableMap map;
  map.covariates = {{"target_m"}, {"t_s"}};
  EXPECT_EQ(referenceIn(targets("target_m", 1.0), map), "");
  map.covariates = {}, map.ignore = {"target_m"};
  EXPECT_EQ(referenceIn(targets("target_m", 1.0), map), "");
  EXPECT_EQ(referenceIn(targets("supply_V", 1.0)), "");
  EXPECT_EQ(referenceIn(targets("target_mm", 1000.0,
                                [](double mm, int i) { return 1000.0 + 700.0 * std::sin(2.9 * i) - mm; })),
            "")
      << "readings that have nothing to do with it";
}

TEST(Reference, IsAskedForWhereTwoColumnsCouldBeIt) {
  std::string text = "target_m,wall_mm,measured_mm,t_s\n";
  for (int i = 0; i < 60; ++i)
    text +=
        fmt::format("{},{},{},{}\n", 1.0 + 0.05 * i, 1000 + 50 * i, 1003.0 + 50 * i + std::sin(1.7 * i), i);
  EXPECT_THAT(referenceIn(text),
              HasSubstr("which column is the reference of measured_mm: target_m, wall_mm?"));
  EXPECT_THAT(referenceIn(text), HasSubstr("reference = \"…\""));
  TableMap map;
  map.reference = "wall_mm";
  EXPECT_EQ(referenceIn(text, map), "wall_mm");
}

TEST(Reference, ThatOnlyItsHeaderMakesItIsAskedFor) {
  std::string text = "reference_mm,laser_mm,measured_mm,t_s\n", alone = "reference_mm,measured_mm,t_s\n",
              still = alone;
  for (int i = 0; i < 60; ++i) {
    const int other = 100 * (i * 23 % 60), laser = 1000 + 20 * (i * 17 % 41);
    text += fmt::format("{},{},{},{}\n", other, laser, laser + 3.0 + std::sin(1.7 * i), i);
    alone += fmt::format("{},{},{}\n", other, 1000.0 + std::sin(1.7 * i), i);
    still += fmt::format("{},{},{}\n", 1000, 1000.0 + std::sin(1.7 * i), i);
  }
  EXPECT_THAT(referenceIn(text),
              HasSubstr("which column is the reference of measured_mm: reference_mm, laser_mm?"));
  EXPECT_THAT(referenceIn(alone),
              HasSubstr("reference_mm is called the reference, but measured_mm does not follow it"));
  EXPECT_EQ(referenceIn(still), "reference_mm") << "a wall that stays where it is";
}

/// 1000 for each 1: a gain of 999 would hide it.
TEST(Reference, InAnotherUnitThanItsHeaderSaysIsAnError) {
  EXPECT_THAT(referenceIn(targets("reference_mm", 1.0)),
              HasSubstr("for each 1 of reference_mm: one of the headers ends in the wrong unit"));
  for (const auto& [header, units] :
       {std::pair{"laser", 1.0}, {"laser_mm", 1.0}, {"target_cm", 1.0 / 0.3048}})
    EXPECT_THAT(referenceIn(targets(header, units)), HasSubstr("changes by")) << header;
  EXPECT_EQ(referenceIn(targets("reference_m", 1.0, [](double mm, int) { return 0.3 * mm; })), "reference_m")
      << "a gain";
  EXPECT_EQ(referenceIn(targets("target_number", 20.0)), "") << "50 mm for each";
}

TEST(Reference, WithoutAUnitIsInThatOfTheReadings) {
  const auto read = parseReadings(targets("reference", 1000.0), {}, "t.csv");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->reference_name, "reference");
  EXPECT_THAT(read->notes, Contains(HasSubstr("reference says no unit and is taken as mm")));
}

TEST(Reference, ThatIsMissingIsSaid) {
  const auto read = parseReadings("time_s,depth_mm\n0,1500.5\n1,1500.7\n2,1500.6\n", {}, "t.csv");
  ASSERT_TRUE(read);
  EXPECT_EQ(read->error, read->measured);
  EXPECT_THAT(read->notes, Contains(HasSubstr("no reference")));
}

}  // namespace
}  // namespace toftwin::table
