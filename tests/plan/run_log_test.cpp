// SPDX-License-Identifier: Apache-2.0
// The log of runs: what was put in comes out, once, and what is no log is refused.
#include "calib/plan/run_log.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>

namespace toftwin::plan {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

class Log : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  static LoggedRun run(const std::string& began, const std::string& hash) {
    return {.judged = "2026-11-22T03:00:00Z",
            .began = began,
            .folder = "/runs/1",
            .plan = "standard",
            .camera_a = "kinect, Kinect v2 1",
            .camera_b = "twin, Kinect v2 ",
            .software = "toftwin 0",
            .note = "it's \"quoted\"",
            .index_sha256 = hash,
            .is_locked = false};
  }
  static RunTraits drifts(double a, double b) {
    RunTraits all;
    all.traits = {{"drift, ramp", "A", {"drift", "mm", a, a - 1.0, a + 1.0, 14}},
                  {"drift, ramp", "B", {"drift", "mm", b, b - 0.5, std::nan(""), 12}},
                  {"masks", "A and B", {"kappa", "1", 0.9, 0.8, 1.0, 80}}};
    all.untold = {"latency: nothing moves"};
    return all;
  }
  fs::path folder_ = fs::temp_directory_path() / fmt::format("toftwin_log_{}", getpid());
  fs::path file_ = folder_ / "log.sqlite";
};

TEST_F(Log, GivesWhatWasPutInByTheRunsBeginning) {
  auto log = RunLog::open(file_);
  ASSERT_TRUE(log) << log.error().message;
  ASSERT_TRUE(log->add(run("2026-11-02T00:00:00Z", "bb"), drifts(3.0, 4.0)));
  ASSERT_TRUE(log->add(run("2026-11-01T00:00:00Z", "aa"), drifts(1.0, 2.0)));
  auto again = RunLog::open(file_);
  ASSERT_TRUE(again);
  const auto runs = again->runs();
  ASSERT_TRUE(runs);
  ASSERT_EQ(runs->size(), 2u);
  EXPECT_EQ(runs->front().index_sha256, "aa");
  EXPECT_EQ(runs->front().note, "it's \"quoted\"");
  const auto of_b = again->traits("twin", "drift", "");
  ASSERT_TRUE(of_b);
  ASSERT_EQ(of_b->size(), 2u);
  EXPECT_EQ(of_b->front().trait.trait.value, 2.0);
  EXPECT_EQ(of_b->back().trait.trait.value, 4.0);
  EXPECT_TRUE(std::isnan(of_b->front().trait.trait.high));
  EXPECT_EQ(of_b->front().trait.trait.n, 12u);
  EXPECT_EQ(again->traits("", "", "")->size(), 6u);
  EXPECT_TRUE(again->traits("nobody", "", "")->empty());
}

TEST_F(Log, TakesTheSameCapturesOnce) {
  auto log = RunLog::open(file_);
  ASSERT_TRUE(log);
  ASSERT_TRUE(log->add(run("2026-11-01T00:00:00Z", "aa"), drifts(1.0, 2.0)));
  ASSERT_TRUE(log->add(run("2026-11-01T00:00:00Z", "aa"), drifts(5.0, 6.0)));
  EXPECT_EQ(log->runs()->size(), 1u);
  const auto all = log->traits("kinect", "drift", "");
  ASSERT_EQ(all->size(), 1u);
  EXPECT_EQ(all->front().trait.trait.value, 5.0);
}

TEST_F(Log, RefusesWhatIsNone) {
  std::ofstream{file_} << std::string(5000, 'x');
  EXPECT_THAT(RunLog::open(file_).error().message, HasSubstr("is no SQLite database"));
  EXPECT_THAT(RunLog::open(folder_ / "none" / "log").error().message, HasSubstr("cannot be opened"));
}

}  // namespace
}  // namespace toftwin::plan
