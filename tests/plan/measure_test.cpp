// SPDX-License-Identifier: Apache-2.0
// The real program carries plans out against the real daemon, is killed, and goes on.
#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <spawn.h>
#include <sqlite3.h>
#include <sys/wait.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <map>
#include <random>
#include <set>
#include <sstream>
#include <thread>

#include "calib/plan/run_index.h"
#include "calib/plan/run_log.h"
#include "protocol/record/recording.h"
#include "tests/plan/tiny_camera.h"
#include "tests/tools/with_daemon.h"

extern char** environ;

namespace toftwin::cli {
namespace {

using plan::CaptureRecord;
using testing::HasSubstr;
using testing::Not;

/// Beside what the tiny camera has.
constexpr const char* kWarmUp = R"([[effect]]
type = "warm_up"
)";

constexpr const char* kScene =
    "[[material]]\nname = 'wall'\nalbedo = {}\n[[object]]\nshape = 'rectangle'\nsize_m = [12, 12, 0]\n"
    "position_m = [0, 0, 2]\nmaterial = 'wall'\n";

constexpr const char* kPlan = R"(name = "small"
frames = 2
exposure_us = 1000.0
[[block]]
name = "warm-up"
kind = "warm_up"
distance_m = [1.5]
repeats = 4
interval_s = 120.0
[[block]]
name = "distance"
kind = "distance"
distance_m = [0.6, 1.0, 1.4, 1.8, 2.2]
repeats = 2
locked = 1
[[block]]
name = "exposure"
kind = "exposure"
distance_m = [1.0]
exposure_us = [250.0, 500.0, 750.0, 1000.0]
[[block]]
name = "dark wall"
kind = "locked"
distance_m = [1.2]
ambient_klx = [0.0, 20.0]
[[block]]
name = "end"
kind = "repeats"
captures = 2
)";
constexpr std::size_t kCaptures = 4 + 10 + 4 + 2 + 2, kLocked = 2 + 2;

class Measure : public WithDaemon {
 protected:
  std::string moreSources() const override {
    std::string all;
    for (const auto& [name, seed, offset_mm] : {std::tuple{"cam", 1, 10.0}, {"twin", 2, 0.0}}) {
      write(fmt::format("{}.toml", name), fmt::format(kTinyCamera, name, offset_mm) + kWarmUp);
      for (const char* block : {"", ".dark-wall"}) {
        all += fmt::format(
            "[[source]]\nname = '{0}{1}'\ndriver = 'sim'\ncamera = '{0}.toml'\nscene = 'wall{1}.toml'\n"
            "max_surfaces = 1\npixel_extent = 0.0\nseed = {2}\n",
            name, block, seed);
      }
    }
    write("wall.toml", fmt::format(kScene, 0.6));
    write("wall.dark-wall.toml", fmt::format(kScene, 0.1));
    write("plan.toml", kPlan);
    return all;
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream{folder_ / name} << text;
  }
  Ran measure(const std::string& output, const std::string& more = "") const {
    return run(fmt::format("measure {} cam twin -o {} {}", path("plan.toml"), path(output), more));
  }
  std::map<std::size_t, CaptureRecord> index(const std::string& output) const {
    auto records = plan::readIndex(folder_ / output / plan::kIndexFile);
    EXPECT_TRUE(records) << records.error().message;
    return records ? *std::move(records) : std::map<std::size_t, CaptureRecord>{};
  }
  std::vector<Frame> framesOf(const std::string& output, const std::string& file) const {
    std::vector<Frame> frames;
    auto reader = record::Reader::open(folder_ / output / file);
    EXPECT_TRUE(reader) << reader.error().message;
    for (auto frame = reader->next(); frame; frame = reader->next()) frames.push_back(*std::move(frame));
    return frames;
  }
};

TEST_F(Measure, TakesEveryCaptureAtItsPoseAndSettings) {
  const Ran ran = measure("run");
  ASSERT_EQ(ran.status, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr(fmt::format("small: {} captures, {} of them locked", kCaptures, kLocked)));
  const auto records = index("run");
  ASSERT_EQ(records.size(), kCaptures);
  for (const auto& [number, one] : records) {
    EXPECT_EQ(one.a.file.starts_with("locked/"), one.is_locked);
    for (const auto* file : {&one.a, &one.b}) {
      EXPECT_EQ(*plan::sha256Of(folder_ / "run" / file->file), file->sha256);
      const auto frames = framesOf("run", file->file);
      ASSERT_EQ(frames.size(), 2u);
      for (const Frame& frame : frames) {
        EXPECT_NEAR(frame.moment.world_from_camera->translation_m.z, 2.0 - one.distance_m, 1e-12) << one.name;
        EXPECT_NEAR(frame.moment.exposures[0].duration.in(microsecond), one.exposure_us, 1e-6) << one.name;
        EXPECT_NEAR(frame.moment.ambient->in(kilolux), one.ambient_klx, 1e-9) << one.name;
      }
    }
  }
}

/// A's clock goes by the plan, and B's by A's: an hour's drift takes no hour, and both have it.
TEST_F(Measure, SetsTheTwinToTheCamerasMoment) {
  ASSERT_EQ(measure("run", "--powered-on-for 50").status, 0);
  double before = -1.0;
  for (const auto& [number, one] : index("run")) {
    EXPECT_NEAR(one.a.since_power_on_s, 50.0 + one.start_s, 1e-3) << one.name;
    EXPECT_NEAR(one.b.since_power_on_s, one.a.since_power_on_s, 1e-3) << one.name;
    EXPECT_GT(one.a.since_power_on_s, before);
    before = one.a.since_power_on_s;
  }
}

TEST_F(Measure, TakesASourceOfItsOwnForABlockThatHasOne) {
  ASSERT_EQ(measure("run").status, 0);
  for (const auto& [number, one] : index("run")) {
    EXPECT_EQ(one.a.source, one.block == "dark wall" ? "cam.dark-wall" : "cam");
    EXPECT_EQ(one.b.source, one.block == "dark wall" ? "twin.dark-wall" : "twin");
  }
}

TEST_F(Measure, PutsTheCamerasBack) {
  const std::string before = run("info twin").out;
  ASSERT_EQ(measure("run").status, 0);
  EXPECT_EQ(run("info twin").out, before);
}

/// Killed at random moments, nothing that was finished is lost or taken again, and the order stays.
TEST_F(Measure, LosesNothingAndRepeatsNothingWhenItIsKilled) {
  const auto began = std::chrono::steady_clock::now();
  ASSERT_EQ(measure("whole").status, 0);
  const auto took =
      std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - began);
  const auto seed = std::random_device{}();
  fmt::print("seed {}\n", seed);
  std::mt19937 random{seed};
  std::vector<std::string> words{TOFTWIN_PROGRAM,
                                 "measure",
                                 (folder_ / "plan.toml").string(),
                                 "cam",
                                 "twin",
                                 "-o",
                                 (folder_ / "killed").string(),
                                 "--address",
                                 "unix:" + socket()};
  std::map<std::size_t, CaptureRecord> finished;
  int kills = 0;
  for (; kills < 60; ++kills) {
    std::optional<Background> program{std::in_place, words};
    std::uniform_int_distribution<std::int64_t> after{0, took.count() * (1 + kills / 5) / 4};
    std::this_thread::sleep_for(std::chrono::microseconds{after(random)});
    if (program->end(SIGKILL) == 0) break;
    if (!std::filesystem::exists(folder_ / "killed" / plan::kIndexFile)) continue;
    auto now = index("killed");
    for (const auto& [number, one] : finished) {
      ASSERT_TRUE(now.contains(number)) << "capture " << number << " was lost";
      EXPECT_EQ(now.at(number).a.sha256, one.a.sha256) << "capture " << number << " was taken again";
      EXPECT_EQ(now.at(number).began_ns, one.began_ns);
    }
    finished = std::move(now);
  }
  EXPECT_GT(kills, 2);
  const Ran last = measure("killed");
  ASSERT_EQ(last.status, 0) << last.err;
  const auto whole = index("whole"), killed = index("killed");
  ASSERT_EQ(killed.size(), whole.size());
  for (const auto& [number, one] : whole) EXPECT_EQ(killed.at(number).name, one.name);
  for (const auto& [number, one] : finished) EXPECT_EQ(killed.at(number).a.sha256, one.a.sha256);
  for (const char* name : {"captures", "locked"}) {
    for (const auto& entry : std::filesystem::directory_iterator{folder_ / "killed" / name}) {
      EXPECT_EQ(entry.path().extension(), ".mcap") << "left over";
    }
  }
}

TEST_F(Measure, CapturesAgainWhatIsDamagedOrMissing) {
  ASSERT_EQ(measure("run").status, 0);
  const auto before = index("run");
  write("run/" + before.at(3).b.file, "damaged");
  std::filesystem::remove(folder_ / "run" / before.at(7).a.file);
  const Ran again = measure("run");
  ASSERT_EQ(again.status, 0) << again.err;
  EXPECT_THAT(again.out,
              HasSubstr(fmt::format("{} captures, {} of them there already", kCaptures, kCaptures - 2)));
  const auto after = index("run");
  for (const auto& [number, one] : before) {
    EXPECT_EQ(after.at(number).began_ns == one.began_ns, number != 3 && number != 7);
  }
}

TEST_F(Measure, RefusesToGoOnWithAnotherPlanAndSaysWhatDiffers) {
  ASSERT_EQ(measure("run").status, 0);
  const Ran other = run(fmt::format("measure {} twin cam -o {}", path("plan.toml"), path("run")));
  EXPECT_EQ(other.status, 4);
  EXPECT_THAT(other.err, HasSubstr("a: cam, Tiny cam"));
  EXPECT_THAT(other.err, Not(HasSubstr("--overwrite")));
  write("plan.toml", std::string{kPlan} + "# another seed would be another plan, and so is a comment\n");
  EXPECT_THAT(measure("run").err, HasSubstr("plan.toml says something else than it did"));
}

TEST_F(Measure, CapturesNothingByARefusedPlan) {
  std::string refused = kPlan;
  refused.replace(refused.find("locked = 1\n"), 11, "order = 'as_written'\nrepeats = 1\n");
  refused.erase(refused.find("repeats = 2\norder"), 12);
  write("plan.toml", refused);
  const Ran ran = measure("run");
  EXPECT_EQ(ran.status, 4);
  EXPECT_THAT(ran.err, HasSubstr("nothing was captured"));
  EXPECT_THAT(ran.err, HasSubstr("distance goes with time"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run"));
}

TEST_F(Measure, NeedsAPersonWhereSomethingMustBePrepared) {
  std::string asks = kPlan;
  asks.replace(asks.find("kind = \"warm_up\""), 16, "setup = 'put up the wall'\nkind = \"warm_up\"");
  write("plan.toml", asks);
  const Ran alone = measure("run", "< /dev/null");
  EXPECT_EQ(alone.status, 4);
  EXPECT_THAT(alone.err, HasSubstr("or with --prepared"));
  const Ran prepared = measure("run", "--prepared");
  EXPECT_EQ(prepared.status, 0);
  EXPECT_THAT(prepared.err, HasSubstr("taken for done: Before \"warm-up\": put up the wall"));
}

/// Otherwise it would be missed when all has been captured.
TEST_F(Measure, ChecksThatItsPlanesAreGiven) {
  const Ran ran = measure("run", "--planes samples");
  EXPECT_EQ(ran.status, 4) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("--planes samples: neither camera gives it; "));
  EXPECT_THAT(ran.err, HasSubstr("key planes"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run"));
}

TEST_F(Measure, SaysWhatACameraCannotDo) {
  std::string plan = kPlan;
  plan.replace(plan.find("750.0"), 5, "9e5");
  write("plan.toml", plan);
  const Ran ran = measure("run");
  EXPECT_EQ(ran.status, 4) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("exposure: 1 m, 900000 us"));
  EXPECT_THAT(ran.err, HasSubstr("left out with --skip"));
  EXPECT_THAT(ran.err, HasSubstr("the same command goes on from there"));
  EXPECT_EQ(measure("other", "--skip exposure").status, 0);
}

class Judged : public Measure {
 protected:
  void SetUp() override {
    Measure::SetUp();
    ASSERT_EQ(measure("run").status, 0);
  }
  Ran compare(const std::string& more = "") const {
    return toftwin(fmt::format("compare {} -o {} {}", path("run"), path("report"), more));
  }
  std::string bytesOf(const std::string& name) const {
    std::stringstream text;
    text << std::ifstream{folder_ / name}.rdbuf();
    return text.str();
  }
};

/// B's files are A's, as of one camera that is served under two names.
TEST_F(Judged, OneCameraMeasuredTwiceIsNoComparison) {
  std::istringstream lines{bytesOf("run/index.jsonl")};
  std::string both;
  for (std::string line; std::getline(lines, line);) {
    const auto fileOf = [&](const char* key) {
      const auto from = line.find(key) + 4;
      return std::pair{from, line.find(",\"source\"", from) - from};
    };
    const auto [a, a_size] = fileOf("\"a\": {");
    const std::string of_a = line.substr(a, a_size);
    const auto [b, b_size] = fileOf("\"b\": {");
    both += line.replace(b, b_size, of_a) + "\n";
  }
  write("run/index.jsonl", both);
  const Ran ran = compare("--log " + path("lab.sqlite"));
  ASSERT_EQ(ran.status, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("A and B are not two cameras: of the "));
  EXPECT_THAT(ran.out, HasSubstr("of B, each is one of A, bit for bit."));
  EXPECT_THAT(ran.out, HasSubstr("\nNote: A and B, both cam, are simulated with one seed, 1"));
  EXPECT_THAT(bytesOf("report/index.html"), HasSubstr("<p class='verdict neutral'>A and B are not two cameras"));
  EXPECT_THAT(toftwin("log " + path("lab.sqlite")).out, HasSubstr("(A and B are not two cameras: 36 of 36 frames of B are A's"));
  EXPECT_THAT(toftwin("log --csv " + path("lab.sqlite")).out, HasSubstr(",36,36\n"));
}

TEST_F(Judged, FindsThePlantedOffsetAndLeavesLockedCapturesClosed) {
  const auto records = index("run");
  for (const auto& [number, one] : records) {
    if (one.is_locked) write("run/" + one.a.file, "nobody reads this");
  }
  const Ran ran = compare();
  ASSERT_EQ(ran.status, 0) << ran.err;
  // B has no offset, A 10 mm. The differences of a capture's pixels spread by 1 mm (2 frames each), and there are 18
  // captures of 432: the standard error is 0.011 mm, and this is nine of them.
  const std::string page = bytesOf("report/report.json");
  const auto at = page.find("\"mean\": ");
  ASSERT_NE(at, std::string::npos) << page.substr(0, 500);
  EXPECT_NEAR(std::stod(page.substr(at + 8)), -10.0, 0.1);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run" / plan::kOpenedFile));
}

TEST_F(Judged, OpensLockedCapturesOnce) {
  const Ran first = compare("--locked");
  ASSERT_EQ(first.status, 0) << first.err;
  EXPECT_THAT(bytesOf("report/report.md"), HasSubstr("Locked captures"));
  const Ran second = compare("--locked");
  EXPECT_EQ(second.status, 4);
  EXPECT_THAT(second.err, HasSubstr("the locked captures were opened on 20"));
}

/// What can go wrong with the log or the report's folder is known before; what cannot, after the report is written.
TEST_F(Judged, LosesNoJudgementOfLockedCapturesToALog) {
  write("none.sqlite", std::string(5000, 'x'));
  const Ran refused = compare("--locked --log " + path("none.sqlite"));
  EXPECT_NE(refused.status, 0);
  EXPECT_THAT(refused.err, HasSubstr("is no SQLite database"));
  const Ran nowhere = toftwin(fmt::format("compare {} -o {}/inside --locked", path("run"), path("none.sqlite")));
  EXPECT_THAT(nowhere.err, HasSubstr("cannot make the report's folder"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run" / plan::kOpenedFile));
  {
    ASSERT_TRUE(plan::RunLog::open(folder_ / "lab.sqlite"));
    sqlite3* raw = nullptr;
    ASSERT_EQ(sqlite3_open((folder_ / "lab.sqlite").c_str(), &raw), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(raw, "CREATE TRIGGER no BEFORE INSERT ON run BEGIN SELECT RAISE(FAIL, 'it is full'); END",
                           nullptr, nullptr, nullptr),
              SQLITE_OK);
    sqlite3_close(raw);
  }
  const Ran judged = compare("--locked --log " + path("lab.sqlite"));
  EXPECT_NE(judged.status, 0);
  EXPECT_THAT(judged.err, testing::AllOf(HasSubstr("it is full"), HasSubstr("is written, with all numbers in report.json")));
  EXPECT_THAT(bytesOf("report/report.md"), HasSubstr("Locked captures"));
}

TEST_F(Judged, SaysSoOfTheFirstCapturesFileToo) {
  const auto records = index("run");
  write("run/" + records.at(0).a.file, bytesOf("run/" + records.at(0).a.file).substr(0, 1000));
  const Ran ran = compare();
  EXPECT_EQ(ran.status, 4);
  EXPECT_THAT(ran.err, HasSubstr("0000-a.mcap: is not the file that was captured"));
}

TEST_F(Judged, SaysWhichFileIsNotTheOneThatWasCaptured) {
  const auto records = index("run");
  write("run/" + records.at(2).b.file, "something else");
  const Ran ran = compare();
  EXPECT_EQ(ran.status, 4);
  EXPECT_THAT(ran.err, HasSubstr("capture 2 (\"warm-up: 1.5 m\")"));
  EXPECT_THAT(ran.err, HasSubstr("0002-b.mcap: is not the file that was captured"));
}

TEST_F(Judged, RefusesAPlanThatIsNotTheOneThatWasCaptured) {
  write("run/plan.toml", bytesOf("run/plan.toml") + "\ntarget_m = [0.0, 0.0, 2.1]\n");
  const Ran ran = compare();
  EXPECT_EQ(ran.status, 4);
  EXPECT_THAT(ran.err, HasSubstr("plan.toml: is not the plan that was captured"));
}

TEST_F(Judged, SaysThatAFileThatIsGoneIsCapturedAnew) {
  const auto records = index("run");
  std::filesystem::remove(folder_ / "run" / records.at(2).b.file);
  const Ran ran = compare();
  EXPECT_EQ(ran.status, 4);
  EXPECT_THAT(ran.err, HasSubstr("0002-b.mcap: cannot be read; the `toftwin measure` of this run captures it anew"));
}

TEST_F(Judged, ComparesARunThatIsNotThroughAndSaysSo) {
  std::stringstream lines{bytesOf("run/index.jsonl")};
  std::string few;
  for (std::string line; few.size() < 6000 && std::getline(lines, line);) few += line + "\n";
  write("run/index.jsonl", few + "{\"number\": 9, \"blo");
  ASSERT_EQ(compare().status, 0);
  EXPECT_THAT(bytesOf("report/report.md"), HasSubstr(fmt::format("of {} captures are there", kCaptures)));
}

TEST_F(Judged, SaysWhatIsNoRun) {
  EXPECT_THAT(toftwin("compare " + path("recordings")).err,
              HasSubstr("the folder of a run of `toftwin measure`?"));
  EXPECT_THAT(compare("--poses x.toml").err, HasSubstr("mean nothing for it"));
  EXPECT_THAT(toftwin("compare a b --locked").err, HasSubstr("--locked is for the folder of a run"));
}

}  // namespace
}  // namespace toftwin::cli
