// SPDX-License-Identifier: Apache-2.0
#include "drivers/replay/replay.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <limits>

#include "drivers/compliance.h"
#include "drivers/pattern/pattern.h"
#include "protocol/record/recording.h"

namespace toftwin::drivers::replay {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kReceived_ns = 1'700'000'000'000'000'000;
constexpr std::int64_t kInterval_ns = 5'000'000;

/// A folder with the recording "run.mcap": six frames of the pattern at irregular times.
class Replay : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = testing::TempDir() + "replayXXXXXX";
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    auto writer = record::Writer::create(folder_ / "run.mcap");
    ASSERT_TRUE(writer.ok());
    auto keys =
        settings::Table::parse("width = 32\nheight = 16\npace = 'fast'\nframe_rate_hz = 200", "t");
    auto source = pattern::row().open(*keys);
    ASSERT_TRUE((*source)->start().ok());
    for (int i = 0; i < 6; ++i) {
      Frame frame = *(*source)->next({}, false);
      frame.source = "cam";
      frame.sequence = static_cast<std::uint64_t>(i);
      frame.moment.received.ns = kReceived_ns + i * kInterval_ns + (i == 3 ? 1'000'000 : 0);
      ASSERT_TRUE(writer->write(frame).ok());
      frames_.push_back(std::move(frame));
    }
    ASSERT_TRUE(writer->close().ok());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  Result<std::unique_ptr<Source>> open(const std::string& keys) {
    auto table = settings::Table::parse(keys, folder_ / "d.toml");
    return row().open(*table);
  }
  std::string errorOf(const std::string& keys) {
    const auto source = open(keys);
    return source ? "no error" : source.error().message;
  }
  static void expectSame(const Frame& played, const Frame& recorded) {
    EXPECT_EQ(played.moment, recorded.moment);
    EXPECT_EQ(played.camera, recorded.camera);
    EXPECT_EQ(played.provenance.kind, FrameKind::Replayed);
    ASSERT_EQ(played.planes.size(), recorded.planes.size());
    for (std::size_t i = 0; i < played.planes.size(); ++i) {
      EXPECT_EQ(played.planes[i].kind, recorded.planes[i].kind);
      EXPECT_TRUE(
          std::ranges::equal(played.planes[i].data.bytes(), recorded.planes[i].data.bytes()));
    }
  }

  std::filesystem::path folder_;
  std::vector<Frame> frames_;
};

TEST_F(Replay, GivesTheRecordedFramesBitForBitWithTheirTimes) {
  auto source = open("file = 'run.mcap'\npace = 'fast'");
  ASSERT_TRUE(source.ok()) << source.error().message;
  ASSERT_TRUE((*source)->start().ok());
  for (const Frame& recorded : frames_) {
    const auto played = (*source)->next({}, false);
    ASSERT_TRUE(played.ok()) << played.error().message;
    expectSame(*played, recorded);
  }
  const auto end = (*source)->next({}, false);
  EXPECT_EQ(end.error().code, Error::Code::EndOfStream);
  EXPECT_THAT(end.error().message, HasSubstr("run.mcap ended after 6 frames"));
}

TEST_F(Replay, ExactlyKeepsTheDistancesInTime) {
  auto source = open("file = 'run.mcap'");
  ASSERT_TRUE((*source)->start().ok());
  const auto begin = std::chrono::steady_clock::now();
  for (const Frame& recorded : frames_) {
    ASSERT_TRUE((*source)->next({}, false).ok());
    // Never early, which needs no tolerance: late is up to the machine.
    const auto passed = std::chrono::steady_clock::now() - begin;
    EXPECT_GE(passed.count(), recorded.moment.exposures[0].start.ns - frames_[0].moment.exposures[0].start.ns);
  }
}

TEST_F(Replay, InALoopGoesOnWithTimesMovedByTheLength) {
  auto source = open("file = 'run.mcap'\npace = 'fast'\nloop = true");
  ASSERT_TRUE((*source)->start().ok());
  for (std::int64_t round = 0; round < 3; ++round) {
    for (Frame recorded : frames_) {
      const std::int64_t shift = round * 6 * kInterval_ns;
      for (Exposure& exposure : recorded.moment.exposures) exposure.start.ns += shift;
      recorded.moment.received.ns += shift;
      const auto played = (*source)->next({}, false);
      ASSERT_TRUE(played.ok());
      expectSame(*played, recorded);
    }
  }
}

TEST_F(Replay, AStartBeginsWithTheFirstFrame) {
  auto source = open("file = 'run.mcap'\npace = 'fast'");
  ASSERT_TRUE((*source)->start().ok());
  ASSERT_TRUE((*source)->next({}, false).ok());
  const auto last = (*source)->next({}, false);
  (*source)->stop();
  ASSERT_TRUE((*source)->start().ok());
  const auto first = (*source)->next({}, false);
  ASSERT_TRUE(first.ok());
  EXPECT_TRUE(std::ranges::equal(first->planes[0].data.bytes(), frames_[0].planes[0].data.bytes()));
  EXPECT_GT(first->moment.exposures[0].start, last->moment.exposures[0].start);
}

TEST_F(Replay, UnderLockstepDoesNotWaitHoweverFarApartTheFramesAre) {
  {
    auto writer = record::Writer::create(folder_ / "slow.mcap");
    for (std::int64_t i = 0; i < 3; ++i) {
      Frame frame = frames_[static_cast<std::size_t>(i)];
      frame.moment.received.ns =
          kReceived_ns + i * 3'600'000'000'000;  // hours: the test would time out
      ASSERT_TRUE(writer->write(frame).ok());
    }
  }
  auto source = open("file = 'slow.mcap'");
  ASSERT_TRUE((*source)->start().ok());
  for (int i = 0; i < 3; ++i) ASSERT_TRUE((*source)->next({}, true).ok());
}

TEST_F(Replay, KnowsItsCamera) {
  auto source = open("file = 'run.mcap'");
  const SourceInfo& info = (*source)->info();
  EXPECT_EQ(info.camera, frames_[0].camera);
  EXPECT_EQ(info.planes.size(), frames_[0].planes.size());
  EXPECT_EQ(info.kind, FrameKind::Replayed);
  EXPECT_DOUBLE_EQ(info.frame_interval->in(nanosecond), kInterval_ns);
  EXPECT_TRUE(info.can_lockstep);
}

TEST_F(Replay, IsCompliant) {
  const Driver driver = row();
  const std::string file = (folder_ / "run.mcap").string();
  for (const std::string pace : {"fast", "exact"}) {
    const Candidate candidate{.driver = &driver,
                              .keys = "file = '" + file + "'\nloop = true\npace = '" + pace + "'",
                              .absent_keys = "file = '" + (folder_ / "absent.mcap").string() + "'",
                              .absent_name = "absent.mcap"};
    for (const Finding& finding : checkCompliance(candidate)) {
      EXPECT_NE(finding.outcome, Finding::Outcome::Failed)
          << finding.check << ", because " << finding.because << "\n  " << finding.detail;
    }
  }
}

TEST_F(Replay, AWrongFileIsNamedWithItsPlaceInTheConfiguration) {
  EXPECT_THAT(errorOf("file = 'absent.mcap'"), HasSubstr("d.toml:1: file \"absent.mcap\""));
  std::ofstream{folder_ / "text.mcap"} << "this is no recording";
  EXPECT_THAT(errorOf("file = 'text.mcap'"), HasSubstr("d.toml:1: file \"text.mcap\""));
  EXPECT_THAT(errorOf("loop = true"), HasSubstr("needs the path of a recording"));
  EXPECT_THAT(errorOf("file = 'run.mcap'\nrecorded_source = 'mac'"), HasSubstr("it has: cam"));
  EXPECT_THAT(errorOf("file = 'run.mcap'\npase = 'fast'"), HasSubstr("unknown key \"pase\""));
}

TEST_F(Replay, OfATruncatedRecordingGivesWhatIsThereAndSaysThatItIsDamaged) {
  const auto whole = folder_ / "run.mcap";
  std::filesystem::resize_file(whole, std::filesystem::file_size(whole) - 40);
  auto source = open("file = 'run.mcap'\npace = 'fast'");
  ASSERT_TRUE(source.ok()) << source.error().message;
  ASSERT_TRUE((*source)->start().ok());
  ASSERT_TRUE((*source)->next({}, false).ok());
  Result<Frame> next = (*source)->next({}, false);
  while (next) next = (*source)->next({}, false);
  EXPECT_EQ(next.error().code, Error::Code::EndOfStream);
  EXPECT_THAT(next.error().message, HasSubstr("damaged"));
}

/// Records the given frames in chunks of one frame each and damages those of `damaged`.
void recordDamaged(const std::filesystem::path& file, const std::vector<Frame>& frames,
                   const std::vector<std::size_t>& damaged) {
  std::vector<std::uintmax_t> ends{0};
  {
    auto writer = record::Writer::create(file, {.chunk_bytes = 1, .overwrite = true});
    for (const Frame& frame : frames) {
      ASSERT_TRUE(writer->write(frame).ok());
      ends.push_back(std::filesystem::file_size(file));
    }
    ASSERT_TRUE(writer->close().ok());
  }
  std::fstream bytes{file, std::ios::in | std::ios::out | std::ios::binary};
  for (const std::size_t i : damaged) {
    const auto middle = static_cast<std::streamoff>((ends[i] + ends[i + 1]) / 2);
    ASSERT_LT(ends[i], ends[i + 1]);
    const char other = static_cast<char>((bytes.seekg(middle), bytes.get()) ^ 0x55);
    bytes.seekp(middle).put(other);
  }
  ASSERT_TRUE(bytes.good());
}

TEST_F(Replay, GoesOnBehindDamageAndCountsWhatIsLost) {
  recordDamaged(folder_ / "damaged.mcap", frames_, {1, 2, 4});
  auto source = open("file = 'damaged.mcap'\npace = 'fast'");
  ASSERT_TRUE(source.ok()) << source.error().message;
  EXPECT_FALSE((*source)->info().frame_interval) << "the second frame that is read is the fourth";
  ASSERT_TRUE((*source)->start().ok());
  for (const std::size_t i : {0u, 3u, 5u}) {
    const auto played = (*source)->next({}, false);
    ASSERT_TRUE(played.ok()) << played.error().message;
    expectSame(*played, frames_[i]);
    EXPECT_EQ(played->dropped_by_device, i == 0 ? 0u : i == 3 ? 2u : 1u);
  }
  const auto end = (*source)->next({}, false);
  EXPECT_EQ(end.error().code, Error::Code::EndOfStream);
  EXPECT_THAT(end.error().message, HasSubstr("ended after 3 frames"));
  EXPECT_THAT(end.error().message, HasSubstr("3 damaged places were left out, the first: "));
}

TEST_F(Replay, InALoopPlaysADamagedRecordingToItsEndEachTime) {
  recordDamaged(folder_ / "damaged.mcap", frames_, {0, 3});
  auto source = open("file = 'damaged.mcap'\npace = 'fast'\nloop = true");
  ASSERT_TRUE(source.ok()) << source.error().message;
  ASSERT_TRUE((*source)->start().ok());
  for (int round = 0; round < 2; ++round) {
    for (const std::size_t i : {1u, 2u, 4u, 5u}) {
      const auto played = (*source)->next({}, false);
      ASSERT_TRUE(played.ok()) << played.error().message;
      EXPECT_TRUE(
          std::ranges::equal(played->planes[0].data.bytes(), frames_[i].planes[0].data.bytes()));
      EXPECT_EQ(played->dropped_by_device, i == 4 ? 1u : 0u);
    }
  }
}

TEST_F(Replay, ARecordingWithoutAnyWholeFrameIsRefused) {
  recordDamaged(folder_ / "damaged.mcap", frames_, {0, 1, 2, 3, 4, 5});
  EXPECT_THAT(errorOf("file = 'damaged.mcap'"),
              HasSubstr("has no frame of \"cam\" that can be read; 6 damaged places"));
}

TEST_F(Replay, TimesThatGoBackGiveNoFrameInterval) {
  std::swap(frames_[0], frames_[1]);
  recordDamaged(folder_ / "back.mcap", frames_, {});
  const auto source = open("file = 'back.mcap'");
  ASSERT_TRUE(source.ok()) << source.error().message;
  EXPECT_FALSE((*source)->info().frame_interval);
}

/// Nothing to compute with; UBSan sees whether anything overflows.
TEST_F(Replay, TimesAtTheEndsOfWhatCanBeExpressedDoNotOverflow) {
  constexpr auto kMost = std::numeric_limits<std::int64_t>::max();
  constexpr auto kLeast = std::numeric_limits<std::int64_t>::min();
  frames_.resize(2);
  for (const bool falling : {false, true}) {
    for (const std::size_t i : {0u, 1u}) {
      const std::int64_t time_ns = (i == 0) == falling ? kMost : kLeast;
      frames_[i].moment.received.ns = time_ns;
      for (Exposure& exposure : frames_[i].moment.exposures) exposure.start.ns = time_ns;
    }
    recordDamaged(folder_ / "hostile.mcap", frames_, {});
    for (const std::string pace : {"fast", "exact"}) {
      auto source = open("file = 'hostile.mcap'\nloop = true\npace = '" + pace + "'");
      ASSERT_TRUE(source.ok()) << source.error().message;
      EXPECT_FALSE((*source)->info().frame_interval);
      ASSERT_TRUE((*source)->start().ok());
      DeviceTime last{kLeast};
      for (int k = 0; k < 6; ++k) {
        const auto played = (*source)->next({}, pace == "fast");
        if (!played) {  // exactly as recorded, the next comes in centuries
          EXPECT_EQ(played.error().code, Error::Code::Timeout) << played.error().message;
          break;
        }
        if (!falling) {
          EXPECT_GE(played->moment.exposures[0].start, last) << "frame " << k;
        }
        last = played->moment.exposures[0].start;
      }
    }
  }
}

TEST_F(Replay, DoesNotWaitForAClockThatWasSetWhileRecording) {
  for (std::size_t i = 3; i < frames_.size(); ++i) frames_[i].moment.received.ns += 57ll * 365 * 86'400 * 1'000'000'000;
  recordDamaged(folder_ / "set.mcap", frames_, {});
  auto source = open("file = 'set.mcap'");
  ASSERT_TRUE(source.ok()) << source.error().message;
  ASSERT_TRUE((*source)->start().ok());
  for (const Frame& recorded : frames_) {
    const auto played = (*source)->next({}, false);
    ASSERT_TRUE(played.ok()) << played.error().message;
    EXPECT_EQ(played->moment.received, recorded.moment.received) << "times stay as they were recorded";
  }
}

TEST_F(Replay, ShortensALongPause) {
  for (std::size_t i = 3; i < frames_.size(); ++i) {
    frames_[i].moment.received.ns += 3'600'000'000'000;  // an hour: the test would time out
    for (Exposure& exposure : frames_[i].moment.exposures) exposure.start.ns += 3'600'000'000'000;
  }
  recordDamaged(folder_ / "pause.mcap", frames_, {});
  auto source = open("file = 'pause.mcap'\nmost_gap_s = 0.01");
  ASSERT_TRUE(source.ok()) << source.error().message;
  ASSERT_TRUE((*source)->start().ok());
  for (std::size_t i = 0; i < frames_.size(); ++i) ASSERT_TRUE((*source)->next({}, false).ok()) << i;
}

}  // namespace
}  // namespace toftwin::drivers::replay
