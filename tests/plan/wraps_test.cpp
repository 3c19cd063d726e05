// SPDX-License-Identifier: Apache-2.0
// A wall farther than a camera can tell: counted as wrapped, and no error of the camera.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/plan/run_report.h"
#include "calib/plan/run_traits.h"
#include "plans.h"

namespace toftwin::plan {
namespace {

constexpr double kLight_hz = 20e6, kTurn_m = 299'792'458.0 / 2.0 / kLight_hz;
constexpr unsigned kWrapSeed = 20261123;

/// A wall at z = 2 m, seen from `distance_m` before it by a camera without errors and with noise of 50 mm.
struct WallSeen {
  CameraSeen seen{};
  double readings = 0.0, wraps = 0.0;  ///< as they were made
};

/// Six frames of it by a camera whose pixel (x, y) reads `read_m` of its truth.
CameraSeen wallReadBy(const std::function<double(int, int, double)>& read_m, double distance_m,
                      std::size_t number, bool has_size, const std::vector<double>& frequency_hz) {
  const Plan plan =
      planOf(std::string{"target_m = [0, 0, 2]\n"} + (has_size ? "target_size_m = [40, 40]\n" : "") +
             "[[block]]\nname = 'b'\nkind = 'distance'\ndistance_m = [1, 1.5, 2]\n");
  Frame frame;
  frame.camera.width = 64, frame.camera.height = 48;
  frame.camera.fx = frame.camera.fy = 52.0, frame.camera.cx = 31.5, frame.camera.cy = 23.5;
  frame.moment.world_from_camera =
      Transform<World, Camera>{{1.0, 0.0, 0.0, 0.0}, {0.0, 0.0, 2.0 - distance_m}};
  compare::Stack stack;
  std::vector<ReadFrame> frames;
  for (int i = 0; i < 6; ++i) {
    Image<float> range(64, 48);
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x)
        range(x, y) = static_cast<float>(read_m(x, y, distance_m / rayThroughPixel(frame.camera, x, y).v.z));
    }
    frame.planes = {toPlane(PlaneKind::Range, std::move(range))};
    EXPECT_TRUE(stack.add(frame));
    frames.push_back(*readOf(frame));
  }
  return seenOf(plan, {.number = number, .block = "b", .kind = "distance"}, stack, frames, frequency_hz);
}

WallSeen wallFrom(double distance_m, std::size_t number, bool has_size) {
  std::mt19937_64 random{kWrapSeed + number};
  std::normal_distribution<double> noise_m{0.0, 0.05};
  WallSeen made;
  const auto read = [&](int, int, double truth) {
    const double read_m = truth + noise_m(random);
    ++made.readings, made.wraps += read_m >= kTurn_m;
    return read_m - kTurn_m * std::floor(read_m / kTurn_m);
  };
  made.seen = wallReadBy(read, distance_m, number, has_size, {kLight_hz});
  return made;
}

/// At 20 and 60 MHz, every eighth column is a period of 60 MHz too near: wraps, from which the rest of the
/// wall does not suffer, as all frequencies together go three times as far.
TEST(Wraps, AreOfTheHighestFrequencyAndDoNotSpoilTheRestOfTheWall) {
  const auto read = [](int x, int, double truth) { return x % 8 == 0 ? truth - kTurn_m / 3.0 : truth; };
  const CameraSeen seen = wallReadBy(read, 5.0, 0, true, {kLight_hz, 3.0 * kLight_hz});
  EXPECT_EQ(seen.wall_readings, 6.0 * 64.0 * 48.0);
  EXPECT_EQ(seen.wall_wraps, 6.0 * 8.0 * 48.0);
  EXPECT_EQ(seen.wall_beyond, 0.0);
  EXPECT_FALSE(isWrapped(seen));
}

/// A box before the left half, and eight columns of which three are valid: neither says anything of the wall.
TEST(Wraps, AreNotCountedWhereTheWallIsNotSeen) {
  const auto read = [](int x, int, double truth) {
    return x < 32 ? 1.0 : x >= 35 && x < 40 ? std::nan("") : truth;
  };
  const CameraSeen seen = wallReadBy(read, 5.0, 0, true, {kLight_hz});
  EXPECT_EQ(seen.wall_readings, 6.0 * 24.0 * 48.0);
  EXPECT_EQ(seen.wall_wraps, 0.0);
}

/// 6.6 m wraps in the image's corners, 9.5 m all over. A reading that noise took over 0 is not told from one
/// behind.
TEST(Wraps, AreCountedOfAllReadingsOfTheWall) {
  for (const bool has_size : {false, true}) {
    const WallSeen near = wallFrom(2.0, 0, has_size), part = wallFrom(6.6, 1, has_size),
                   far = wallFrom(9.5, 2, has_size);
    EXPECT_EQ(near.seen.wall_readings, near.readings);
    EXPECT_EQ(near.seen.wall_wraps, 0.0);
    EXPECT_GT(part.wraps, 0.1 * part.readings);
    EXPECT_EQ(part.seen.wall_readings, part.readings);
    EXPECT_EQ(part.seen.wall_wraps, part.wraps);
    EXPECT_EQ(far.seen.wall_wraps, far.readings);
    EXPECT_TRUE(far.seen.wall_error_mm.empty());
    EXPECT_TRUE(isWrapped(far.seen) && isWrapped(part.seen) && !isWrapped(near.seen));
  }
}

/// What noise does not take over the period reads too near: cells of which a part wraps are no errors.
TEST(Wraps, LeaveNoErrorBehindInCellsThatWrapInPart) {
  const WallSeen part = wallFrom(6.6, 1, true);
  ASSERT_FALSE(part.seen.wall_error_mm.empty());
  // The mean of a cell of 64 pixels in six frames: 50 mm / √384 = 2.6 mm; five of them are 6e-7 for each of
  // 48 cells. A share of 1 % cut off shifts it by 1.3 mm more.
  for (const double error_mm : part.seen.wall_error_mm) EXPECT_NEAR(error_mm, 0.0, 5.0 * 2.6 + 1.3);
}

/// Means of six frames err by 163 mm: cells hold the wall's 120 mm of error, each to 138/√64/0.71 = 24 mm, 48
/// of them to 3.5. Of a surface 460 mm behind the wall, with 60 mm, noise brings a pixel in 260 within 300 mm
/// of it, four in 1e-4 of the cells: no cell is of the wall.
TEST(WallCells, AreCutAboutTheirMeanButNotAboutAnotherSurfaces) {
  const auto seenOff = [](double off_m, double noise_of_mean_m) {
    std::mt19937_64 random{kWrapSeed};
    std::normal_distribution<double> noise_m{off_m, noise_of_mean_m * std::sqrt(6.0)};
    return wallReadBy([&](int, int, double truth) { return truth + noise_m(random); }, 5.0, 0, true, {});
  };
  const CameraSeen wall = seenOff(0.12, 0.163), other = seenOff(0.46, 0.06);
  ASSERT_EQ(wall.wall_error_mm.size(), 48u);
  double mean_mm = 0.0;
  for (const double error_mm : wall.wall_error_mm) mean_mm += error_mm / 48.0;
  EXPECT_NEAR(mean_mm, 120.0, 4.0 * 3.5);
  EXPECT_THAT(other.wall_error_mm, testing::IsEmpty());
}

/// A wave of 0.468 m, in an image in which a cell of 8 × 8 pixels spans up to 0.3 m of a wall 3.6 m away: means of
/// cells would show 7.5 mm. Steps of 25 mm show 0.995 of it; noise of 2 mm leaves some tenths of a per cent.
TEST(Waves, ShorterThanACellIsWideAreToldAsLargeAsTheyAre) {
  constexpr double kFast_hz = 80e6, kWave_mm = 8.42;
  const double per_m = 16.0 * std::numbers::pi * kFast_hz / 299'792'458.0;
  std::mt19937_64 random{kWrapSeed};
  std::normal_distribution<double> noise_m{0.0, 0.002};
  ComparedRun run;
  run.frequency_hz = {std::vector{kFast_hz}, std::vector{kFast_hz}};
  for (const double distance_m : {0.7, 0.9, 1.1, 1.4, 1.8, 2.1, 2.5, 2.9, 3.6}) {
    ComparedCapture& one = run.captures.emplace_back();
    one.pixels = 15, one.record.number = run.captures.size(), one.record.kind = "distance";
    const auto read = [&](int, int, double truth) {
      return truth + 1e-3 * kWave_mm * std::sin(per_m * truth) + noise_m(random);
    };
    one.seen[0] = one.seen[1] = wallReadBy(read, distance_m, one.record.number, true, {kFast_hz});
  }
  const RunTraits all = traitsOf(run);
  const auto found = std::ranges::find_if(all.traits, [](const RunTrait& one) {
    return one.of == "A" && one.trait.name == "80 MHz, 4 per period";
  });
  ASSERT_NE(found, all.traits.end());
  EXPECT_NEAR(found->trait.value, 0.995 * kWave_mm, 0.01 * kWave_mm);
}

TEST(Wraps, AreNoWavesOfTheCameraAndWhatIsLeftOutIsSaid) {
  ComparedRun run;
  run.frequency_hz = {std::vector{kLight_hz}, std::vector{kLight_hz}};
  double readings = 0.0, wraps = 0.0;
  for (const double distance_m : {0.7, 1.0, 1.4, 1.8, 2.3, 2.9, 3.6, 4.4, 5.4, 6.6, 9.5}) {
    const std::size_t number = run.captures.size();
    const WallSeen made = wallFrom(distance_m, number, true);
    ComparedCapture one;
    one.pixels = 15, one.range_a_mm = 1e3 * distance_m;
    // B − A of pixels that both wrap is small, at a range at which no wall stands.
    one.difference_mm = distance_m > 6.0 ? 500.0 : 0.0;
    one.record.number = number, one.record.name = fmt::format("{} m", distance_m);
    one.record.block = "b", one.record.kind = "distance";
    one.thinned.valid_a = one.thinned.valid_b = Image<float>(4, 4, 1.0F);
    one.seen = {made.seen, made.seen};
    readings += made.readings, wraps += made.wraps;
    run.captures.push_back(one);
  }
  const RunTraits all = traitsOf(run);
  std::size_t waves = 0;
  for (const RunTrait& one : all.traits) {
    if (one.what == "wraps") {
      EXPECT_NEAR(one.trait.value, wraps / readings, 1e-12);
    }
    if (!one.what.starts_with("harmonics") || !one.trait.name.ends_with("per period")) continue;
    ++waves;
    EXPECT_LT(one.trait.low, 1.0) << one.what << ' ' << one.of << ' ' << one.trait.name;
  }
  EXPECT_GT(waves, 0u);
  for (const char* whose : {"harmonics of A at 6.6 m; 9.5 m: 2 of 11 captures are left out",
                            "harmonics of B at 6.6 m; 9.5 m: 2 of 11 captures are left out",
                            "harmonics of B − A at 6.6 m; 9.5 m: 2 of 11 captures are left out"})
    EXPECT_THAT(all.untold, testing::Contains(testing::HasSubstr(whose)));
}

/// A capture of the distance block, of 20 × 20 pixels that both see; B is off by so much in all of them.
ComparedCapture comparedOffBy(float difference_mm, std::size_t number) {
  ComparedCapture one;
  one.record.number = number, one.record.block = "distance", one.record.kind = "distance";
  one.record.a.source = "cam", one.record.b.source = "twin";
  one.pixels = compare::isGross(static_cast<double>(difference_mm)) ? 0 : 400;
  auto& image = one.thinned;
  image.range_a_mm = Image<float>(20, 20, 3000.0F), image.difference_mm = Image<float>(20, 20, difference_mm);
  image.noise_a_mm = image.noise_b_mm = Image<float>(20, 20, 5.0F);
  image.valid_a = image.valid_b = Image<float>(20, 20, 1.0F);
  image.edge = image.flying_a = image.flying_b = Image<std::uint8_t>(20, 20);
  return one;
}

/// At one of two distances B is a period too near all over: nothing is left there to compare.
TEST(Wraps, AreTheFirstThingThatAReportSays) {
  ComparedRun run;
  run.captures = {comparedOffBy(1.0F, 0), comparedOffBy(-2498.0F, 1)};
  const auto finding = judgeRun(run);
  ASSERT_TRUE(finding) << finding.error().message;
  EXPECT_THAT(
      finding->headline,
      testing::StartsWith("50 % of what both see on surfaces is over 300 mm apart, and is in none of the "
                          "other numbers; at 1 of the poses nothing else is seen. twin (B) is within 1.0 mm"));
  EXPECT_EQ(finding->section.tone, compare::Tone::Bad);
  std::string row;
  for (const compare::Block& block : finding->section.blocks) {
    const auto* table = std::get_if<compare::TableBlock>(&block);
    if (table != nullptr && table->header.front() == "block")
      row = fmt::format("{}", fmt::join(table->rows[0], "|"));
  }
  EXPECT_THAT(row, testing::StartsWith("distance|of 2 captures, 1 have nothing within 300 mm|50 %|1.00|"));
  run.captures.erase(run.captures.begin());
  EXPECT_THAT(judgeRun(run).error().message,
              testing::HasSubstr("over 300 mm apart: there is nothing to compare"));
}

}  // namespace
}  // namespace toftwin::plan
