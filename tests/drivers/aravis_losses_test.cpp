// SPDX-License-Identifier: Apache-2.0
// What networks and cameras lose, and that nothing is kept.
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

TEST(AravisLost, FramesAreCountedByTheirIds) {
  EXPECT_EQ(lostBetween(10, 11, 0), 0u);
  EXPECT_EQ(lostBetween(10, 14, 0), 3u);
  EXPECT_EQ(lostBetween(10, 11, 2), 2u) << "what came and could not be used";
  EXPECT_EQ(lostBetween(65'535, 1, 0), 0u) << "0 is no id";
  EXPECT_EQ(lostBetween(65'534, 2, 0), 2u);
  EXPECT_EQ(lostBetween(500, 3, 1), 1u) << "the camera began anew";
  EXPECT_EQ(lostBetween(1ULL << 40, (1ULL << 40) + 2, 0), 1u);
  EXPECT_EQ(lostBetween(5, 1ULL << 40, 0), 0u) << "no such gap is believed";
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
