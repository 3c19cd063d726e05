// SPDX-License-Identifier: Apache-2.0
// The index of a run, and the JSON that it is written in.
#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <fstream>
#include <random>

#include "calib/compare/json_parse.h"
#include "calib/plan/run_index.h"
#include "plans.h"
#include "tests/record/record_testing.h"

namespace toftwin::plan {
namespace {

using compare::Json;
using compare::parseJson;
using testing::HasSubstr;

TEST(ParseJson, ReadsWhatItsWriterWrites) {
  Json json = Json::object();
  json.set("a", 1).set("b", -2.5e-3).set("c", true).set("d", Json{}).set("e", "\"q\" \\ \n °");
  json.set("f", Json::arrayOf(std::array{0.1, 1e300, -7.0})).set("g", Json::object().set("h", Json::array()));
  const auto read = parseJson(json.line());
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->line(), json.line());
  EXPECT_EQ(parseJson(json.text())->line(), json.line());
}

TEST(ParseJson, ReadsEscapesAndNumbers) {
  EXPECT_EQ(parseJson(R"("\u00b0\ud83d\ude00\/\t")")->words(), "°😀/\t");
  EXPECT_EQ(parseJson(" -0.5E+2 ")->number(), -50.0);
  EXPECT_EQ(parseJson("9007199254740993")->line(), "9007199254740993");
  EXPECT_EQ(parseJson("18446744073709551615")->number(), 18446744073709551616.0);
}

TEST(ParseJson, RefusesWhatIsNoJson) {
  for (const char* text :
       {"",        " ",         "{",           "[1,]",        "{\"a\":}", "{\"a\" 1}", "{a:1}",
        "01",      "1.",        ".5",          "+1",          "1e",       "nul",       "\"",
        "\"\\x\"", "\"\\u12\"", "\"\\ud800\"", "\"\\udc00\"", "1 2",      "[1 2]",     "1e999",
        "NaN",     "\"\x01\"",  "{\"a\":1,}",  "\"\\",        "-"}) {
    EXPECT_FALSE(parseJson(text)) << text;
  }
  EXPECT_FALSE(parseJson(std::string(100'000, '[')));
  EXPECT_TRUE(parseJson(std::string(60, '[') + std::string(60, ']')));
}

TEST(ParseJson, TakesAnyBytes) {
  std::mt19937 random{11};
  const std::string alphabet = "{}[]\",:\\u0129dDeE+-. \ntrufalsn\xff";
  for (int i = 0; i < 20'000; ++i) {
    std::string text(random() % 24, ' ');
    for (char& c : text) c = alphabet[random() % alphabet.size()];
    const auto json = parseJson(text);
    if (!json) continue;
    EXPECT_EQ(parseJson(json->line())->line(), json->line()) << text;
  }
}

class Index : public testing::Test {
 protected:
  std::string line(std::size_t number) const {
    PlannedCapture planned = schedule_.captures.at(number);
    Taken taken;
    taken.pose = planned.pose->world_from_camera(), taken.pose_by = "rig",
    taken.began_ns = 1'700'000'000'000'000'000;
    taken.a = {.source = "kinect", .model = "Kinect \"v2\"", .frames = 10, .since_power_on = 12.5_s};
    taken.b = {.source = "twin", .model = "twin", .frames = 10, .since_power_on = {}};
    taken.notes = {"it was cold"};
    return lineOf(plan_, planned, taken, {.file = "captures/0001-a.mcap", .sha256 = "aa"},
                  {.file = "captures/0001-b.mcap", .sha256 = "bb"}) +
           "\n";
  }
  Result<std::map<std::size_t, CaptureRecord>> read(const std::string& text) const {
    std::ofstream{folder_ / "index.jsonl", std::ios::binary} << text;
    return readIndex(folder_ / "index.jsonl");
  }
  Plan plan_ = planOf("[[block]]\nname = 'sweep'\ndistance_m = [1, 2, 3]\nlocked = 1\n");
  Schedule schedule_ = *scheduleOf(plan_);
  record::Folder folder_;
};

TEST_F(Index, ReadsWhatWasWritten) {
  const auto records = read(line(0) + line(2));
  ASSERT_TRUE(records) << records.error().message;
  ASSERT_EQ(records->size(), 2u);
  const CaptureRecord& one = records->at(2);
  const PlannedCapture& planned = schedule_.captures[2];
  EXPECT_EQ(one.block, "sweep");
  EXPECT_EQ(one.kind, "distance");
  EXPECT_EQ(one.name, planned.name);
  EXPECT_EQ(one.condition, planned.condition);
  EXPECT_EQ(one.is_locked, planned.is_locked);
  EXPECT_EQ(one.distance_m, planned.distance_m);
  EXPECT_EQ(one.pose, planned.pose->world_from_camera());
  EXPECT_EQ(one.a.since_power_on_s, 12.5);
  EXPECT_TRUE(std::isnan(one.b.since_power_on_s));
  EXPECT_EQ(one.a.file, "captures/0001-a.mcap");
  EXPECT_EQ(one.notes, std::vector<std::string>{"it was cold"});
  EXPECT_FALSE(one.again);
}

TEST_F(Index, KeepsWhereBSawItself) {
  PlannedCapture planned = schedule_.captures.at(0);
  Taken taken;
  taken.pose = planned.pose->world_from_camera(), taken.pose_by = "board";
  taken.seen_by_b.emplace();
  taken.seen_by_b->world_from_camera = schedule_.captures.at(1).pose->world_from_camera();
  const auto records = read(
      lineOf(plan_, planned, taken, {.file = "a", .sha256 = "aa"}, {.file = "b", .sha256 = "bb"}) + "\n");
  ASSERT_TRUE(records) << records.error().message;
  EXPECT_EQ(records->at(0).pose_of_b, taken.seen_by_b->world_from_camera);
  EXPECT_EQ(records->at(0).pose, taken.pose);
  EXPECT_FALSE(read(line(1))->at(1).pose_of_b);
}

TEST_F(Index, LeavesOutALineThatAKillCut) {
  const std::string whole = line(0), cut = line(1);
  for (std::size_t length = 0; length < cut.size() - 1; ++length) {
    const auto records = read(whole + cut.substr(0, length));
    ASSERT_TRUE(records) << records.error().message;
    EXPECT_EQ(records->size(), 1u) << length;
  }
}

TEST_F(Index, SaysWhichLineIsNone) {
  EXPECT_THAT(read(line(0) + "{\"number\": 1}\n" + line(2)).error().message,
              HasSubstr("index.jsonl:2: is no capture"));
  EXPECT_THAT(read("nonsense\n").error().message,
              HasSubstr("index.jsonl:1: is no capture: it is no JSON at byte"));
  EXPECT_THAT(readIndex(folder_ / "other").error().message, HasSubstr("is this the folder of a run"));
}

TEST_F(Index, TakesNoFileOutsideOfTheRun) {
  for (const char* file : {"../secret", "/etc/passwd", "a/../../b", ""}) {
    std::string text = line(0);
    const std::string own = "captures/0001-a.mcap";
    text.replace(text.find(own), own.size(), file);
    EXPECT_FALSE(read(text)) << file;
  }
}

TEST_F(Index, HashesAsTheStandardSays) {
  std::ofstream{folder_ / "abc", std::ios::binary} << "abc";  // FIPS 180-4's example
  EXPECT_EQ(*sha256Of(folder_ / "abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_FALSE(sha256Of(folder_ / "not there"));
}

}  // namespace
}  // namespace toftwin::plan
