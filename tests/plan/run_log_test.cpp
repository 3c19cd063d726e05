// SPDX-License-Identifier: Apache-2.0
// The log of runs: what was put in comes out, once, and what is no log is refused.
#include "calib/plan/run_log.h"

#include <gmock/gmock.h>
#include <sqlite3.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>

#include "calib/plan/sought.h"
#include "calib/plan/trend.h"
#include "tests/record/record_testing.h"

namespace toftwin::plan {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

class Log : public testing::Test {
 protected:
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
    all.traits = {{"drift", "ramp", "A", {"drift", "mm", a, a - 1.0, a + 1.0, 14}},
                  {"drift", "ramp", "B", {"drift", "mm", b, b - 0.5, std::nan(""), 12}},
                  {"masks", "", "A and B", {"kappa", "1", 0.9, 0.8, 1.0, 80}}};
    all.untold = {"latency: nothing moves"};
    return all;
  }
  void sql(const std::string& text) const {
    sqlite3* raw = nullptr;
    EXPECT_EQ(sqlite3_open(file_.c_str(), &raw), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(raw, text.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(raw);
    sqlite3_close(raw);
  }
  std::string refusal() const {
    const auto log = RunLog::open(file_);
    return log ? "it was opened" : log.error().message;
  }
  record::Folder folder_;
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
  EXPECT_EQ(of_b->front().trait.detail, "ramp");
  EXPECT_EQ(again->traits("", "", "")->size(), 6u);
  EXPECT_TRUE(again->traits("nobody", "", "")->empty());
}

/// The log alone must not say more surely than the report does, nor an offset without the distance that it is told at.
TEST_F(Log, KeepsThatANumberIsInDoubtAndWhereItIsTold) {
  RunTraits all = drifts(1.0, 2.0);
  all.traits[0].trait.doubt = "it may be a wave that is not told";
  all.traits[1].trait.refers_to = compare::OnLine{.at_m = 1.79};
  auto log = RunLog::open(file_);
  ASSERT_TRUE(log && log->add(run("2026-11-01T00:00:00Z", "aa"), all));
  EXPECT_EQ(log->traits("kinect", "drift", "")->front().trait.detail, "ramp, in doubt");
  EXPECT_EQ(log->traits("twin", "drift", "")->front().trait.detail, "ramp, at 1.79 m");
  EXPECT_EQ(log->traits("kinect", "masks", "")->front().trait.detail, "");
}

TEST_F(Log, SaysWhatThereIsInsteadOfANameThatItDoesNotHave) {
  auto log = RunLog::open(file_);
  ASSERT_TRUE(log);
  ASSERT_TRUE(log->add(run("2026-11-01T00:00:00Z", "aa"), drifts(1.0, 2.0)));
  const auto all = log->traits("", "", "");
  ASSERT_TRUE(all);
  EXPECT_EQ(whyNone(*all, {"kinnect", "drift", ""}), "no camera begins with \"kinnect\"; there are: kinect, twin");
  EXPECT_EQ(whyNone(*all, {"", "warm", ""}), "no characteristic begins with \"warm\"; there are: drift, masks");
  EXPECT_EQ(whyNone(*all, {"twin", "warm", ""}),
            "no characteristic of camera \"twin\" begins with \"warm\"; there are: drift, masks");
  EXPECT_EQ(whyNone(*all, {"", "", "slope"}), "no number begins with \"slope\"; there are: drift, kappa");
  EXPECT_EQ(whyNone(*all, {"kinect", "drift", "slope"}),
            "no number of characteristic \"drift\" of camera \"kinect\" begins with \"slope\"; there are: drift");
  EXPECT_EQ(whyNone({}, {"kinect", "", ""}), "none of its runs tells any number");
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

TEST_F(Log, RefusesADatabaseOfSomethingElse) {
  sql("CREATE TABLE bird (name TEXT); PRAGMA user_version = 1");
  EXPECT_THAT(refusal(), HasSubstr("is a database of something else"));
  sql("PRAGMA user_version = 0");
  EXPECT_THAT(refusal(), HasSubstr("is a database of something else"));
  sql("PRAGMA user_version = -1");
  EXPECT_THAT(refusal(), HasSubstr("is a database of something else"));
}

TEST_F(Log, RefusesAVersionThatItDoesNotKnow) {
  ASSERT_TRUE(RunLog::open(file_));
  EXPECT_EQ(refusal(), "it was opened");
  sql("PRAGMA user_version = 4");
  EXPECT_THAT(refusal(), HasSubstr("is of version 4, which a newer toftwin made"));
  for (const char* version : {"-1", "-2147483648", "0"}) {
    sql(fmt::format("PRAGMA user_version = {}", version));
    EXPECT_THAT(refusal(), HasSubstr(fmt::format("is of version {}, which no toftwin makes", version)));
  }
}

TEST_F(Log, KeepsTheCamerasAndWhatTheyWereSetTo) {
  auto log = RunLog::open(file_);
  ASSERT_TRUE(log);
  LoggedRun one = run("2026-11-01T00:00:00Z", "aa");
  one.settings = {
      {"", "exposure_us", "100, 1000"}, {"A", "frequency_mhz", "16, 80, 120"}, {"B", "seed", "7"}};
  ASSERT_TRUE(log->add(one, drifts(1.0, 2.0)));
  ASSERT_TRUE(log->add(run("2026-11-02T00:00:00Z", "bb"), drifts(1.0, 2.0)));
  const auto cameras = log->cameras();
  ASSERT_TRUE(cameras);
  ASSERT_EQ(cameras->size(), 2u) << "each once, of two runs";
  EXPECT_EQ(cameras->front().source, "kinect");
  EXPECT_EQ(cameras->front().model, "Kinect v2");
  EXPECT_EQ(cameras->front().serial, "1");
  EXPECT_EQ(cameras->back().serial, "");
  EXPECT_EQ(log->settings(log->runs()->front().id).value(), one.settings);
  // Judged again, the old settings go with the old entry.
  one.settings.pop_back();
  ASSERT_TRUE(log->add(one, drifts(1.0, 2.0)));
  EXPECT_EQ(log->settings(log->runs()->front().id).value(), one.settings);
}

/// Made by the statements of toftwin before there was a version 2.
TEST_F(Log, BringsALogOfVersion1ToThisOne) {
  sql("CREATE TABLE run (id INTEGER PRIMARY KEY, judged TEXT NOT NULL, began TEXT NOT NULL, folder TEXT NOT "
      "NULL, plan TEXT "
      "NOT NULL, camera_a TEXT NOT NULL, camera_b TEXT NOT NULL, software TEXT NOT NULL, note TEXT NOT NULL, "
      "index_sha256 "
      "TEXT NOT NULL, locked INTEGER NOT NULL, UNIQUE (index_sha256, locked));"
      "CREATE TABLE characteristic (run INTEGER NOT NULL REFERENCES run (id) ON DELETE CASCADE, of TEXT NOT "
      "NULL, what TEXT "
      "NOT NULL, detail TEXT NOT NULL, name TEXT NOT NULL, unit TEXT NOT NULL, value REAL, low REAL, high "
      "REAL, n INTEGER "
      "NOT NULL, PRIMARY KEY (run, of, what, name));"
      "CREATE TABLE untold (run INTEGER NOT NULL REFERENCES run (id) ON DELETE CASCADE, why TEXT NOT NULL);"
      "INSERT INTO run VALUES (4, 'j', 'b', 'f', 'standard', 'kinect, Kinect v2 0815', 'twin, Kinect v2 ', "
      "'s', 'n', 'aa', 0);"
      "INSERT INTO characteristic VALUES (4, 'A', 'drift', 'ramp', 'drift', 'mm', 1.5, 1, 2, 9);"
      "PRAGMA application_id = 0x746F6674; PRAGMA user_version = 1");
  auto log = RunLog::open(file_);
  ASSERT_TRUE(log) << log.error().message;
  ASSERT_EQ(log->runs()->size(), 1u);
  EXPECT_EQ(log->traits("kinect", "", "")->front().trait.trait.value, 1.5);
  EXPECT_TRUE(log->settings(4)->empty());
  ASSERT_EQ(log->cameras()->size(), 2u);
  EXPECT_EQ(log->cameras()->front().serial, "0815");
  EXPECT_EQ(log->runs()->front().same_frames, -1) << "not known";
  EXPECT_FALSE(log->runs()->front().isOfOneCamera());
  EXPECT_TRUE(log->add(run("2026-11-02T00:00:00Z", "bb"), drifts(1.0, 2.0)));
  EXPECT_TRUE(RunLog::open(file_)) << "once, not each time";
}

TEST_F(Log, AddsAllOfARunOrNothing) {
  auto log = RunLog::open(file_);
  ASSERT_TRUE(log);
  sql("CREATE TRIGGER no BEFORE INSERT ON untold BEGIN SELECT RAISE(FAIL, 'the disk is full'); END");
  const auto refused = log->add(run("2026-11-01T00:00:00Z", "aa"), drifts(1.0, 2.0));
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("the disk is full"));
  EXPECT_TRUE(log->runs()->empty());
  EXPECT_TRUE(log->checkWritable());
}

/// Runs 1 and 3 are of one camera, run 2, in between, of another.
TEST_F(Log, HoldsEachCameraAgainstItsOwnFirstRun) {
  auto log = RunLog::open(file_);
  ASSERT_TRUE(log);
  ASSERT_TRUE(log->add(run("2026-11-01T00:00:00Z", "aa"), drifts(1.0, 2.0)));
  LoggedRun other = run("2026-11-02T00:00:00Z", "bb");
  other.camera_a = "kinect, Kinect v2 2";
  ASSERT_TRUE(log->add(other, drifts(30.0, 2.0)));
  RunTraits last = drifts(7.0, 2.0);
  last.traits[0].detail = "one exponential";
  ASSERT_TRUE(log->add(run("2026-11-03T00:00:00Z", "cc"), last));
  const auto trends = trendsOf(*log->traits("kinect", "drift", "drift"));
  ASSERT_EQ(trends.size(), 2u);
  EXPECT_EQ(trends[0].title, "drift: drift [mm], A kinect, Kinect v2 1, plan \"standard\"");
  ASSERT_EQ(trends[0].rows.size(), 2u);
  EXPECT_TRUE(trends[0].rows[0].is_first);
  EXPECT_FALSE(trends[0].rows[0].isChanged());
  EXPECT_EQ(trends[0].rows[1].change, 6.0);
  EXPECT_TRUE(trends[0].rows[1].isChanged());
  ASSERT_EQ(trends[1].rows.size(), 1u);
  // B alone is the same camera in all three; another plan or locked captures are a series of their own.
  EXPECT_EQ(trendsOf(*log->traits("twin", "drift", "")).size(), 1u);
  LoggedRun locked = run("2026-11-04T00:00:00Z", "cc"), planned = run("2026-11-04T00:00:00Z", "dd");
  locked.is_locked = true, planned.plan = "short";
  ASSERT_TRUE(log->add(locked, drifts(7.0, 2.0)) && log->add(planned, drifts(7.0, 2.0)));
  EXPECT_EQ(trendsOf(*log->traits("twin", "drift", "")).size(), 3u);
}

/// A run that is not through has no change, whatever its numbers are; nor is it what others are held against.
TEST_F(Log, CallsNoNumberOfAnUnfinishedRunChanged) {
  auto log = RunLog::open(file_);
  ASSERT_TRUE(log);
  const auto taken = [](LoggedRun run, const char* captures) {
    run.settings = {{"", "captures", captures}, {"", "captures_planned", "96"}};
    return run;
  };
  ASSERT_TRUE(log->add(taken(run("2026-11-01T00:00:00Z", "aa"), "12"), drifts(50.0, 2.0)));
  ASSERT_TRUE(log->add(taken(run("2026-11-02T00:00:00Z", "bb"), "96"), drifts(1.0, 2.0)));
  ASSERT_TRUE(log->add(taken(run("2026-11-03T00:00:00Z", "cc"), "96"), drifts(7.0, 2.0)));
  ASSERT_TRUE(log->add(taken(run("2026-11-04T00:00:00Z", "dd"), "40"), drifts(7.0, 2.0)));
  const auto trends = trendsOf(*log->traits("kinect", "drift", ""), *log->runs());
  ASSERT_EQ(trends.size(), 1u);
  const auto& rows = trends.front().rows;
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_TRUE(rows[0].at.run.isUnfinished() && rows[3].at.run.isUnfinished());
  EXPECT_EQ(rows[3].at.run.captures, 40);
  EXPECT_TRUE(rows[1].is_first);
  EXPECT_EQ(rows[0].change, 49.0);
  EXPECT_FALSE(rows[0].isChanged());
  EXPECT_TRUE(rows[2].isChanged());
  EXPECT_EQ(rows[3].change, 6.0);
  EXPECT_FALSE(rows[3].isChanged());
  // One change is judged, not three: its interval is 95 %'s own.
  EXPECT_NEAR(rows[2].low, 6.0 - std::sqrt(2.0), 1e-12);
}

/// One camera given twice agrees with itself: that is no change of either, nor what others are held against.
TEST_F(Log, CallsNoNumberOfOneCameraGivenTwiceChanged) {
  auto log = RunLog::open(file_);
  ASSERT_TRUE(log);
  const auto of = [](const char* began, const char* hash, std::int64_t same) {
    LoggedRun one = run(began, hash);
    one.frames_of_b = 20, one.same_frames = same;
    return one;
  };
  ASSERT_TRUE(log->add(of("2026-11-01T00:00:00Z", "aa", 20), drifts(50.0, 2.0)));
  const auto alone = trendsOf(*log->traits("kinect", "drift", ""), *log->runs());
  EXPECT_TRUE(alone.front().rows[0].is_first);
  ASSERT_TRUE(log->add(of("2026-11-02T00:00:00Z", "bb", 0), drifts(1.0, 2.0)));
  ASSERT_TRUE(log->add(of("2026-11-03T00:00:00Z", "cc", 0), drifts(7.0, 2.0)));
  ASSERT_TRUE(log->add(of("2026-11-04T00:00:00Z", "dd", 1), drifts(7.0, 2.0)));
  const auto runs = log->runs();
  ASSERT_EQ(runs->size(), 4u);
  EXPECT_EQ((*runs)[0].frames_of_b, 20);
  EXPECT_EQ((*runs)[3].same_frames, 1);
  const auto trends = trendsOf(*log->traits("kinect", "drift", ""), *runs);
  const auto& rows = trends.front().rows;
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_TRUE(rows[1].is_first);
  EXPECT_EQ(rows[0].change, 49.0);
  EXPECT_FALSE(rows[0].isChanged());
  EXPECT_TRUE(rows[2].isChanged());
  EXPECT_NEAR(rows[2].low, 6.0 - std::sqrt(2.0), 1e-12) << "one change is judged, not three";
  EXPECT_FALSE(rows[3].isChanged());
  // Without a run of two cameras, nothing is held against what there is.
  const auto of_two = trendsOf({LoggedTrait{(*runs)[0], rows[0].at.trait}, LoggedTrait{(*runs)[3], rows[3].at.trait}});
  EXPECT_TRUE(of_two.front().rows[1].is_first_of_one_camera);
  EXPECT_FALSE(of_two.front().rows[1].isChanged());
}

/// Made by the statements of toftwin before there was a version 3.
TEST_F(Log, BringsALogOfVersion2ToThisOne) {
  {
    auto log = RunLog::open(file_);
    ASSERT_TRUE(log && log->add(run("2026-11-01T00:00:00Z", "aa"), drifts(1.0, 2.0)));
  }
  sql("ALTER TABLE run DROP COLUMN frames_b; ALTER TABLE run DROP COLUMN same_frames; PRAGMA user_version = 2");
  auto log = RunLog::open(file_);
  ASSERT_TRUE(log) << log.error().message;
  EXPECT_EQ(log->runs()->front().same_frames, -1) << "not known";
  LoggedRun one = run("2026-11-02T00:00:00Z", "bb");
  one.frames_of_b = 3, one.same_frames = 3;
  ASSERT_TRUE(log->add(one, drifts(1.0, 2.0)));
  EXPECT_TRUE(RunLog::open(file_)->runs()->back().isOfOneCamera());
}

/// Else the row before would look like the newest run's.
TEST_F(Log, SaysThatTheNewestRunDoesNotTellANumber) {
  auto log = RunLog::open(file_);
  ASSERT_TRUE(log);
  ASSERT_TRUE(log->add(run("2026-11-01T00:00:00Z", "aa"), drifts(1.0, 2.0)));
  LoggedRun newest = run("2026-11-02T00:00:00Z", "bb"), other = run("2026-11-03T00:00:00Z", "cc");
  newest.settings = {{"", "captures", "3"}, {"", "captures_planned", "96"}};
  other.camera_a = "kinect, Kinect v2 2";
  RunTraits none;
  none.untold = {"drift: too few captures"};
  ASSERT_TRUE(log->add(newest, none) && log->add(other, none));
  const auto trends = trendsOf(*log->traits("kinect", "drift", ""), *log->runs());
  ASSERT_EQ(trends.size(), 1u);
  ASSERT_EQ(trends.front().rows.size(), 2u) << "the other camera's run is none of this one's";
  EXPECT_FALSE(trends.front().rows[1].is_told);
  EXPECT_FALSE(trends.front().rows[1].isChanged());
  EXPECT_TRUE(trends.front().rows[1].at.run.isUnfinished());
}

/// What was judged half-way is the same run.
TEST_F(Log, HasARunThatWentOnOnce) {
  auto log = RunLog::open(file_);
  ASSERT_TRUE(log);
  ASSERT_TRUE(log->add(run("2026-11-01T00:00:00Z", "aa"), drifts(1.0, 2.0)));
  ASSERT_TRUE(log->add(run("2026-11-01T00:00:00Z", "bb"), drifts(3.0, 4.0)));
  LoggedRun elsewhere = run("2026-11-01T00:00:00Z", "cc");
  elsewhere.folder = "/runs/2";
  ASSERT_TRUE(log->add(elsewhere, drifts(5.0, 6.0)));
  ASSERT_EQ(log->runs()->size(), 2u);
  EXPECT_EQ(log->runs()->front().index_sha256, "bb");
}

/// Intervals with a long and a short side: what counts are the sides that face each other.
TEST(Trend, UsesTheSidesThatFaceEachOther) {
  const auto of = [](std::string began, double value, double low, double high) {
    LoggedTrait one{.run = {.began = std::move(began)}, .trait = {}};
    one.trait = {"drift", "", "A", {"time constant", "s", value, low, high, 9}};
    return one;
  };
  const LoggedTrait first = of("1", 10.0, 9.0, 18.0);
  const auto one = [&](const LoggedTrait& now) { return trendsOf({first, now}).front().rows[1]; };
  // Below: 10 − 9 and 7.5 − 7 face each other.
  EXPECT_TRUE(one(of("2", 7.0, 1.0, 7.5)).isChanged());
  EXPECT_DOUBLE_EQ(one(of("2", 7.0, 1.0, 7.5)).high, -3.0 + std::hypot(0.5, 1.0));
  // Above: 18 − 10 faces 16 − 15.5; half widths (4.5 and 0.5) would call it changed.
  EXPECT_FALSE(one(of("2", 16.0, 15.5, 16.5)).isChanged());
  EXPECT_DOUBLE_EQ(one(of("2", 16.0, 15.5, 16.5)).low, 6.0 - std::hypot(0.5, 8.0));
  EXPECT_FALSE(one(of("2", 16.0, std::nan(""), std::nan(""))).isChanged());
}

/// A wave that may be another: it is no change, whichever of the two is in doubt, and a run in which it is not is what
/// others are held against.
TEST(Trend, CallsNoNumberInDoubtChanged) {
  const auto of = [](std::string began, double value, std::string detail) {
    LoggedTrait one{.run = {.began = std::move(began)}, .trait = {}};
    one.trait = {"harmonics", std::move(detail), "A", {"3 waves", "mm", value, value - 1.0, value + 1.0, 9}};
    return one;
  };
  const std::vector<LoggedTrait> four{of("1", 9.0, "at 1.5 m, in doubt"), of("2", 1.0, ""), of("3", 9.0, "in doubt"),
                                      of("4", 9.0, "")};
  const auto rows = trendsOf(four).front().rows;
  EXPECT_TRUE(rows[1].is_first);
  EXPECT_TRUE(rows[0].is_in_doubt && rows[2].is_in_doubt && !rows[3].is_in_doubt);
  EXPECT_FALSE(rows[0].isChanged());
  EXPECT_EQ(rows[2].change, 8.0);
  EXPECT_FALSE(rows[2].isChanged());
  EXPECT_TRUE(rows[3].isChanged());
  EXPECT_NEAR(rows[3].low, 8.0 - std::sqrt(2.0), 1e-4);  // one change is judged
  EXPECT_FALSE(trendsOf({of("1", 1.0, "in doubt"), of("2", 9.0, "in doubt")}).front().rows[1].isChanged());
}

/// What a number is of is held against the first's without what doubts either.
TEST(Trend, TellsWhatANumberIsOfFromItsDoubt) {
  using compare::withoutDoubt;
  EXPECT_EQ(withoutDoubt("in doubt"), "");
  EXPECT_EQ(withoutDoubt("ramp, in doubt"), "ramp");
  EXPECT_EQ(withoutDoubt("ramp, at 1.5 m, not seen by itself, in doubt"), "ramp, at 1.5 m");
  EXPECT_EQ(withoutDoubt("not seen by itself"), "");
  EXPECT_EQ(withoutDoubt("ramp"), "ramp");
}

/// Read noise goes as 1/signal: in a run without its brightest captures it is another number.
TEST(Trend, CallsNoPartOfANoiseLawChangedThatIsOfAnotherSignal) {
  const auto of = [](std::string began, double value, std::string detail) {
    LoggedTrait one{.run = {.began = std::move(began)}, .trait = {}};
    one.trait = {"noise law", std::move(detail), "A", {"read", "mm", value, value - 0.01, value + 0.01, 9}};
    return one;
  };
  const std::string near = "at the signal of near-field: 0.5 m";
  const auto rows = trendsOf({of("1", 0.12, near), of("2", 0.18, "at the signal of distance: 0.6 m"),
                              of("3", 0.18, near + ", in doubt"), of("4", 0.18, near), of("5", 0.18, "")})
                        .front()
                        .rows;
  EXPECT_TRUE(rows[1].is_of_another_signal);
  EXPECT_FALSE(rows[1].isChanged());
  EXPECT_FALSE(rows[2].is_of_another_signal);
  EXPECT_TRUE(rows[3].isChanged());
  EXPECT_TRUE(rows[4].isChanged()) << "an older log does not say where its signal was that";
}

/// Means of 24 intervals of 50 ms, added up in another order.
TEST(Trend, TakesWhatRoundingLeavesForNothing) {
  const auto of = [](std::string began, double value) {
    LoggedTrait one{.run = {.began = std::move(began)}, .trait = {}};
    one.trait = {"frame timing", "", "A", {"interval", "ms", value, value - 1e-6, value + 1e-6, 24}};
    return one;
  };
  EXPECT_EQ(trendsOf({of("1", 50.0), of("2", 50.0 - 2.3e-13)}).front().rows[1].change, 0.0);
  EXPECT_NE(trendsOf({of("1", 50.0), of("2", 50.0 - 1e-9)}).front().rows[1].change, 0.0);
}

/// The normal quantile of 0.95^(1/2), two-sided, is 2.2365; of 0.95, 1.9600 (tables of Šidák's method).
TEST(Trend, WidensByHowManyChangesThereAre) {
  std::vector<LoggedTrait> runs;
  for (const auto& [began, value] : {std::pair{"1", 0.0}, {"2", 1.5}, {"3", 0.0}}) {
    LoggedTrait& one = runs.emplace_back();
    one.run.began = began;
    one.trait = {"drift", "", "A", {"drift", "mm", value, value - 1.0, value + 1.0, 9}};
  }
  EXPECT_FALSE(trendsOf(runs).front().rows[1].isChanged());
  EXPECT_NEAR(trendsOf(runs).front().rows[1].low, 1.5 - 2.2365 / 1.9600 * std::sqrt(2.0), 1e-4);
  runs.pop_back();
  EXPECT_TRUE(trendsOf(runs).front().rows[1].isChanged());
  EXPECT_TRUE(trendsOf({}).empty());
}

}  // namespace
}  // namespace toftwin::plan
