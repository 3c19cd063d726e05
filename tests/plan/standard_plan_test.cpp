// SPDX-License-Identifier: Apache-2.0
// The standard plan as it ships, carried out on two small simulated cameras and judged: every characteristic
// that docs/characteristics.md says it tells is there for both.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>
#include <map>
#include <sstream>

#include "calib/compare/json_parse.h"
#include "tests/tools/with_daemon.h"

namespace toftwin::cli {
namespace {

constexpr const char* kPlans = TOFTWIN_SOURCE_DIR "/docs/examples/plans/";

/// {0}: how it measures range; {1}: more effects.
constexpr const char* kSmall = R"(model = "small"
[lens]
width = 96
height = 72
fx = 90.0
fy = 90.0
cx = 47.5
cy = 35.5
[[emitter]]
position_mm = [40.0, 0.0, 0.0]
power_w = 1.0
[pixel]
electrons_per_radiance_s = 3e9
{}
[[effect]]
type = "shot_noise"
[[effect]]
type = "read_noise"
[[effect]]
type = "warm_up"
[[effect]]
type = "ambient_light"
[[effect]]
type = "low_amplitude_filter"
minimum_electrons = 60.0
{}
)";
constexpr const char* kOneFrequency = R"([[modulation]]
frequency_mhz = 20.0
exposure_us = 1000.0
[sampling]
steps = 4
frame_interval_ms = 33.333333
[decoder]
algorithm = "n_phase"
nearest_m = 0.1
farthest_m = 7.4
)";
constexpr const char* kKinectV2 = R"([[modulation]]
frequency_mhz = 80.0
exposure_us = 1000.0
[[modulation]]
frequency_mhz = 16.0
exposure_us = 1000.0
[[modulation]]
frequency_mhz = 120.0
exposure_us = 1000.0
[sampling]
steps = 3
frame_interval_ms = 33.333333
[decoder]
algorithm = "kinect_v2"
nearest_m = 0.1
farthest_m = 18.7
)";
/// What A has and the twin has not.
constexpr double kVeil = 0.03, kLag = 0.05;

/// Within its interval, which is short enough to tell what is planted from nothing. A Kinect v2's amplitude,
/// over which the veil's light is taken, is a mean of three that a veil changes differently: a closed form of
/// these five captures without noise reads 0.0310 of 0.03 (and 0.0300 of 20 MHz), hence 4 %.
void expectVeil(const std::string& whose, const compare::Json& row, double planted) {
  const double low = row.find("low")->number(), high = row.find("high")->number();
  testing::Test::RecordProperty(
      "veil_" + whose, fmt::format("{:.4f} ({:.4f} to {:.4f})", row.find("value")->number(), low, high));
  EXPECT_GE(high + 0.04 * planted, planted) << whose;
  EXPECT_LE(low - 0.04 * planted, planted) << whose;
  EXPECT_LT(0.5 * (high - low), 0.5 * kVeil) << low << " to " << high;
}

class StandardPlan : public WithDaemon {
 protected:
  virtual std::string rangesBy() const { return kOneFrequency; }
  std::string moreSources() const override {
    const auto write = [&](const std::string& name, const std::string& text) {
      std::ofstream{folder_ / name} << text;
    };
    write("cam.toml",
          fmt::format(kSmall, rangesBy(),
                      fmt::format("[[effect]]\ntype = 'lens_scatter'\nveil = {}\nhalo = 0.0\n"
                                  "[[effect]]\ntype = 'lag'\nexposure_share = 0.0\nframe_share = {}\n",
                                  kVeil, kLag)));
    write("twin.toml", fmt::format(kSmall, rangesBy(), ""));
    std::string all;
    for (const auto& [name, seed] : {std::pair{"cam", 1}, {"twin", 2}}) {
      for (const char* scene : {"wall", "checkerboard", "bright-dark", "foreground", "scatter", "corner-60",
                                "corner-90", "corner-120", "moving", "dark"}) {
        const bool is_wall = std::string{scene} == "wall";
        all += fmt::format(
            "[[source]]\nname = '{0}{1}'\ndriver = 'sim'\ncamera = '{0}.toml'\nscene = '{2}scenes/{3}.toml'\n"
            "samples_per_pixel = 4\nmax_surfaces = 2\nseed = {4}\n",
            name, is_wall ? "" : fmt::format(".{}", scene), kPlans, scene, seed);
      }
    }
    return all;
  }
  compare::Json characteristics() const {
    std::stringstream text;
    text << std::ifstream{folder_ / "report" / "report.json"}.rdbuf();
    const auto json = compare::parseJson(text.str());
    EXPECT_TRUE(json);
    return json ? *json->find("run")->find("characteristics") : compare::Json{};
  }
};

TEST_F(StandardPlan, TellsEveryCharacteristicOfBothCameras) {
  const Ran measured =
      run(fmt::format("measure {}standard.toml cam twin -o {} --prepared", kPlans, path("run")));
  ASSERT_EQ(measured.status, 0) << measured.err;
  const Ran compared =
      toftwin(fmt::format("compare {} -o {} --log {}", path("run"), path("report"), path("lab.sqlite")));
  ASSERT_EQ(compared.status, 0) << compared.err;
  EXPECT_THAT(compared.out, testing::HasSubstr("Note: 3 captures of a moving plate are not compared pixel by pixel"));
  const Ran locked = toftwin(fmt::format("compare {} --locked -o {}", path("run"), path("locked")));
  ASSERT_EQ(locked.status, 0) << locked.err;
  EXPECT_THAT(locked.out, testing::HasSubstr("index.html"));
  EXPECT_THAT(locked.out, testing::Not(testing::HasSubstr("moving plate"))) << "none of them is locked";
  const compare::Json told = characteristics();
  std::map<std::string, compare::Json> found;
  std::string names;
  for (std::size_t i = 0; i < told.find("rows")->size(); ++i) {
    const compare::Json& row = told.find("rows")->at(i);
    const std::string key = row.find("of")->words() + ": " + row.find("characteristic")->words() + ": " +
                            row.find("name")->words();
    found[key] = row;
    names += fmt::format("{}  {:.4g} [{:.4g}, {:.4g}] {} #{}\n", key, row.find("value")->number(),
                         row.find("low")->number(), row.find("high")->number(), row.find("unit")->words(),
                         row.find("n")->number());
  }
  for (std::size_t i = 0; i < told.find("untold")->size(); ++i)
    names += "untold: " + told.find("untold")->at(i).words() + "\n";
  for (const char* of : {"A: ", "B: "}) {
    for (const char* what : {"harmonics, against the plan's wall: 20 MHz, 4 per period",
                             "error over amplitude, against the plan's wall",
                             "ambient light: noise²",
                             "noise law: read",
                             "frame timing: interval",
                             "frame timing: jitter",
                             "frame timing: lost",
                             "wraps: wrapped",
                             "noise of frames",
                             "lag of the first frame recorded: left behind",
                             "corner-60: 0.1 to 0.3 m from the edge",
                             "corner-90: 0.3 to 0.9 m from the edge",
                             "corner-120: 0 to 0.1 m from the edge",
                             "lens scatter: veil",
                             "flying pixels: flying",
                             "emitter shadow: asymmetry",
                             "edge in the amplitude: 10-90 width",
                             "edge in the amplitude: resolution",
                             "motion, right end − left end: per speed",
                             "drift"}) {
      const auto at = found.lower_bound(std::string{of} + what);
      EXPECT_TRUE(at != found.end() && at->first.starts_with(std::string{of} + what)) << of << what << "\n"
                                                                                      << names;
    }
  }
  for (const char* both : {"B − A: harmonics: 20 MHz, 4 per period", "B − A: latency: latency",
                           "A and B: masks: kappa", "B − A: error over amplitude: per decade"})
    EXPECT_TRUE(found.contains(both)) << both << "\n" << names;
  for (std::size_t i = 0; i < told.find("untold")->size(); ++i)
    EXPECT_THAT(told.find("untold")->at(i).words(), testing::HasSubstr("of the period of 20 MHz")) << names;
  // What A has and B has not. The frame before stays with b/(1 + b) of a change.
  const auto value = [&](const std::string& key) { return found.at(key).find("value")->number(); };
  EXPECT_NEAR(value("A: lag of the first frame recorded: left behind"), kLag / (1.0 + kLag), 2e-3);
  EXPECT_NEAR(value("B: lag of the first frame recorded: left behind"), 0.0, 2e-3);
  expectVeil("A", found.at("A: lens scatter: veil"), kVeil);
  expectVeil("B", found.at("B: lens scatter: veil"), 0.0);
  // What was planted in A alone is among what the page begins with, and where it is from is at its end.
  std::stringstream text;
  text << std::ifstream{folder_ / "report" / "index.html"}.rdbuf();
  const std::string page = text.str();
  const auto verdicts = page.find("B against A, number by number"),
             lag = page.find("left behind</td><td>differs, ");
  EXPECT_LT(verdicts, page.find("Drift of A and of B while warming up"));
  EXPECT_LT(page.find("Drift of A and of B while warming up"), page.find("B − A by block"));
  ASSERT_NE(page.find("The other numbers: B is the same as A"), std::string::npos);
  EXPECT_LT(page.find("B − A by block"), page.find("The other numbers: B is the same as A"));
  for (const char* drawn :
       {"Error over distance", "Temporal noise over amplitude", "Temporal noise over distance",
        "Fixed pattern over distance", "Fixed pattern over amplitude"})
    EXPECT_NE(page.find(std::string{"aria-label='"} + drawn), std::string::npos) << drawn;
  EXPECT_NE(lag, std::string::npos);
  EXPECT_NE(page.find("Drift of A and of B while warming up"), std::string::npos);
  EXPECT_NE(page.find("<figure class='cloud alone'"), std::string::npos);
  EXPECT_NE(page.find("<td>plan_seed</td><td>2026</td>", page.find("id='provenance'")),
            std::string::npos);
  EXPECT_THAT(toftwin("log " + path("lab.sqlite") + " --settings 1").out,
              testing::AllOf(testing::HasSubstr("frequency_mhz"),
                             testing::HasSubstr("250, 500, 750, 1000, 1250, 1500"),
                             testing::HasSubstr("lens_scatter, lag")));
  EXPECT_THAT(toftwin("log " + path("lab.sqlite")).out, testing::HasSubstr("standard"));
  EXPECT_THAT(toftwin("log " + path("lab.sqlite") + " --hdf5 " + path("numbers.h5")).out,
              testing::HasSubstr(" numbers"));
  const Ran trend = toftwin("trend " + path("lab.sqlite") + " --camera cam --characteristic 'lens scatter'");
  EXPECT_THAT(trend.out, testing::AllOf(testing::HasSubstr("lens scatter: veil [1], A cam"),
                                        testing::HasSubstr("the first")));
  EXPECT_THAT(toftwin("trend " + path("lab.sqlite") + " --camera nobody").err,
              testing::HasSubstr("no camera begins with \"nobody\"; there are: cam, twin"));
  EXPECT_THAT(toftwin("log " + path("none.sqlite")).err, testing::HasSubstr("there is no such log"));
}

class StandardPlanOfAKinect : public StandardPlan {
  std::string rangesBy() const override { return kKinectV2; }
};

/// The decoder's weights of 80, 16 and 120 MHz are what joins the frequencies' errors.
TEST_F(StandardPlanOfAKinect, TellsLensScatterByItsDecodersWeights) {
  const Ran measured =
      run(fmt::format("measure {}standard.toml cam twin -o {} --prepared --skip "
                      "warm-up,exposure,ambient,tilt,near-field,checkerboard,bright-dark,corner-60,corner-90,"
                      "corner-120,moving,dark,"
                      "locked,end",
                      kPlans, path("run")));
  ASSERT_EQ(measured.status, 0) << measured.err;
  const Ran compared = toftwin(fmt::format("compare {} -o {}", path("run"), path("report")));
  ASSERT_EQ(compared.status, 0) << compared.err;
  const compare::Json told = characteristics();
  std::map<std::string, compare::Json> veil;
  for (std::size_t i = 0; i < told.find("rows")->size(); ++i) {
    const compare::Json& row = told.find("rows")->at(i);
    if (row.find("characteristic")->words() == "lens scatter") veil[row.find("of")->words()] = row;
  }
  ASSERT_EQ(veil.size(), 2u);
  expectVeil("A", veil["A"], kVeil);
  expectVeil("B", veil["B"], 0.0);
}

}  // namespace
}  // namespace toftwin::cli
