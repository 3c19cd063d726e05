// SPDX-License-Identifier: Apache-2.0
// A at one daemon and B at another: each has one of the two sources only.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>

#include "calib/compare/json_parse.h"
#include "calib/plan/run_index.h"
#include "tests/plan/tiny_camera.h"
#include "tests/tools/with_daemon.h"

namespace toftwin::cli {
namespace {

using testing::HasSubstr;

constexpr double kOffset_mm = 10.0;

class TwoDaemons : public WithDaemon {
 protected:
  std::string moreSources() const override { return source("cam", 1, kOffset_mm); }
  void SetUp() override {
    write("wall.toml",
          "[[material]]\nname = 'wall'\nalbedo = 0.6\n[[object]]\nshape = 'rectangle'\nsize_m = [12, 12, 0]\n"
          "position_m = [0, 0, 2]\nmaterial = 'wall'\n");
    write("plan.toml",
          "name = 'small'\nframes = 8\n[[block]]\nname = 'd'\nkind = 'distance'\ndistance_m = [0.8, 1.2, "
          "1.6]\n");
    write("poses.toml", "[[pose]]\nposition_m = [0.0, 0.0, 0.8]\n[[pose]]\nposition_m = [0.0, 0.0, 0.4]\n");
    WithDaemon::SetUp();
    write("other.toml",
          fmt::format("[listen]\naddress = ''\nsocket = '{}'\n{}", otherSocket(), source("twin", 2, 0.0)));
    other_.emplace(std::vector<std::string>{TOFTWIN_DAEMON, "--config", (folder_ / "other.toml").string()});
    ASSERT_TRUE(eventually([&] { return std::filesystem::exists(otherSocket()); }))
        << "toftwind did not start";
  }
  std::string source(const std::string& name, int seed, double offset_mm) const {
    write(name + ".toml", fmt::format(kTinyCamera, name, offset_mm));
    return fmt::format(
        "[[source]]\nname = '{0}'\ndriver = 'sim'\ncamera = '{0}.toml'\nscene = 'wall.toml'\nmax_surfaces = "
        "1\n"
        "pixel_extent = 0.0\nseed = {1}\n",
        name, seed);
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream{folder_ / name} << text;
  }
  std::string otherSocket() const { return (folder_ / "t").string(); }
  std::string both() const { return " --address-b unix:" + otherSocket(); }
  /// Mean of B − A on surfaces, of a report's section.
  double bias_mm(const std::string& report, const std::string& section) const {
    std::ifstream in{folder_ / report / "report.json"};
    const auto json = compare::parseJson(std::string{std::istreambuf_iterator<char>{in}, {}});
    EXPECT_TRUE(json);
    const compare::Json* found = json ? json->find(section) : nullptr;
    if (found == nullptr) return std::nan("");
    return found->find("regions")->at(0).find("difference")->find("mean")->number();
  }

  std::optional<Background> other_;
};

TEST_F(TwoDaemons, CompareWhatEachServesAlone) {
  const Ran ran = run("compare cam twin --poses " + path("poses.toml") + " --frames 8 -o " +
                      path("r") + both());
  ASSERT_EQ(ran.status, 0) << ran.err;
  // 2 poses × 432 pixels × 8 frames of two cameras with far less than 10 mm of noise.
  EXPECT_NEAR(bias_mm("r", "live"), -kOffset_mm, 0.5) << ran.out;
}

TEST_F(TwoDaemons, CarryAPlanOutAndTheTwinFollowsFromTheOther) {
  const Ran ran =
      run(fmt::format("measure {} cam twin -o {} --prepared{}", path("plan.toml"), path("run"), both()));
  ASSERT_EQ(ran.status, 0) << ran.err;
  const auto index = plan::readIndex(folder_ / "run" / plan::kIndexFile);
  ASSERT_TRUE(index) << index.error().message;
  ASSERT_EQ(index->size(), 3u);
  for (const auto& [number, one] : *index) {
    EXPECT_EQ(one.a.source, "cam");
    EXPECT_EQ(one.b.source, "twin");
    EXPECT_NEAR(one.b.since_power_on_s, one.a.since_power_on_s, 1e-6) << "the twin was set to A's time";
  }
  ASSERT_EQ(toftwin("compare " + path("run") + " -o " + path("r")).status, 0);
  EXPECT_NEAR(bias_mm("r", "run"), -kOffset_mm, 0.5);
}

TEST_F(TwoDaemons, SayWhichOneLacksTheSourceOrIsGone) {
  const Ran swapped =
      run("compare twin cam --poses " + path("poses.toml") + " -o " + path("r") + both());
  EXPECT_NE(swapped.status, 0);
  EXPECT_THAT(swapped.err, HasSubstr("no source \"twin\""));
  other_->end(SIGTERM);
  const Ran gone =
      run("compare cam twin --poses " + path("poses.toml") + " -o " + path("r") + both());
  EXPECT_EQ(gone.status, 3) << gone.err;
  EXPECT_THAT(gone.err, HasSubstr(otherSocket()));
}

}  // namespace
}  // namespace toftwin::cli
