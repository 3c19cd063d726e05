// SPDX-License-Identifier: Apache-2.0
// The real `toftwin` against a real `toftwind` with the pattern source, whose every value is known.
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <opencv2/core.hpp>
#include <thread>
#include <utility>

#include "drivers/pattern/pattern.h"
#include "program.h"
#include "with_daemon.h"
#include "protocol/record/recording.h"
#include "sim/pictures/read.h"
#include "tests/record/record_testing.h"

namespace toftwin::cli {
namespace {

using testing::HasSubstr;

constexpr int kWidth = 64, kHeight = 48;

TEST_F(WithDaemon, ListAndInfoSayWhatTheDaemonHas) {
  const Ran names = run("list --names");
  EXPECT_EQ(names.status, 0) << names.err;
  EXPECT_EQ(names.out, "pattern\nshort\n");
  EXPECT_THAT(run("list --json").out, HasSubstr("\"kind\": \"simulated\""));
  EXPECT_THAT(run("info pattern").out, HasSubstr("64 × 48 pixels"));
  EXPECT_THAT(run("info pattern --json").out, HasSubstr("\"frame_rate_hz\": 50"));
  const Ran unknown = run("info kinekt");
  EXPECT_EQ(unknown.status, 4);
  EXPECT_THAT(unknown.err, HasSubstr("kinekt"));
}

class WithFacades : public WithDaemon {
  std::string moreSources() const override {
    return "[[facade]]\nkind = 'modbus'\nsource = 'pattern'\nport = 0\n"
           "[[facade]]\nkind = 'modbus'\nsource = 'pattern'\nport = 0\nboot_time_s = 600\n";
  }
};

TEST_F(WithFacades, ListAndInfoSayWhereFacadesAre) {
  const Ran list = run("list");
  EXPECT_EQ(list.status, 0) << list.err;
  EXPECT_THAT(list.out, HasSubstr("pattern as modbus running, 0 clients: Modbus TCP on 127.0.0.1 port "));
  EXPECT_THAT(list.out, HasSubstr("pattern as modbus booting\n"));
  EXPECT_THAT(list.out, testing::Not(HasSubstr("short as")));
  EXPECT_THAT(run("list --json").out, HasSubstr("\"state\": \"booting\""));
  EXPECT_THAT(run("info pattern").out, HasSubstr("facade       modbus running, 0 clients: Modbus TCP on "));
  EXPECT_THAT(run("info pattern --json").out, HasSubstr("\"clients\": 0"));
}

/// The shift at which the pattern shows these millimetres at its first pixel.
std::optional<std::uint64_t> shiftOf(const cv::Mat& range_mm) {
  for (std::uint64_t shift = 0; shift < 256; ++shift) {
    bool fits = true;
    for (int y = 0; y < kHeight && fits; ++y) {
      for (int x = 0; x < kWidth && fits; ++x) {
        const float range_m = drivers::pattern::pixelAt(kWidth, kHeight, shift, x, y).range_m;
        const long count =
            std::isnan(range_m) ? 0 : std::lround(1000.0 * static_cast<double>(range_m));
        fits = range_mm.at<std::uint16_t>(y, x) == count;
      }
    }
    if (fits) return shift;
  }
  return std::nullopt;
}

TEST_F(WithDaemon, GrabWritesThePatternToTheMillimetre) {
  const Ran ran = run("grab pattern -o " + path("a.png"));
  ASSERT_EQ(ran.status, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("1 count = 1 mm"));
  const cv::Mat image = *pictures::read(folder_ / "a.png");
  ASSERT_EQ(image.size(), cv::Size(kWidth, kHeight));
  EXPECT_TRUE(shiftOf(image)) << "no position of the pattern looks like this";
}

TEST_F(WithDaemon, GrabPutsSeveralFramesIntoOneHdf5File) {
  const Ran ran = run("grab pattern -o " + path("a.h5") + " --count 3 -p range,flags");
  ASSERT_EQ(ran.status, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("a.h5: HDF5, 3 frames: range, flags"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "a.h5"));
}

TEST_F(WithDaemon, GrabOfSeveralFramesLeavesNoneOut) {
  const Ran ran = run("grab pattern -o " + path("a.png") + " --count 5");
  ASSERT_EQ(ran.status, 0) << ran.err;
  std::vector<std::uint64_t> shifts;
  for (int i = 0; i < 5; ++i) {
    const auto file = folder_ / ("a-000" + std::to_string(i) + ".png");
    shifts.push_back(shiftOf(*pictures::read(file)).value_or(1000));
  }
  for (std::size_t i = 1; i < 5; ++i) EXPECT_EQ(shifts[i], (shifts[i - 1] + 1) % 256) << i;
}

TEST_F(WithDaemon, GrabTakesAPartOfTheImage) {
  const Ran ran = run("grab pattern -o " + path("a.csv") +
                      " --region 8,4,16,10 --decimation 2 --plane range,flags");
  ASSERT_EQ(ran.status, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("4 columns, 40 rows"));
}

TEST_F(WithDaemon, WhatTheSourceDoesNotHaveIsNamed) {
  EXPECT_EQ(run("grab kinekt -o " + path("a.png")).status, 4);
  const Ran plane = run("grab pattern --plane samples -o " + path("a.png"));
  EXPECT_EQ(plane.status, 4);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.png"));
}

TEST_F(WithDaemon, AStreamThatEndsEarlyIsStatus7) {
  const Ran ran = run("grab short -o " + path("a.npy") + " --count 50");
  EXPECT_EQ(ran.status, 7);
  EXPECT_THAT(ran.err, HasSubstr("of 50 frames written"));
}

TEST_F(WithDaemon, RecordsEveryFrame) {
  const Ran ran = run("record pattern -o " + path("a.mcap") + " --count 40");
  ASSERT_EQ(ran.status, 0) << ran.err;
  // The pattern itself drops frames where the machine is busy; the sequence below says the rest.
  EXPECT_THAT(ran.out, HasSubstr("40 frames, "));
  auto reader = record::Reader::open(folder_ / "a.mcap");
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_TRUE(reader->summary().indexed);
  EXPECT_EQ(reader->summary().frames_per_source.at("pattern"), 40u);
  std::uint64_t sequence = 0;
  for (int i = 0; i < 40; ++i) {
    const auto frame = reader->next();
    ASSERT_TRUE(frame);
    sequence = i == 0 ? frame->sequence : sequence + 1;
    EXPECT_EQ(frame->sequence, sequence);
  }
  const Ran again = run("record pattern -o " + path("a.mcap") + " --count 1");
  EXPECT_EQ(again.status, 4) << "a recording is not overwritten unless asked to";
  EXPECT_THAT(again.err, HasSubstr("--force"));
  EXPECT_EQ(run("record pattern -o " + path("a.mcap") + " --count 1 --force").status, 0);
}

TEST_F(WithDaemon, RecordsWhatOtherProgramsReadDirectly) {
  for (const std::string format : {"ros2", "foxglove"}) {
    const Ran ran = run("record pattern -o " + path(format + ".mcap") + " --count 5 --format " + format);
    ASSERT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("5 frames, "));
    const Ran back = toftwin("import " + path(format + ".mcap") + " -o " + path(format + "_back.mcap"));
    ASSERT_EQ(back.status, 0) << back.err;
    EXPECT_THAT(back.out, HasSubstr("5 frames of "));
  }
  EXPECT_EQ(run("record pattern -o b.mcap --on-daemon --format ros2").status, 2);
}

TEST_F(WithDaemon, CtrlCEndsARecordingAndLeavesItWhole) {
  Background recorder{{TOFTWIN_PROGRAM, "record", "pattern", "-o", (folder_ / "a.mcap").string(),
                       "--address", "unix:" + socket()}};
  ASSERT_TRUE(eventually([&] { return std::filesystem::exists(folder_ / "a.mcap"); }));
  std::this_thread::sleep_for(
      std::chrono::milliseconds{300});  // for a few frames; none would do as well
  EXPECT_EQ(recorder.end(SIGINT), 0);
  auto reader = record::Reader::open(folder_ / "a.mcap");
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_TRUE(reader->summary().indexed) << reader->summary().damage;
}

TEST_F(WithDaemon, CtrlCBeforeAllFramesAreThereIsStatus130) {
  Background recorder{{TOFTWIN_PROGRAM, "record", "pattern", "-o", (folder_ / "a.mcap").string(),
                       "-n", "1000000", "--address", "unix:" + socket()}};
  ASSERT_TRUE(eventually([&] { return std::filesystem::exists(folder_ / "a.mcap"); }));
  std::this_thread::sleep_for(
      std::chrono::milliseconds{300});  // as above
  EXPECT_EQ(recorder.end(SIGINT), 130);
}

TEST_F(WithDaemon, OneSourceUnderTwoAddressesIsNotCompared) {
  const std::string link = (folder_ / "link").string();
  std::filesystem::create_symlink(socket(), link);
  const Ran ran = run("compare pattern pattern -o " + path("r") + " --address-b unix:" + link);
  EXPECT_EQ(ran.status, 4) << ran.out;
  EXPECT_THAT(ran.err, HasSubstr("the same source"));
}

TEST_F(WithDaemon, ADaemonThatDiesWhileRecordingIsStatus3AndTheFileIsWhole) {
  std::optional<Ran> ran;
  std::thread recording{[&] { ran = run("record pattern -o " + path("a.mcap")); }};
  EXPECT_TRUE(eventually([&] { return std::filesystem::exists(folder_ / "a.mcap"); }));
  daemon_->end(SIGKILL);
  recording.join();
  EXPECT_EQ(ran->status, 3) << ran->err;
  auto reader = record::Reader::open(folder_ / "a.mcap");
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_TRUE(reader->summary().indexed);
}

TEST_F(WithDaemon, ADaemonThatStopsIsStatus3AndCtrlCIs130) {
  for (const auto& [signal, to_daemon, status] :
       std::vector<std::tuple<int, bool, int>>{{SIGINT, false, 130}, {SIGTERM, true, 3}}) {
    Background grab{{TOFTWIN_PROGRAM, "grab", "pattern", "-o", (folder_ / "a.npy").string(), "--count",
                     "1000000", "--address", "unix:" + socket()}};
    ASSERT_TRUE(eventually([&] { return std::filesystem::exists(folder_ / "a-0002.npy"); }));
    if (to_daemon) {
      EXPECT_EQ(daemon_->end(signal), 0);
    }
    EXPECT_EQ(to_daemon ? grab.wait() : grab.end(signal), status);
    std::filesystem::remove(folder_ / "a-0002.npy");
  }
}

TEST_F(WithDaemon, ARecordingThatTheDaemonEndsIsWholeAndStatus3) {
  Background recorder{{TOFTWIN_PROGRAM, "record", "pattern", "-o", (folder_ / "a.mcap").string(),
                       "--address", "unix:" + socket()}};
  ASSERT_TRUE(eventually([&] { return run("list").out.find("streaming") != std::string::npos; }));
  EXPECT_EQ(daemon_->end(SIGTERM), 0);
  EXPECT_EQ(recorder.wait(), 3);
  auto reader = record::Reader::open(folder_ / "a.mcap");
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_TRUE(reader->summary().indexed);
}

TEST_F(WithDaemon, APlaceThatCannotBeWrittenToIsStatus6) {
  EXPECT_EQ(run("record pattern -n 1 -o " + path("none/a.mcap")).status, 6);
  EXPECT_EQ(run("grab pattern -o " + path("none/a.png")).status, 6);
  EXPECT_EQ(run("compare pattern short --frames 2 -o /dev/null/report").status, 6);
}

TEST_F(WithDaemon, AComparisonPutsTheCamerasBack) {
  std::ofstream{folder_ / "poses.toml"} << "[[pose]]\nposition_m = [0.0, 0.0, -2.0]\n";
  ASSERT_EQ(run("pose pattern --position 1,2,3").status, 0);
  const Ran compared = run("compare pattern short --poses " + path("poses.toml") +
                           " --frames 2 -o " + path("report"));
  ASSERT_EQ(compared.status, 0) << compared.err;
  EXPECT_THAT(run("pose pattern").out, HasSubstr("position     1, 2, 3 m"));
  EXPECT_THAT(run("pose short").out, HasSubstr("position     0, 0, 0 m"));
  EXPECT_EQ(run("compare pattern short --poses " + path("none.toml")).status, 4);
}

TEST_F(WithDaemon, TheDaemonRecordsWhenAsked) {
  const Ran started = run("record pattern -o b.mcap --on-daemon");
  ASSERT_EQ(started.status, 0) << started.err;
  EXPECT_THAT(started.out, HasSubstr("recordings/b.mcap"));
  const Ran stopped = run("record pattern --on-daemon --stop");
  EXPECT_EQ(stopped.status, 0) << stopped.err;
  const Ran again = run("record pattern --on-daemon --stop");
  EXPECT_EQ(again.status, 4) << "there is nothing left to stop";
  EXPECT_THAT(again.err, HasSubstr("not being recorded"));
  auto reader = record::Reader::open(folder_ / "recordings/b.mcap");
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_TRUE(reader->summary().indexed);
  const Ran outside = run("record pattern -o ../c.mcap --on-daemon");
  EXPECT_NE(outside.status, 0);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "c.mcap"));
}

TEST_F(WithDaemon, ServesARecordingWhoseFramesAreTheRecordedOnes) {
  ASSERT_EQ(run("record pattern -o " + path("a.mcap") + " --count 8").status, 0);
  const std::string served = (folder_ / "replayed").string();
  Background server{{TOFTWIN_PROGRAM, "replay", (folder_ / "a.mcap").string(), "--serve", "--port",
                     "0", "--socket", served, "--pace", "fast", "--loop"}};
  ASSERT_TRUE(eventually([&] { return std::filesystem::exists(served); }));
  EXPECT_THAT(toftwin("list --address unix:" + served).out, HasSubstr("replayed"));
  const Ran grabbed = toftwin("grab pattern -o " + path("r.npy") + " --address unix:" + served);
  ASSERT_EQ(grabbed.status, 0) << grabbed.err;
  const auto replayed = record::bytesOf(folder_ / "r.npy");
  ASSERT_EQ(toftwin("replay " + path("a.mcap") + " -o " + path("f.npy")).status, 0);
  int same = 0;
  for (int i = 0; i < 8; ++i)
    same += record::bytesOf(folder_ / ("f-000" + std::to_string(i) + ".npy")) == replayed;
  EXPECT_EQ(same, 1) << "the frame is one of the recorded ones, bit for bit";
}

TEST_F(WithDaemon, CountsTheFramesThatAreInTheFileWhenTheDiskIsFull) {
  const Ran ran = runShell("trap '' XFSZ; ulimit -f 200; exec " + std::string{TOFTWIN_PROGRAM} +
                           " record pattern -o " + path("a.mcap") + " --address unix:" + socket());
  EXPECT_EQ(ran.status, 6) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr(" that could not be written"));
  auto reader = record::Reader::open(folder_ / "a.mcap");
  ASSERT_TRUE(reader) << reader.error().message;
  int frames = 0;
  while (reader->next()) ++frames;
  EXPECT_THAT(ran.out, HasSubstr("a.mcap: " + std::to_string(frames) + " frames, "));
}

class WithLittleRoom : public WithDaemon {
 protected:
  std::string moreSources() const override { return "[recording]\nmax_mb = 1\n"; }
};

TEST_F(WithLittleRoom, DoctorFindsARecordingThatEndedUntilSomebodyWasTold) {
  ASSERT_EQ(run("record pattern -o b.mcap --on-daemon").status, 0);
  Ran ran;
  ASSERT_TRUE(eventually([&] { return (ran = run("doctor --folder " + path("."))).status == 7; }));
  EXPECT_THAT(ran.out, HasSubstr("BAD  pattern"));
  EXPECT_THAT(ran.out, HasSubstr("toftwin record pattern --on-daemon --stop"));
  EXPECT_THAT(ran.out, testing::Not(HasSubstr("tries again by itself")));
  EXPECT_EQ(run("record pattern --on-daemon --stop").status, 6);
  EXPECT_EQ(run("doctor --folder " + path(".")).status, 0);
}

/// A facade whose port another program has.
class WithoutItsPort : public WithDaemon {
 protected:
  void SetUp() override {
    sockaddr_in any{};
    any.sin_family = AF_INET;
    any.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof any;
    auto* const address = reinterpret_cast<sockaddr*>(&any);
    ASSERT_EQ(::bind(other_, address, size), 0);
    ASSERT_EQ(::listen(other_, 1), 0);
    ASSERT_EQ(::getsockname(other_, address, &size), 0);
    port_ = std::to_string(ntohs(any.sin_port));
    WithDaemon::SetUp();
  }
  void TearDown() override { free(); }
  std::string moreSources() const override {
    return "[[facade]]\nkind = 'modbus'\nsource = 'short'\nport = " + port_ + "\n";
  }
  void free() {
    if (other_ >= 0) ::close(std::exchange(other_, -1));
  }

  std::string port_;

 private:
  int other_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
};

TEST_F(WithoutItsPort, DoctorFindsAFacadeThatIsNotThereUntilItIs) {
  Ran ran;
  ASSERT_TRUE(eventually([&] { return (ran = run("doctor --folder " + path("."))).status == 7; })) << ran.out;
  EXPECT_THAT(ran.out, HasSubstr("facade modbus: "));
  EXPECT_THAT(ran.out, HasSubstr(port_));
  EXPECT_THAT(ran.out, HasSubstr("BAD  short"));
  EXPECT_THAT(ran.out, HasSubstr("ok   pattern"));
  EXPECT_THAT(ran.out, HasSubstr("mend it: free what the error names"));
  free();  // the daemon tries again every second
  EXPECT_TRUE(eventually([&] { return (ran = run("doctor --folder " + path("."))).status == 0; })) << ran.out;
}

TEST_F(WithDaemon, DoctorFindsNothing) {
  const Ran ran = run("doctor --folder " + path("."));
  EXPECT_EQ(ran.status, 0) << ran.out;
  EXPECT_THAT(ran.out, HasSubstr("toftwind"));
  EXPECT_THAT(ran.out, HasSubstr("pattern"));
}

}  // namespace
}  // namespace toftwin::cli
