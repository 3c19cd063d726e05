// SPDX-License-Identifier: Apache-2.0
// `toftwin pose`, `set`, `trigger`, `compliance`, and what `list` says of a camera that is not
// there.
#include "with_daemon.h"

#include <fmt/format.h>

namespace toftwin::cli {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Steered : public WithDaemon {
 protected:
  std::string moreSources() const override {
    return "[[source]]\nname = 'asked'\ndriver = 'pattern'\npace = 'trigger'\n"
           "[[source]]\nname = 'absent'\ndriver = 'pattern'\nuri = 'pattern:9'\n";
  }
};

TEST_F(Steered, APoseIsSetAndShown) {
  const Ran before = run("pose pattern");
  EXPECT_EQ(before.status, 0) << before.err;
  EXPECT_THAT(before.out, HasSubstr("position     0, 0, 0 m"));
  const Ran set = run("pose pattern --position -0.5,0.25,-1 --look-at -0.5,0.25,3");
  EXPECT_EQ(set.status, 0) << set.err;
  EXPECT_THAT(run("info pattern").out, HasSubstr("position     -0.5, 0.25, -1 m"));
  EXPECT_THAT(run("pose pattern --json").out, HasSubstr("\"position_m\": [-0.5, 0.25, -1]"));
}

TEST_F(Steered, WhatAPoseDoesNotSayStaysAsItIs) {
  // A quarter turn about y: the axis, z before, is x.
  ASSERT_EQ(run("pose pattern --position 1,2,3 --euler-deg 0,90,0").status, 0);
  EXPECT_THAT(run("pose pattern --position 4,5,6").out, HasSubstr("looks along  1, 0, "));
  EXPECT_THAT(run("pose pattern --rotation-wxyz 1,0,0,0").out, HasSubstr("position     4, 5, 6 m"));
}

TEST_F(Steered, APoseThatIsNoneIsRefused) {
  EXPECT_EQ(run("pose pattern --look-at 0,0,0").status, 4) << "the camera is there already";
  EXPECT_EQ(run("pose pattern --rotation-wxyz 0,0,0,0").status, 4);
  EXPECT_EQ(run("pose pattern --position nan,0,0").status, 4);
  EXPECT_EQ(run("pose pattern --look-at 0,0,1 --euler-deg 0,1,0").status, 2);
  EXPECT_THAT(run("pose pattern").out, HasSubstr("position     0, 0, 0 m"));
}

TEST_F(Steered, ParametersAreShownWithTheirBoundsAndSet) {
  EXPECT_THAT(run("set pattern").out, HasSubstr("speed_px  1            0 to 64"));
  EXPECT_EQ(run("set pattern speed_px 3").status, 0);
  EXPECT_THAT(run("set pattern speed_px").out, HasSubstr("speed_px  3 "));
  EXPECT_THAT(run("info pattern --json").out, HasSubstr("\"value\": 3"));
  const Ran outside = run("set pattern speed_px 65");
  EXPECT_EQ(outside.status, 4);
  EXPECT_THAT(outside.err, HasSubstr("0 to 64"));
  const Ran unknown = run("set pattern speed");
  EXPECT_EQ(unknown.status, 4);
  EXPECT_THAT(unknown.err, HasSubstr("it has: speed_px"));
  const Ran word = run("set pattern speed_px fast");
  EXPECT_EQ(word.status, 4);
  EXPECT_THAT(word.err, HasSubstr("must be a number"));
}

TEST_F(Steered, AParameterIsSetByOneWordAsRecipesHaveIt) {
  const Ran set = run("set pattern speed_px=5");
  EXPECT_EQ(set.status, 0) << set.err;
  EXPECT_THAT(set.out, HasSubstr("speed_px  5 "));
  EXPECT_EQ(run("set pattern speed_px=65").status, 4);
  for (const std::string wrong : {"=3", "speed_px=3 4"}) {
    const Ran ran = run("set pattern " + wrong);
    EXPECT_EQ(ran.status, 2) << wrong;
    EXPECT_THAT(ran.err, HasSubstr("KEY=VALUE")) << wrong;
  }
  for (const std::string wrong : {"speed_px=", "speed_px=fast", "speed_px=3mm"})
    EXPECT_EQ(run("set pattern " + wrong).status, 4) << wrong;
  EXPECT_THAT(run("set pattern speed_px").out, HasSubstr("speed_px  5 "));
}

#ifdef TOFTWIN_HAS_ARAVIS
/// The pattern as a GigE Vision camera, and that again as a source, whose features are choices and texts.
class SteeredFeatures : public WithDaemon {
 protected:
  std::string moreSources() const override {
    const auto pid = static_cast<unsigned>(::getpid());
    const std::string address = fmt::format("127.{}.{}.21", 1 + pid % 199, pid / 199 % 251);
    return fmt::format(
        "[[facade]]\nkind = 'gige_vision'\nsource = 'pattern'\naddress = '{0}'\n"
        "[[source]]\nname = 'gige'\ndriver = 'aravis'\nuri = 'aravis:{0}'\n"
        "parameters = ['Scan3dCoordinateSystem', 'DeviceUserID']\n",
        address);
  }
};

TEST_F(SteeredFeatures, AreShownWithTheirChoicesAndSetByName) {
  ASSERT_TRUE(eventually([&] { return run("set gige").status == 0; })) << run("list").out;
  EXPECT_THAT(run("set gige").out,
              HasSubstr("Scan3dCoordinateSystem  Cartesian    one of Cartesian, Spherical"));
  const Ran set = run("set gige Scan3dCoordinateSystem Spherical");
  EXPECT_EQ(set.status, 0) << set.err;
  EXPECT_THAT(run("info gige --json").out, AllOf(HasSubstr("\"text\": \"Spherical\""),
                                                 HasSubstr("\"choices\": [\"Cartesian\", \"Spherical\"]")));
  const Ran unknown = run("set gige Scan3dCoordinateSystem Cylindrical");
  EXPECT_EQ(unknown.status, 4);
  EXPECT_THAT(unknown.err, HasSubstr("one of: Cartesian, Spherical"));
  const Ran number = run("set gige DeviceUserID 7");
  EXPECT_EQ(number.status, 0) << number.err << ": what it is called may be a number";
  EXPECT_THAT(run("set gige DeviceUserID").out, HasSubstr("DeviceUserID  7"));
}
#endif

TEST_F(Steered, AStandardOutputThatIsFullIsStatus6) {
  for (const std::string arguments : {"list", "list --json", "info pattern", "info pattern --json",
                                      "pose pattern", "set pattern", "set pattern --json", "doctor"}) {
    EXPECT_EQ(runShell("'" TOFTWIN_PROGRAM "' " + arguments + " --address unix:" + socket() + " > /dev/full")
                  .status,
              6)
        << arguments;
  }
}

TEST_F(Steered, ATriggerMakesOneFrame) {
  std::optional<Ran> grabbed;
  std::thread grabbing{[&] { grabbed = run("grab asked --timeout 30 -o " + path("a.png")); }};
  EXPECT_TRUE(eventually([&] { return run("list").out.find("streaming") != std::string::npos; }));
  EXPECT_EQ(run("trigger asked").status, 0);
  grabbing.join();
  EXPECT_EQ(grabbed->status, 0) << grabbed->err;
  const Ran refused = run("trigger pattern");
  EXPECT_EQ(refused.status, 5);
  EXPECT_THAT(refused.err, HasSubstr("cannot be triggered"));
}

TEST_F(Steered, GrabTriggersItsOwnFrames) {
  const Ran ran = run("grab asked --trigger --count 3 -o " + path("a.png"));
  EXPECT_EQ(ran.status, 0) << ran.err;
  EXPECT_TRUE(std::filesystem::exists(folder_ / "a-0002.png"));
}

TEST_F(Steered, ATriggerForNobodyIsStatus7) {
  const Ran ran = run("trigger asked --timeout 0.2");
  EXPECT_EQ(ran.status, 7);
  EXPECT_THAT(ran.err, HasSubstr("nobody took frames of asked"));
  EXPECT_THAT(ran.err, HasSubstr("--trigger"));
}

TEST_F(Steered, AnAbsentCameraIsListedAsAbsentWithTheReason) {
  const Ran list = run("list");
  EXPECT_THAT(list.out, HasSubstr("absent"));
  EXPECT_THAT(list.out, HasSubstr("there is no camera pattern:9"));
  EXPECT_THAT(list.out, Not(HasSubstr("real")));
  EXPECT_THAT(run("list --json").out,
              HasSubstr("\"problem\": \"" + (folder_ / "toftwind").string()));
  EXPECT_EQ(run("grab absent -o " + path("a.png")).status, 3);
}

TEST(ComplianceCommand, SaysWhatWasChecked) {
  const Ran good = toftwin("compliance pattern:0 --keys 'width = 32\nheight = 24'");
  EXPECT_EQ(good.status, 0) << good.out << good.err;
  EXPECT_THAT(good.out, HasSubstr("ok   device time strictly increases"));
  EXPECT_THAT(good.out, HasSubstr("pattern:0: 0 of"));
  EXPECT_THAT(toftwin("compliance pattern:0 --json").out,
              AllOf(HasSubstr("\"outcome\": \"passed\""), HasSubstr("\"planes\": ["), HasSubstr("\"kernel\": \"Linux ")));
}

TEST(ComplianceCommand, SaysOfWhichCameraOnWhichMachine) {
  const std::string out = toftwin("compliance pattern:0 --keys 'width = 32'").out;
  for (const char* line : {"toftwin           0.", "kernel            Linux ", "keys              width = 32", "model             ",
                           "planes            [\"range\"", "nominal_rate_hz   "}) {
    EXPECT_THAT(out, HasSubstr(line));
  }
  const auto at = out.find("measured_rate_hz  ");
  ASSERT_NE(at, std::string::npos) << out;
  EXPECT_GT(std::stod(out.substr(at + 18)), 1.0) << "its frames come at 30 Hz";
}

TEST(ComplianceCommand, ACameraThatDoesNotOpenGivesAReportToo) {
  const Ran text = toftwin("compliance pattern:9");
  EXPECT_EQ(text.status, 4);
  EXPECT_THAT(text.out, AllOf(HasSubstr("kernel            Linux "), HasSubstr("FAIL it opens"), HasSubstr("pattern:9")));
  EXPECT_THAT(text.out, HasSubstr("     there is no camera pattern:9"))
      << "named as a place in a file that is not there";
  EXPECT_THAT(toftwin("compliance pattern:9 --json").out,
              AllOf(HasSubstr("\"camera\": \"pattern:9\""), HasSubstr("\"check\": \"it opens\"")));
}

TEST(ComplianceCommand, ACameraThatIsNotThereOrAWrongKeyIsStatus4) {
  EXPECT_EQ(toftwin("compliance kinect").status, 4);
  EXPECT_THAT(toftwin("compliance sim:kinect_v3").err, HasSubstr("sim:kinect_v2"));
  EXPECT_THAT(toftwin("compliance pattern:0 --keys 'colour = 1'").err, HasSubstr("unknown key"));
  EXPECT_EQ(toftwin("compliance /no/such.mcap").status, 4);
  EXPECT_THAT(toftwin("compliance pattern:0 --keys 'widht = 1'").err, HasSubstr("--keys:1"));
  EXPECT_THAT(toftwin("compliance sim:kinect_v3").err, Not(HasSubstr("--keys")));
}

}  // namespace
}  // namespace toftwin::cli
