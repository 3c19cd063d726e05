// SPDX-License-Identifier: Apache-2.0
#include "daemon/record_plan.h"

#include <gmock/gmock.h>

#include <chrono>
#include <filesystem>
#include <fstream>

#include "daemon/recorder.h"

namespace toftwin::daemon {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr HostTime kNow{1'700'000'000'000'000'000};  // 14 November 2023, 22:13:20

RecordKeys keysOf(std::string file, std::string split = {}, std::string keep = {}) {
  return {std::move(file), std::move(split), std::move(keep)};
}

class Plan : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = testing::TempDir() + "planXXXXXX";
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }
  RecordPlan plan(const RecordKeys& keys) {
    auto read = readRecordPlan(keys, folder_);
    EXPECT_TRUE(read.ok()) << read.error().message;
    return *read;
  }
  /// A file of that size, written so many minutes before now.
  void put(const std::string& name, std::size_t bytes, int minutes_ago) {
    std::ofstream{folder_ / name} << std::string(bytes, 'x');
    const auto wall = std::chrono::sys_time<std::chrono::nanoseconds>{std::chrono::nanoseconds{kNow.ns}} -
                      std::chrono::minutes{minutes_ago};
    fs::last_write_time(folder_ / name, std::chrono::file_clock::from_sys(wall));
  }
  [[nodiscard]] std::vector<std::string> left() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator{folder_}) names.push_back(entry.path().filename());
    std::ranges::sort(names);
    return names;
  }
  fs::path folder_;
};

TEST_F(Plan, ReadsSizesAndTimes) {
  const RecordPlan by_time = plan(keysOf("cam-%H%M", "10min", "200GB"));
  EXPECT_EQ(by_time.split, 10min);
  EXPECT_EQ(by_time.keep_bytes, 200'000'000'000u);
  const RecordPlan by_size = plan(keysOf("cam-%H%M.mcap", "500MB", "7d"));
  EXPECT_EQ(by_size.split_bytes, 500'000'000u);
  EXPECT_EQ(by_size.keep_time, 168h);
  for (const char* bad : {"10", "min", "0s", "-1h", "10 min", "1.5GB", "9999999d", "10minutes"}) {
    EXPECT_FALSE(readRecordPlan(keysOf("a", bad), folder_).ok()) << bad;
  }
  EXPECT_THAT(readRecordPlan(keysOf("a"), {}).error().message, HasSubstr("recording_folder"));
  EXPECT_THAT(readRecordPlan(keysOf("%Y/a"), folder_).error().message, HasSubstr("only the name"));
}

TEST_F(Plan, NamesAFileByTheTimeInUtcAndNeverOneThatIsThere) {
  const RecordPlan by_minute = plan(keysOf("cam-%Y%m%d-%H%M.mcap"));
  EXPECT_EQ(nextFile(by_minute, kNow).filename(), "cam-20231114-2213.mcap");
  put("cam-20231114-2213.mcap", 1, 0);
  put("cam-20231114-2213-2.mcap", 1, 0);
  EXPECT_EQ(nextFile(by_minute, kNow).filename(), "cam-20231114-2213-3.mcap");
}

TEST_F(Plan, RemovesItsOldestFilesAndNothingElse) {
  const RecordPlan rotating = plan(keysOf("cam-%H%M.mcap", "", "1MB"));
  put("cam-0900.mcap", 400'000, 50);
  put("cam-1000.mcap", 400'000, 40);
  put("cam-1100.mcap", 400'000, 30);
  put("cam-1200.mcap", 400'000, 20);
  put("other-0800.mcap", 400'000, 60);
  put("cam-0800.txt", 400'000, 60);
  EXPECT_EQ(makeRoom(rotating, kNow, 0), 2u);
  EXPECT_THAT(left(), testing::ElementsAre("cam-0800.txt", "cam-1100.mcap", "cam-1200.mcap", "other-0800.mcap"));
}

TEST_F(Plan, RemovesWhatIsTooOldButForTheNewest) {
  const RecordPlan rotating = plan(keysOf("cam-%H%M.mcap", "", "1h"));
  put("cam-1.mcap", 10, 200);
  put("cam-2.mcap", 10, 100);
  put("cam-3.mcap", 10, 90);
  EXPECT_EQ(makeRoom(rotating, kNow, 0), 2u);
  EXPECT_THAT(left(), testing::ElementsAre("cam-3.mcap"));
}

TEST_F(Plan, RemovesNothingWhereAllIsToBeKeptHoweverFullTheDisk) {
  const RecordPlan keeping = plan(keysOf("cam-%H%M.mcap"));
  put("cam-1.mcap", 10, 200);
  put("cam-2.mcap", 10, 100);
  EXPECT_EQ(makeRoom(keeping, kNow, ~std::uint64_t{0}), 0u);
  EXPECT_EQ(makeRoom(plan(keysOf("cam-%H%M.mcap", "", "1TB")), kNow, ~std::uint64_t{0}), 1u) << "on a full disk";
}

TEST_F(Plan, SaysHowLongTheDiskLasts) {
  const auto here = readRecordPlan(keysOf("a"), ".");  // of a configuration that was named without a folder
  ASSERT_TRUE(here.ok());
  EXPECT_TRUE(here->pattern.is_absolute());
  EXPECT_THAT(howLong(plan(keysOf("a", "", "3600MB")), 0, 1e6),
              testing::AllOf(HasSubstr("1.0 h at 1.0 MB/s"), HasSubstr("the oldest files make room")));
}

TEST(Recorder, HurriesOnceAFrameHasWaitedForHalfAChunk) {
  const SteadyTime made{10s};
  EXPECT_FALSE(isBehind(made, made, 250ms));
  EXPECT_FALSE(isBehind(made, made + 125ms, 250ms));
  EXPECT_TRUE(isBehind(made, made + 126ms, 250ms));
}

}  // namespace
}  // namespace toftwin::daemon
