// SPDX-License-Identifier: Apache-2.0
// What networks and cameras lose, and that nothing is kept.
#include <cmath>
#include <optional>
#include <random>
#include <thread>

#include "aravis_testing.h"
#include "drivers/aravis/frame_ids.h"
#include "start_stop.h"

namespace toftwin::drivers::aravis {
namespace {

using Emulated = toftwin::test::EmulatedGige;
using std::chrono::milliseconds;

class AravisLosses : public test::Aravis {};

/// Frames of a camera with so many milliseconds between them, each with the number that the test gives it.
class Numbered {
 public:
  explicit Numbered(std::optional<Duration> interval = 20_ms) : ids_(interval) {}
  /// Lost before a frame that came and was taken so long after the one before it.
  std::uint64_t lost(std::uint64_t id, double after_ms = 20.0, std::uint64_t bad = 0) {
    return lost(id, after_ms, after_ms, bad);
  }
  std::uint64_t lost(std::uint64_t id, double came_after_ms, double taken_after_ms, std::uint64_t bad) {
    arrived_ += std::chrono::nanoseconds{std::llround(came_after_ms * 1e6)};
    taken_.ns += std::llround(taken_after_ms * 1e6);
    return ids_.lostBefore({id, arrived_, taken_}, bad);
  }
  FrameIds& ids() { return ids_; }

 private:
  FrameIds ids_;
  SteadyTime arrived_;
  DeviceTime taken_;
};

TEST(AravisLost, FramesAreCountedByTheirIds) {
  Numbered frames;
  EXPECT_EQ(frames.lost(10), 0u) << "the first";
  EXPECT_EQ(frames.lost(11), 0u);
  EXPECT_EQ(frames.lost(15, 80.0), 3u);
  EXPECT_EQ(frames.lost(16, 60.0, 2), 2u) << "what came and could not be used";
  EXPECT_EQ(frames.lost(30'016, 600'000.0), 29'999u) << "ten minutes";
  frames.ids().restart();
  EXPECT_EQ(frames.lost(9, 20.0), 0u) << "another stream";
}

TEST(AravisLost, IdsOf16BitsWrapAroundAndOthersGoOn) {
  Numbered frames;
  frames.lost(65'534);
  EXPECT_EQ(frames.lost(65'535), 0u);
  EXPECT_EQ(frames.lost(1), 0u) << "0 is no id";
  Numbered gap;
  gap.lost(65'534);
  EXPECT_EQ(gap.lost(2, 60.0), 2u);
  Numbered wide;
  wide.lost(1ULL << 40);
  EXPECT_EQ(wide.lost((1ULL << 40) + 2, 40.0), 1u);
}

TEST(AravisLost, ADamagedIdInventsNoLossAndHidesNone) {
  for (const std::uint64_t damaged : {1'013ULL, 1'100ULL, 99'000ULL, 1ULL << 40, 3ULL, 1'010ULL}) {
    Numbered frames;
    EXPECT_EQ(frames.lost(1'010), 0u);
    EXPECT_EQ(frames.lost(damaged), 0u) << damaged;
    EXPECT_EQ(frames.lost(1'012), 0u) << damaged << ": from the last one that was believed";
    EXPECT_EQ(frames.lost(1'015, 60.0), 2u) << damaged;
    EXPECT_EQ(frames.lost(damaged, 80.0, 1), 1u) << damaged << ": what came and could not be used";
    EXPECT_EQ(frames.lost(1'020, 20.0), 2u)
        << damaged << ": of four in between one came, and one was told already";
    EXPECT_EQ(frames.lost(1'021), 0u) << damaged;
  }
}

TEST(AravisLost, ACameraThatBeganAnewIsCountedFromThere) {
  Numbered frames;
  frames.lost(500);
  EXPECT_EQ(frames.lost(3, 5'000.0, 1), 1u);
  EXPECT_EQ(frames.lost(4), 0u);
  EXPECT_EQ(frames.lost(7, 60.0), 2u);
  Numbered damaged_first;
  damaged_first.lost(40'000);
  EXPECT_EQ(damaged_first.lost(12), 0u);
  EXPECT_EQ(damaged_first.lost(15, 60.0), 2u);
}

// The library's thread that was held up takes what waited at once, and what it left in the kernel too long is
// lost.
TEST(AravisLost, AGapBetweenFramesThatCameLateIsCountedByWhenTheyWereTaken) {
  Numbered frames;
  frames.lost(10);
  frames.lost(11, 200.0, 20.0, 0);
  EXPECT_EQ(frames.lost(20, 0.1, 180.0, 0), 8u);
  EXPECT_EQ(frames.lost(70'000, 20.0, 3.6e9, 0), 0u) << "a damaged time does not make a damaged id credible";
}

TEST(AravisLost, CamerasThatAreFasterThanTheySayOrDoNotSayItAreBelieved) {
  Numbered fast{100_ms};
  for (std::uint64_t id = 1; id <= 30; ++id) EXPECT_EQ(fast.lost(id, 10.0), 0u);
  EXPECT_EQ(fast.lost(34, 40.0), 3u);
  EXPECT_EQ(fast.lost(38, 10.0), 0u);
  Numbered triggered{std::nullopt};
  triggered.lost(10);
  EXPECT_EQ(triggered.lost(14, 33.0), 3u);
  EXPECT_EQ(triggered.lost(99'000, 33.0), 0u);
  Numbered set{100_ms};
  set.lost(10);
  set.ids().setInterval(10_ms);
  EXPECT_EQ(set.lost(14, 40.0), 3u) << "its rate was set";
}

TEST(AravisLost, WhatFoundNoBufferIsOfTheNextGapOnly) {
  Underruns underruns;
  // Two frames wait while no buffer is free: the gap comes behind them.
  EXPECT_EQ(underruns.before(true, 3, false), 3u);
  underruns.before(false, 20, false);
  underruns.before(false, 20, true);
  EXPECT_EQ(underruns.before(true, 20, true), 17u);
  // A frame whose first packets found none came after all: what the camera leaves out later is not for want
  // of buffers.
  underruns.before(false, 25, true);
  underruns.before(false, 25, true);
  EXPECT_EQ(underruns.before(true, 25, true), 0u);
}

TEST_F(AravisLosses, FramesThatNobodyMadeRoomForSayWhy) {
  const auto source = started("buffers = 4");
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  std::this_thread::sleep_for(milliseconds{300});
  std::string why;
  for (int i = 0; i < 10 && why.empty(); ++i) {
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    why = frame->dropped_because;
  }
  EXPECT_EQ(why.find("no buffer was free for it ("), 0u) << why;
}

TEST_F(AravisLosses, LostPacketsAreAskedForAgainAndNoFrameIsLost) {
  // Of few packets the library would ask for a quarter only, if it was not told otherwise.
  for (const auto& [packet_size, drop_every] : {std::pair{576, 9}, {9000, 3}}) {
    const auto source = started(fmt::format("packet_size = {}", packet_size));
    ASSERT_NE(source, nullptr);
    ASSERT_TRUE(nextFrame(*source).ok());
    camera_.resent = 0;
    camera_.drop_every = drop_every;
    std::uint64_t lost = 0;
    for (int i = 0; i < 20; ++i) {
      const auto frame = nextFrame(*source);
      ASSERT_TRUE(frame.ok()) << frame.error().message;
      lost += frame->dropped_by_device;
    }
    EXPECT_EQ(lost, 0u) << packet_size;
    EXPECT_GT(camera_.resent, 20);
    camera_.drop_every = 0;
  }
}

TEST_F(AravisLosses, WithoutResendingTheyAreLostFramesAndCounted) {
  const auto source = started("packet_size = 576\nresend = false");
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  camera_.drop_every = 45;  // a frame has about 20 packets
  std::uint64_t lost = 0;
  for (int i = 0; i < 10; ++i) {
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    lost += frame->dropped_by_device;
    EXPECT_EQ(frame->dropped_because.find("packets of it did not come (") == 0, frame->dropped_by_device > 0)
        << frame->dropped_because;
  }
  EXPECT_GT(lost, 2u);
  EXPECT_EQ(camera_.resent, 0);
}

TEST_F(AravisLosses, FramesThatTheCameraLeftOutAreCounted) {
  const auto source = started();
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  camera_.skip_frames = 3;
  std::uint64_t lost = 0;
  for (int i = 0; i < 20 && lost == 0; ++i) {
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    lost = frame->dropped_by_device;
    EXPECT_EQ(frame->dropped_because, lost == 0 ? "" : "nothing of it came (3)");
  }
  EXPECT_EQ(lost, 3u);
}

TEST_F(AravisLosses, DamagedIdsInventNoLostFrames) {
  const auto source = started("packet_size = 9000\nresend = false");
  ASSERT_NE(source, nullptr);
  source->stop();
  // All packets of each third frame say a number that is 32768 larger or smaller. (Of one that is up to a
  // hundred larger, the library takes the frames behind it for late ones, and leaves them out.)
  camera_.damage = [](std::vector<std::byte>& packet) {
    constexpr std::size_t kLowest = 15;  // of the id's eight bytes
    if (std::to_integer<unsigned>(packet.at(kLowest)) % 3 == 0) packet.at(kLowest - 1) ^= std::byte{0x80};
  };
  ASSERT_TRUE(source->start().ok());
  std::uint64_t lost = 0;
  constexpr int kFrames = 60;
  auto last = nextFrame(*source);
  ASSERT_TRUE(last.ok());
  const auto begin = last->moment.exposures.at(0).start;
  for (int i = 0; i < kFrames; ++i) {
    last = nextFrame(*source);
    ASSERT_TRUE(last.ok()) << last.error().message;
    lost += last->dropped_by_device;
  }
  source->stop();
  camera_.damage = nullptr;
  const double intervals = static_cast<double>(last->moment.exposures.at(0).start.ns - begin.ns) / 20e6;
  EXPECT_LE(static_cast<double>(lost), intervals - kFrames + 1.0) << "as many as there was time for";
}

TEST_F(AravisLosses, ThePacketSizeIsTheLargestThatComesThrough) {
  {
    const auto source = started();
    ASSERT_NE(source, nullptr);
    ASSERT_TRUE(nextFrame(*source).ok());
    EXPECT_GT(camera_.largest_packet, 3000) << "jumbo packets";
  }
  camera_.largest_packet = 0;
  camera_.is_full_size_lost = true;
  const auto source = started();
  ASSERT_NE(source, nullptr);
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(nextFrame(*source).ok());
  EXPECT_LE(camera_.largest_packet, 1500);
  EXPECT_GT(camera_.largest_packet, 1400);
}

TEST_F(AravisLosses, ALineThatIsCutIsDisconnectedAndClosingIsSoon) {
  auto source = started();
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  camera_.is_cut = true;
  const auto cut_at = std::chrono::steady_clock::now();
  Result<Frame> frame = nextFrame(*source);
  for (int i = 0; i < 10 && frame; ++i) frame = nextFrame(*source);
  ASSERT_FALSE(frame.ok());
  EXPECT_EQ(frame.error().code, Error::Code::Disconnected) << frame.error().message;
  EXPECT_FALSE(source->setParameter("Gain", 1).ok());
  source->stop();
  source.reset();
  const auto took = std::chrono::steady_clock::now() - cut_at;
  EXPECT_LT(took, milliseconds{4000}) << "the library alone takes five seconds for the closing";
  const auto absent = open();
  ASSERT_FALSE(absent.ok());
  EXPECT_EQ(absent.error().code, Error::Code::NotFound) << absent.error().message;
}

TEST_F(AravisLosses, ALineThatWasCutUnnoticedDoesNotHoldUpTheEnd) {
  for (const bool is_streaming : {true, false}) {
    auto opened = open();
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    if (is_streaming) {
      ASSERT_TRUE((*opened)->start().ok());
      ASSERT_TRUE(nextFrame(**opened).ok());
    }
    camera_.is_cut = true;
    const auto cut_at = std::chrono::steady_clock::now();
    opened->reset();
    const auto took = std::chrono::steady_clock::now() - cut_at;
    EXPECT_LT(took, milliseconds{1500}) << "the library alone takes 12.5 s, or 5.0";
    camera_.reboot();
    camera_.is_cut = false;
  }
}

TEST_F(AravisLosses, ACameraThatWasRestartedIsDisconnectedEvenIfItAnswers) {
  const auto source = started();
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  camera_.reboot();
  Result<Frame> frame = nextFrame(*source);
  for (int i = 0; i < 10 && frame; ++i) frame = nextFrame(*source);
  ASSERT_FALSE(frame.ok());
  EXPECT_EQ(frame.error().code, Error::Code::Disconnected);
  EXPECT_NE(frame.error().message.find("forgotten"), std::string::npos) << frame.error().message;
}

TEST_F(AravisLosses, AHungCameraIsATimeoutAndGoesOnWhereItStopped) {
  const auto source = started();
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  camera_.is_hung = true;
  Result<Frame> frame = source->next({}, false);
  for (int i = 0; i < 10 && frame; ++i) frame = source->next({}, false);
  ASSERT_FALSE(frame.ok());
  EXPECT_EQ(frame.error().code, Error::Code::Timeout) << frame.error().message;
  camera_.is_hung = false;
  EXPECT_TRUE(nextFrame(*source).ok());
}

/// Whatever is done to the stream's packets, the driver gives frames, says that some are damaged,
/// or that the camera is to be opened anew.
TEST_F(AravisLosses, DamagedPacketsDoNoHarm) {
  constexpr unsigned kSeed = 7;
  std::mt19937 random{kSeed};
  const auto damage = [&random](std::vector<std::byte>& packet) {
    if (random() % 4 != 0) return;
    if (random() % 8 == 0) packet.resize(random() % (packet.size() + 1));
    // Mostly what stands at the beginning: kinds, numbers, sizes.
    const std::size_t most = std::min<std::size_t>(packet.size(), random() % 2 == 0 ? 200 : 2000);
    for (int i = 0; i < 3 && most > 0; ++i)
      packet[random() % most] = static_cast<std::byte>(random());
  };
  for (const char* keys : {"", "components = ['Range']", "components = ['Range']\nchunks = true"}) {
    camera_.damage = nullptr;
    auto source = started(keys);
    ASSERT_NE(source, nullptr) << keys;
    int good = 0, damaged = 0;
    source->stop();
    camera_.damage = damage;
    ASSERT_TRUE(source->start().ok());
    for (int i = 0; i < 150; ++i) {
      const auto frame = source->next({}, false);
      (frame.ok() ? good : damaged) += 1;
      if (frame) {
        EXPECT_EQ(frame->planes.size(), source->info().planes.size());
        continue;
      }
      if (frame.error().code == Error::Code::Disconnected) {
        source->stop();
        ASSERT_TRUE(source->start().ok());
      }
    }
    source->stop();
    source.reset();
    EXPECT_GT(good, 0) << keys << ", seed " << kSeed;
  }
  camera_.damage = nullptr;
}

// ---- nothing is kept ---------------------------------------------------------------------------

TEST_F(AravisLosses, OpeningAndClosingLeavesNothingBehind) {
  { ASSERT_NE(started(), nullptr); }
  const auto threads = toftwin::test::entriesOf("/proc/self/task"), files = toftwin::test::entriesOf("/proc/self/fd");
  for (int i = 0; i < 10; ++i) {
    const auto source = started();
    ASSERT_NE(source, nullptr);
    ASSERT_TRUE(nextFrame(*source).ok());
  }
  EXPECT_EQ(toftwin::test::entriesOf("/proc/self/task"), threads) << "no thread outlives its source";
  EXPECT_EQ(toftwin::test::entriesOf("/proc/self/fd"), files);
}

TEST_F(AravisLosses, TenThousandStartsAndStopsKeepNothing) {
  const auto source = open("packet_size = 1500");
  ASSERT_TRUE(source.ok());
  toftwin::test::expectNothingKept("aravis", **source, 1000);
}

}  // namespace
}  // namespace toftwin::drivers::aravis
