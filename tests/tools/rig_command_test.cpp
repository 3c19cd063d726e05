// SPDX-License-Identifier: Apache-2.0
// `toftwin rig` and `toftwin compare --rig` against an emulated controller and the real daemon.
#include "tests/drivers/emulated_rig.h"
#include "with_daemon.h"

namespace toftwin::cli {
namespace {

using testing::HasSubstr;

class Rigged : public WithDaemon {
 protected:
  void SetUp() override {
    WithDaemon::SetUp();
    std::ofstream{folder_ / "rig.toml"} << rig_.file();
    std::ofstream{folder_ / "poses.toml"} << "[[pose]]\nname = 'near'\nposition_m = [0.05, 0, 0]\n"
                                             "[[pose]]\nname = 'far'\nposition_m = [0.2, 0, 0]\n";
  }
  std::string moreSources() const override {
    return "[[source]]\nname = 'twin'\ndriver = 'pattern'\nwidth = 64\nheight = 48\n"
           "frame_rate_hz = 200\n";
  }
  Ran compare() {
    return run("compare pattern twin --frames 2 --poses " + path("poses.toml") +
               " --rig " + path("rig.toml") + " -o " + path("report"));
  }
  std::string log() {
    std::ifstream file{folder_ / "report" / "log.jsonl"};
    return {std::istreambuf_iterator<char>{file}, {}};
  }
  test::EmulatedRig rig_;
};

TEST_F(Rigged, ItMovesAndSaysWhereItStands) {
  const Ran moved = toftwin("rig move " + path("rig.toml") + " --axis x=120.5");
  EXPECT_EQ(moved.status, 0) << moved.err;
  EXPECT_NEAR(rig_.load(0), 120.5, 0.05);
  EXPECT_THAT(moved.out, HasSubstr("x               120.500 mm"));
  const Ran status = toftwin("rig status --json " + path("rig.toml"));
  EXPECT_EQ(status.status, 0) << status.err;
  EXPECT_THAT(status.out, HasSubstr("\"x\": 120.5"));
  EXPECT_EQ(toftwin("rig stop " + path("rig.toml")).status, 0);
  EXPECT_TRUE(rig_.isStopped());
  EXPECT_THAT(toftwin("rig status " + path("rig.toml")).out, HasSubstr("stopped"));
  EXPECT_EQ(toftwin("rig home " + path("rig.toml")).status, 0);
  EXPECT_NEAR(rig_.load(0), 0.0, 0.05);
}

TEST_F(Rigged, WhatItCannotDoIsRefusedBeforeItMoves) {
  EXPECT_EQ(toftwin("rig move " + path("rig.toml") + " --axis x=500").status, 4);
  EXPECT_EQ(toftwin("rig move " + path("rig.toml") + " --axis y=5").status, 4);
  EXPECT_EQ(toftwin("rig move " + path("rig.toml") + " --position 0,1,0").status, 4);
  EXPECT_EQ(toftwin("rig move " + path("rig.toml")).status, 2);
  EXPECT_EQ(toftwin("rig status " + path("nothing.toml")).status, 4);
  EXPECT_EQ(rig_.departures(), 0);
}

TEST_F(Rigged, AComparisonGoesFromPoseToPose) {
  const Ran ran = compare();
  ASSERT_EQ(ran.status, 0) << ran.err;
  EXPECT_EQ(rig_.departures(), 2);
  EXPECT_NEAR(rig_.load(0), 200.0, 0.05);
  EXPECT_THAT(log(), HasSubstr("{\"axes\": {\"x\": 200,\"turn\": 0},\"temperatures_c\": {\"room\": "
                               "0},\"pose\": \"far\""));
}

TEST_F(Rigged, AComparisonEndsAtAPoseThatIsNotReached) {
  rig_.stallAt(100.0);
  const Ran ran = compare();
  EXPECT_NE(ran.status, 0);
  EXPECT_THAT(ran.err, HasSubstr("nothing was captured at \"far\": the rig has stalled"));
  EXPECT_TRUE(rig_.isStopped());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "report" / "index.html"));
}

TEST_F(Rigged, ThePlcHasFramesTaken) {
  rig_.leaveCaptured();
  Background following{{TOFTWIN_PROGRAM, "rig", "follow", (folder_ / "rig.toml").string(),
                        "pattern", "--captures", "2", "--address", "unix:" + socket()}};
  for (int i = 0; i < 2; ++i) {
    rig_.setTrigger(false);
    // It says that it has seen the trigger go by taking "captured" back.
    ASSERT_TRUE(eventually([&] { return !rig_.isCaptured(); }));
    rig_.setTrigger(true);
    ASSERT_TRUE(eventually([&] { return rig_.isCaptured(); }));
  }
  EXPECT_EQ(following.wait(), 0);
}

}  // namespace
}  // namespace toftwin::cli
