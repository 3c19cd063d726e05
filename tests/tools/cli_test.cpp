// SPDX-License-Identifier: Apache-2.0
// The real program where it needs no daemon: exit statuses, recordings, the simulator, completion.
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <sstream>

#include "program.h"
#include "protocol/record/recording.h"
#include "sim/pictures/read.h"
#include "tests/protocol/example_messages.h"
#include "tests/record/record_testing.h"
#include "tools/cli/command.h"
#include "tools/cli/doctor_checks.h"
#include "tools/cli/pose.h"

namespace toftwin::cli {
namespace {

using record::bytesOf;
using record::Folder;
using testing::HasSubstr;
using testing::Not;

std::string linesWith(const std::string& text, const std::string& word) {
  std::istringstream in{text};
  std::string found;
  for (std::string line; std::getline(in, line);)
    found += line.find(word) != std::string::npos ? line + "\n" : "";
  return found;
}

TEST(Toftwin, AWrongCommandLineIsStatus2AndSaysWhatIsWrong) {
  for (const auto& [arguments, what] : std::vector<std::pair<std::string, std::string>>{
           {"", "subcommand is required"},
           {"grap kinect", "there is no command \"grap\""},
           {"grab", "SOURCE is required"},
           {"grab kinect -o a.png --count none", "--frames"},
           {"grab kinect -o a.png --frames 0", "--frames"},
           {"compare a b -n 1", "--frames"},
           {"grab kinect -o a.png --region 1,2", "--region"},
           {"completion tcsh", "tcsh"},
           {"grab kinect -o a.jpeg", ".png, .ply, .npy, .csv"},
           {"grab kinect -o a.png --plane distance", "the planes are: range, "},
           {"grab kinect -o a.png --row 3", "--row has a meaning for .csv only"},
           {"grab kinect -o a.csv --world", "--world has a meaning for .ply and .pcd only"},
           {"grab kinect -o a.png --min 1", "--min has a meaning for .png with --color only"},
           {"grab kinect -o a.png --color --min 2 --max 1", "--min 2 must be less than --max 1"},
           {"record kinect -o m3.txt", "FILE.mcap"},
           {"record kinect", "-o FILE.mcap"},
           {"record kinect -o a.mcap --on-daemon --duration 3", "--on-daemon --stop"},
           {"replay a.mcap --serve -o a.png", "choose one"},
           {"replay a.mcap --serve --from 3", "plays the whole recording"},
           {"replay a.mcap --pace fast", "--pace requires --serve"},
           {"grab kinect -o a.png --skip -1", "-1 not in range"},
           {"record kinect -o a.mcap -n -1", "-1 is negative"},
           {"replay a.mcap -n -1", "-1 is negative"},
           {"render --camera kinect_v2 -o a.png --seed -3", "-3 is negative"},
           {"render --camera kinect_v2 -o a.png --frame -1", "-1 is negative"},
           {"grab kinect -o a.png --region 0,0,0,0", "0 × 0 pixels are none"},
           {"grab kinect -o a.png -p range,flags", "takes one plane"},
           {"replay a.mcap -o a.ply -p range,flags", "takes one plane"},
           {"grab kinect -o a.png -p ir", "for what others call \"ir\" see amplitude"},
           {"record kinect o3d kinect -o a.mcap", "kinect is named twice"},
           {"list -a localhost:99999", "99999"},
           {"info kinect --text", "--text goes with preset:NAME"},
           {"compare kinect kinect", "the same source"},
           {"compare --data /no/such", "--data"},
           {"compare kinect", "name two sources"},
           {"pose kinect --position 1,2", "--position"}}) {
    const Ran ran = toftwin(arguments);
    EXPECT_EQ(ran.status, 2) << arguments;
    EXPECT_THAT(ran.out + ran.err, HasSubstr(what)) << arguments;
  }
}

TEST(Toftwin, HelpAndVersionAreStatus0) {
  EXPECT_THAT(toftwin("--version").out, HasSubstr("toftwin " TOFTWIN_VERSION));
  EXPECT_EQ(toftwin("--help").status, 0);
  for (const char* command :
       {"list", "info", "grab", "record", "replay", "pose", "rig", "set", "trigger", "render", "compare", "usb", "doctor",
        "compliance", "completion"}) {
    const Ran ran = toftwin(std::string{command} + " --help");
    EXPECT_EQ(ran.status, 0) << command;
    EXPECT_THAT(ran.out, HasSubstr("Examples:")) << command;
  }
}

TEST(Toftwin, HelpAsksOnceForWhatGoesByItsPlaceOrItsName) {
  const std::string help = toftwin("render --help").out;
  EXPECT_THAT(help, HasSubstr("  CAMERA TEXT REQUIRED"));
  EXPECT_THAT(help, HasSubstr("  --camera TEXT  "));
  EXPECT_THAT(help, HasSubstr("-o,--output TEXT REQUIRED"));
}

TEST(Toftwin, AStandardOutputThatIsFullIsStatus6) {
  const std::string full = " > /dev/full";
  for (const Command& command : commands()) {
    const Ran ran = toftwin(std::string{command.name} + " --help" + full);
    EXPECT_EQ(ran.status, 6) << command.name;
    EXPECT_EQ(ran.err,
              "toftwin: the standard output cannot be written: No space left on device; "
              "what it shows is not whole\n")
        << command.name;
  }
  for (const std::string arguments : {"list --drivers", "list --drivers --json", "usb", "usb --json",
                                      "doctor", "doctor --json", "completion bash", "completion manual"}) {
    EXPECT_EQ(toftwin(arguments + full).status, 6) << arguments;
  }
  // What is said of it may have no place either.
  EXPECT_EQ(runShell("'" TOFTWIN_PROGRAM "' list --drivers > /dev/full 2>&1").status, 6);
}

TEST(Toftwin, AReaderThatIsGoneIsStatus6WithoutAWord) {
  const Folder folder;
  const std::string fifo = "'" + (folder / "fifo").string() + "'";
  for (const Command& command : commands()) {  // 3 lets 4 open without a reader; then it is gone
    const Ran ran = runShell("mkfifo " + fifo + "; exec 3<>" + fifo + " 4>" + fifo + " 3<&-; rm " + fifo +
                             "; '" TOFTWIN_PROGRAM "' " + command.name + " --help >&4");
    EXPECT_EQ(ran.status, 6) << command.name;
    EXPECT_EQ(ran.err, "") << command.name;
  }
}

TEST(Toftwin, ADaemonThatIsNotThereIsStatus3) {
  for (const char* arguments : {"list", "info kinect", "grab kinect -o /tmp/never.png",
                                "record kinect -o /tmp/never.mcap"}) {
    const Ran ran = toftwin(std::string{arguments} + " --address unix:/no/such/socket");
    EXPECT_EQ(ran.status, 3) << arguments;
    EXPECT_THAT(ran.err, HasSubstr("/no/such/socket")) << arguments;
    EXPECT_THAT(ran.err, HasSubstr("toftwin doctor")) << arguments;
  }
  EXPECT_FALSE(std::filesystem::exists("/tmp/never.mcap"));
  EXPECT_EQ(runShell("TOFTWIN_ADDRESS=unix:/no/such/socket '" TOFTWIN_PROGRAM "' list").status, 3);
}

TEST(Toftwin, APresetsNameAloneIsToldHowItIsWritten) {
  const Ran ran = toftwin("info o3d303 -a localhost:1");
  EXPECT_EQ(ran.status, 3);
  EXPECT_THAT(ran.err, HasSubstr("toftwin info preset:o3d303"));
  EXPECT_EQ(toftwin("info preset:o3d303").status, 0);
  EXPECT_THAT(toftwin("render preset:o3d304 -o /tmp/never.png").err, HasSubstr("no camera preset \"o3d304\""));
}

TEST(Toftwin, WhatIsNotThereIsStatus4) {
  EXPECT_EQ(toftwin("info /no/such/file.mcap").status, 4);
  EXPECT_EQ(toftwin("info /no/such/file.toml").status, 4);
  EXPECT_EQ(toftwin("replay /no/such/file.mcap").status, 4);
  EXPECT_EQ(toftwin("compare a b --poses /no/such/poses.toml").status, 4);
  EXPECT_THAT(toftwin("info preset:kinekt").err, HasSubstr("kinect_v2"));
}

TEST(Toftwin, ListsDriversAndTheirCameras) {
  const Ran text = toftwin("list --drivers");
  EXPECT_EQ(text.status, 0);
  EXPECT_THAT(text.out, HasSubstr("pattern:0"));
  EXPECT_THAT(toftwin("list --drivers --json").out, HasSubstr("\"name\": \"pattern\""));
}

/// A recording of two sources, 20 frames of 16 × 8 pixels, 100 ms apart.
class Recorded : public testing::Test {
 protected:
  void SetUp() override {
    auto writer = record::Writer::create(file_, {.chunk_bytes = 10'000, .zstd_level = 0});
    ASSERT_TRUE(writer) << writer.error().message;
    for (int i = 0; i < 20; ++i) {
      Frame frame = wire::exampleFrame(16, 8);
      frame.source = i % 4 == 3 ? "o3d" : "kinect";
      frame.sequence = static_cast<std::uint64_t>(i);
      frame.moment.received = {1'760'000'000'000'000'000 + 100'000'000ll * i};
      frame.planes[0] =
          toPlane(PlaneKind::Range, Image<float>{16, 8, 1.0f + 0.01f * static_cast<float>(i)});
      ASSERT_TRUE(writer->write(frame));
    }
    ASSERT_TRUE(writer->close());
  }
  std::string path(const std::string& name) const { return "'" + (folder_ / name).string() + "'"; }

  Folder folder_;
  std::filesystem::path file_ = folder_ / "a.mcap";
};

TEST_F(Recorded, InfoSaysWhatIsInIt) {
  const Ran text = toftwin("info " + path("a.mcap"));
  EXPECT_EQ(text.status, 0);
  EXPECT_THAT(text.out, HasSubstr("1.900 s from 2025-10-09 08:53:20.000 UTC"));
  EXPECT_THAT(text.out, HasSubstr("16×8 range, amplitude, flags"));
  const Ran json = toftwin("info --json " + path("a.mcap"));
  EXPECT_THAT(json.out, HasSubstr("\"frames\": 15"));
  EXPECT_THAT(json.out, HasSubstr("\"damage\": \"\""));
}

TEST_F(Recorded, ReplayListsOneLinePerFrame) {
  const Ran all = toftwin("replay " + path("a.mcap"));
  EXPECT_EQ(all.status, 0);
  EXPECT_EQ(std::ranges::count(all.out, '\n'), 20);
  const Ran one = toftwin("replay " + path("a.mcap") + " --source o3d --from 0.5 --count 2");
  EXPECT_EQ(one.status, 0);
  EXPECT_EQ(std::ranges::count(one.out, '\n'), 2);
  EXPECT_THAT(one.out, HasSubstr("0.700000 s  o3d"));
  EXPECT_THAT(toftwin("replay --json --count 1 " + path("a.mcap")).out,
              HasSubstr(R"({"source":"kinect","sequence":0,"received_ns":1760000000000000000,)"));
}

TEST_F(Recorded, AListThatCannotBeWrittenIsStatus6) {
  const Ran full = runShell("'" TOFTWIN_PROGRAM "' replay " + path("a.mcap") + " --json > /dev/full");
  EXPECT_EQ(full.status, 6);
  EXPECT_THAT(full.err, HasSubstr("the standard output cannot be written: No space left on device"));
}

TEST_F(Recorded, ReplayMakesOneHdf5FileOfARecording) {
  const Ran ran = toftwin("replay " + path("a.mcap") + " --source kinect -o " + path("a.h5"));
  EXPECT_EQ(ran.status, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("a.h5: HDF5, 15 frames: range, amplitude, flags"));
  EXPECT_GT(std::filesystem::file_size(folder_ / "a.h5"), 15u * 16 * 8 * 4);
}

TEST_F(Recorded, FramesGoToRosAndFoxgloveAndComeBackAsTheyWere) {
  toftwin("replay " + path("a.mcap") + " --source kinect -n 1 -p range -o " + path("before.npy"));
  for (const std::string format : {"ros2", "foxglove"}) {
    const Ran there = toftwin("replay " + path("a.mcap") + " -o " + path("bag.mcap") + " --format " + format);
    ASSERT_EQ(there.status, 0) << there.err;
    const Ran told = toftwin("info " + path("bag.mcap"));
    EXPECT_EQ(told.status, 0) << told.err;
    EXPECT_THAT(told.out, HasSubstr("toftwin import makes a recording of: kinect, o3d"));
    const Ran back = toftwin("import " + path("bag.mcap") + " --overwrite -o " + path("back.mcap"));
    ASSERT_EQ(back.status, 0) << back.err;
    EXPECT_THAT(back.out, HasSubstr("back.mcap: 20 frames of "));
    toftwin("replay " + path("back.mcap") + " --source kinect -n 1 -p range -o " + path("after.npy"));
    EXPECT_EQ(record::bytesOf(folder_ / "after.npy"), record::bytesOf(folder_ / "before.npy"));
  }
  const Ran asked = toftwin("replay " + path("a.mcap") + " -o " + path("c.mcap"));
  EXPECT_EQ(asked.status, 2);
  EXPECT_THAT(asked.err, HasSubstr("can be of several formats"));
}

TEST_F(Recorded, AFrameGoesToAPipeAndWhatIsSaidDoesNot) {
  const Ran ran = runShell("'" TOFTWIN_PROGRAM "' replay " + path("a.mcap") + " -n 1 --source kinect -o - > " + path("piped.npy"));
  EXPECT_EQ(ran.status, 0);
  EXPECT_THAT(ran.err, HasSubstr("range in m"));
  toftwin("replay " + path("a.mcap") + " -n 1 --source kinect -o " + path("named.npy"));
  EXPECT_EQ(record::bytesOf(folder_ / "piped.npy"), record::bytesOf(folder_ / "named.npy"));
}

TEST_F(Recorded, OfAFileThatIsThereNobodyIsAskedButItself) {
  std::ofstream{folder_ / "odd"} << "\x01\x02\x03 what is this";
  for (const std::string file : {"odd", "a.mcap"}) {
    const Ran ran = toftwin("info " + path(file));
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(ran.err, ::testing::Not(HasSubstr("daemon")));
  }
}

TEST_F(Recorded, ReplayExportsFrames) {
  const Ran one =
      toftwin("replay " + path("a.mcap") + " -o " + path("at.png") + " --from 1.25 --count 1");
  ASSERT_EQ(one.status, 0) << one.err;
  const cv::Mat image = *pictures::read(folder_ / "at.png");
  ASSERT_EQ(image.size(), cv::Size(16, 8));
  EXPECT_EQ(image.at<std::uint16_t>(0, 0), 1130);  // frame 13, at 1.3 s
  const Ran all = toftwin("replay " + path("a.mcap") + " --source o3d -o " + path("f.npy"));
  EXPECT_EQ(all.status, 0);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "f-0004.npy"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "f-0005.npy"));
  EXPECT_EQ(all.err, "") << "no progress bar where standard error is no terminal";
}

TEST_F(Recorded, AStartPastTheEndIsStatus4AndTellsTheLength) {
  const Ran ran = toftwin("replay " + path("a.mcap") + " --from 2");
  EXPECT_EQ(ran.status, 4);
  EXPECT_THAT(ran.err, HasSubstr("--from 2 is past its end: it is 1.900000 s long"));
}

TEST_F(Recorded, FewerFramesThanAskedForIsStatus7) {
  const Ran ran = toftwin("replay " + path("a.mcap") + " --count 100");
  EXPECT_EQ(ran.status, 7);
  EXPECT_THAT(ran.err, HasSubstr("only 20 frames"));
}

TEST_F(Recorded, ASourceThatIsNotInItIsNamed) {
  const Ran ran = toftwin("replay " + path("a.mcap") + " --source xtion");
  EXPECT_EQ(ran.status, 4);
  EXPECT_THAT(ran.err, HasSubstr("it has: kinect, o3d"));
}

TEST_F(Recorded, ACutRecordingIsReadAsFarAsItGoesAndSaysSo) {
  const auto bytes = bytesOf(file_);
  record::writeBytes(file_, std::span{bytes}.first(bytes.size() / 2));
  const Ran ran = toftwin("replay " + path("a.mcap"));
  EXPECT_EQ(ran.status, 7);
  EXPECT_THAT(ran.err, HasSubstr("was not closed"));
  EXPECT_GT(std::ranges::count(ran.out, '\n'), 0);
  EXPECT_EQ(toftwin("info " + path("a.mcap")).status, 7);
}

TEST_F(Recorded, ARecordingCutInItsFirstChunkSaysThatNothingOfItCanBeRead) {
  const auto bytes = bytesOf(file_);
  record::writeBytes(file_, std::span{bytes}.first(100));
  const Ran info = toftwin("info " + path("a.mcap"));
  EXPECT_EQ(info.status, 7);
  EXPECT_THAT(info.err, HasSubstr("nothing of it can be read: it ends before its first chunk is whole"));
  const Ran calibrate =
      toftwin("calibrate " + path("a.mcap") + " --board 8x5 --square 32 -o " + path("c.toml"));
  EXPECT_NE(calibrate.status, 0);
  EXPECT_THAT(calibrate.err, HasSubstr("no frame of it can be read"));
  EXPECT_THAT(calibrate.err, Not(HasSubstr("of 0 images")));
}

TEST_F(Recorded, ADamagedChunkIsFoundAlthoughTheIndexIsWhole) {
  auto bytes = bytesOf(file_);
  for (std::size_t i = 0; i < 4; ++i) bytes[bytes.size() / 2 + i] ^= std::byte{0x55};
  record::writeBytes(file_, bytes);
  const Ran info = toftwin("info " + path("a.mcap"));
  EXPECT_EQ(info.status, 7);
  EXPECT_THAT(info.out, HasSubstr("index        whole"));
  EXPECT_THAT(info.err, HasSubstr("CRC"));
  EXPECT_THAT(info.err, HasSubstr("of the 15 frames of kinect cannot be read"));
  const Ran replay = toftwin("replay " + path("a.mcap"));
  EXPECT_EQ(replay.status, 7);
  EXPECT_THAT(replay.err, HasSubstr("is followed by frame"));
  EXPECT_THAT(replay.err, HasSubstr("of the 15 frames of kinect cannot be read"));
}

TEST_F(Recorded, AComparisonThatNeedsMoreFramesSaysSoFirst) {
  const Ran ran = toftwin("compare kinect " + path("a.mcap") + "#kinect --frames 500");
  EXPECT_EQ(ran.status, 4);
  EXPECT_THAT(ran.err, HasSubstr("has 15 frames, but 500 are needed"));
  EXPECT_THAT(ran.err, Not(HasSubstr("not whole")));
  const auto bytes = bytesOf(file_);
  record::writeBytes(file_, std::span{bytes}.first(bytes.size() / 2));
  const Ran cut = toftwin("compare kinect " + path("a.mcap") + "#kinect --frames 500");
  EXPECT_EQ(cut.status, 4);
  EXPECT_THAT(cut.err, HasSubstr("It is not whole: " + (folder_ / "a.mcap").string()));
}

TEST_F(Recorded, ServingOnATakenPortIsStatus5) {
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ASSERT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&address), size), 0);
  ASSERT_EQ(::listen(fd, 1), 0);
  ASSERT_EQ(::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size), 0);
  const Ran ran = toftwin("replay " + path("a.mcap") + " --serve --port " +
                          std::to_string(ntohs(address.sin_port)));
  ::close(fd);
  EXPECT_EQ(ran.status, 5) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("in use"));
  EXPECT_THAT(ran.err, Not(HasSubstr("listening on")));
}

TEST_F(Recorded, ACameraThatBreaksAPromiseIsStatus7) {
  // Its first pixel has a range although its flags say invalid, and its device time stands still.
  const Ran ran = toftwin("compliance " + path("a.mcap") +
                          " --keys 'recorded_source = \"kinect\"\npace = \"fast\"'");
  EXPECT_EQ(ran.status, 7) << ran.out << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("FAIL invalid pixels are NaN"));
  EXPECT_THAT(ran.out, HasSubstr("FAIL device time strictly increases"));
  EXPECT_THAT(ran.out, HasSubstr("why it matters"));
}

TEST_F(Recorded, AnOutputThatCannotBeWrittenIsStatus6AndLeavesNothing) {
  std::filesystem::create_directory(folder_ / "out");
  const std::string command =
      "'" TOFTWIN_PROGRAM "' replay " + path("a.mcap") + " --count 1 -o " + path("out/a.csv");
  const Ran ran = runShell("ulimit -f 1; " + command);  // files of 1 kB at most
  EXPECT_EQ(ran.status, 6) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("free space there"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "out"));
}

class Render : public testing::Test {
 protected:
  void SetUp() override {
    std::ofstream{folder_ / "wall.toml"}
        << "[[material]]\nname = 'white'\nalbedo = 0.8\n[[object]]\nname = 'wall'\nshape = "
           "'rectangle'\n"
           "size_m = [20, 20, 0]\nposition_m = [0, 0, 2]\nmaterial = 'white'\n";
  }
  Ran render(const std::string& arguments) const {
    return toftwin("render --camera generic_cw --samples 1 --scene '" +
                   (folder_ / "wall.toml").string() + "' " + arguments);
  }
  Folder folder_;
};

TEST_F(Render, GivesTheTrueRangeOfAWall) {
  const Ran ran = render("--plane truth_range -o '" + (folder_ / "a.png").string() + "'");
  ASSERT_EQ(ran.status, 0) << ran.err;
  const cv::Mat image = *pictures::read(folder_ / "a.png");
  double least = 0;
  cv::minMaxLoc(image, &least);
  EXPECT_NEAR(least, 2000,
              1);  // on the axis, 2 m; off by half a count, and by up to half a pixel's slope
}

TEST_F(Render, SameSeedSameBytesAndAnotherSeedOthers) {
  const auto file = [&](const char* name) { return " -o '" + (folder_ / name).string() + "'"; };
  ASSERT_EQ(render("--seed 7" + file("a.npy")).status, 0);
  ASSERT_EQ(render("--seed 7" + file("b.npy")).status, 0);
  ASSERT_EQ(render("--seed 8" + file("c.npy")).status, 0);
  EXPECT_EQ(bytesOf(folder_ / "a.npy"), bytesOf(folder_ / "b.npy"));
  EXPECT_NE(bytesOf(folder_ / "a.npy"), bytesOf(folder_ / "c.npy"));
}

TEST_F(Render, HasThePlanesThatASourceHas) {
  const auto file = [&](const char* name) { return (folder_ / name).string(); };
  ASSERT_EQ(render("-o " + file("depth.csv") + " --plane depth,range").status, 0);
  std::ifstream lines{folder_ / "depth.csv"};
  std::string heading;
  while (std::getline(lines, heading) && heading.starts_with('#')) {
  }
  EXPECT_THAT(heading, HasSubstr("depth"));
  // Two frequencies: four samples, or a complex number, for each.
  EXPECT_THAT(render("-o " + file("s.npy") + " --plane samples").out, HasSubstr("shape (8, 240, 320)"));
  EXPECT_THAT(render("-o " + file("p.npy") + " --plane phasors").out, HasSubstr("shape (4, 240, 320)"));
}

TEST(RenderDefaults, AreThoseOfASimulatedSource) {
  const Folder folder;
  const auto out = [&](const char* name) { return "'" + (folder / name).string() + "'"; };
  ASSERT_EQ(toftwin("render --camera generic_cw -o " + out("r.npy")).status, 0);
  ASSERT_EQ(toftwin("render --camera generic_cw -o " + out("s.npy") +
                    " --samples 4 --surfaces 4 --seed 1 --since-power-on 10800")
                .status,
            0);
  EXPECT_EQ(record::bytesOf(folder / "r.npy"), record::bytesOf(folder / "s.npy"));
}

TEST_F(Render, ASceneThatIsWrongNamesFileAndLine) {
  std::ofstream{folder_ / "wall.toml"} << "[[object]]\nshape = 'triangle'\n";
  const Ran ran = render("-o /tmp/never.png");
  EXPECT_EQ(ran.status, 4);
  EXPECT_THAT(ran.err, HasSubstr("wall.toml:2: shape"));
}

TEST(LookFrom, TheAxisMeetsThePointAndUpIsUp) {
  for (const std::vector<double>& target : std::vector<std::vector<double>>{
           {0.5, -1, 9}, {5, 0.2, 0}, {-5, 2, -3}, {0.1, 4, -7}, {0, 0, 2}, {0, 0.1, -2}}) {
    const std::vector<double> position{0.3, 0.2, -0.4};
    const auto pose = lookFrom(position, target, {0, -1, 0});
    ASSERT_TRUE(pose);
    const Vec3d towards = Vec3d{target[0], target[1], target[2]} - Vec3d{0.3, 0.2, -0.4};
    const Vec3d axis = pose->rotate({0, 0, 1}), down = pose->rotate({0, 1, 0}),
                right = pose->rotate({1, 0, 0});
    EXPECT_NEAR(norm(axis - normalised(towards)), 0.0, 1e-14);
    EXPECT_NEAR(right.y, 0.0, 1e-14) << "the horizon is level";
    EXPECT_GT(down.y, 0.0) << "the world's up is -y";
    EXPECT_NEAR(norm(cross(down, axis) - right), 0.0, 1e-14);
  }
  EXPECT_FALSE(lookFrom({0, 0, 0}, {0, 3, 0}, {0, -1, 0}));
  EXPECT_FALSE(lookFrom({1, 1, 1}, {1, 1, 1}, {0, -1, 0}));
}

TEST(Completion, TheBashScriptCompletesCommandsAndOptions) {
  const Ran script = toftwin("completion bash");
  ASSERT_EQ(script.status, 0);
  const Folder folder;
  std::ofstream{folder / "toftwin"} << script.out;
  const auto complete = [&](const std::string& words, int at) {
    return runShell("bash -c 'source " + (folder / "toftwin").string() + "; COMP_WORDS=(" + words +
                    "); COMP_CWORD=" + std::to_string(at) + "; _toftwin; echo \"${COMPREPLY[@]}\"'")
        .out;
  };
  EXPECT_EQ(complete("toftwin re", 1), "record replay render\n");
  EXPECT_EQ(complete("toftwin grab --pl", 2), "--plane\n");
  EXPECT_EQ(complete("toftwin completion z", 2), "zsh\n");
  EXPECT_EQ(complete("toftwin completion m", 2), "manual\n");
  EXPECT_EQ(complete("toftwin grab kinect --plane truth_r", 4), "truth_range\n");
  EXPECT_EQ(complete("toftwin render --camera kin", 3), "kinect_v2\n");
  EXPECT_EQ(complete("toftwin replay --pace f", 3), "fast\n");
  EXPECT_EQ(complete("toftwin render --scene " + (folder / "tof").string(), 3),
            (folder / "toftwin").string() + "\n");
}

TEST(Completion, TheScriptsOfTheOtherShellsNameEveryOption) {
  for (const char* shell : {"zsh", "fish"}) {
    const Ran script = toftwin(std::string{"completion "} + shell);
    EXPECT_EQ(script.status, 0);
    for (const char* word : {"doctor", "decimation", "on-daemon"}) {
      EXPECT_THAT(script.out, HasSubstr(word)) << shell;
    }
    if (runShell(std::string{"command -v "} + shell).status == 0) {
      const Folder folder;
      std::ofstream{folder / "script"} << script.out;
      EXPECT_EQ(runShell(std::string{shell} + " -n '" + (folder / "script").string() + "'").err,
                "");
    }
  }
}

TEST(Documents, CommandLineIsTheProgramsOwnManual) {
  std::ifstream page{TOFTWIN_SOURCE_DIR "/docs/command-line.md"};
  const std::string text{std::istreambuf_iterator<char>{page}, {}};
  EXPECT_EQ(text, toftwin("completion manual").out)
      << "make it anew: toftwin completion manual > docs/command-line.md";
}

TEST(Doctor, SaysHowToMendWhatItFinds) {
  const Ran ran = toftwin("doctor --address unix:/no/such/socket");
  EXPECT_EQ(ran.status, 7);
  EXPECT_THAT(linesWith(ran.out, "daemon"), HasSubstr("BAD"));
  EXPECT_THAT(ran.out, HasSubstr("mend it:"));
  EXPECT_THAT(toftwin("doctor --json --address unix:/no/such/socket").out,
              HasSubstr("\"state\": \"BAD\""));
}

TEST(Doctor, FindsAPortThatIsTaken) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ASSERT_EQ(::bind(fd, reinterpret_cast<const sockaddr*>(&address), size), 0);
  ASSERT_EQ(::listen(fd, 1), 0);
  ASSERT_EQ(::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size), 0);
  const std::uint16_t port = ntohs(address.sin_port);
  EXPECT_EQ(checkPort(port).state, Finding::State::Bad);
  EXPECT_THAT(checkPort(port).mend, HasSubstr("ss -ltnp"));
  ::close(fd);
  EXPECT_EQ(checkPort(port).state, Finding::State::Good);
}

TEST(Doctor, FindsWhatIsWrongWithASocketAFolderAndALocale) {
  const Folder folder;
  EXPECT_EQ(checkSocket((folder / "none").string()).state, Finding::State::Warning);
  std::ofstream{folder / "file"} << "x";
  EXPECT_EQ(checkSocket((folder / "file").string()).state, Finding::State::Bad);
  EXPECT_EQ(checkFolder(folder / "none").state, Finding::State::Bad);
  EXPECT_THAT(checkFolder(folder / "none").mend, HasSubstr("mkdir"));
  EXPECT_EQ(checkFolder(folder / ".").state, Finding::State::Good)
      << "or there is less than 1 GB free";
  EXPECT_EQ(checkLocale("xx_YY.nonsense").state, Finding::State::Warning);
  EXPECT_EQ(checkLocale("C").state, Finding::State::Good);
}

}  // namespace
}  // namespace toftwin::cli
