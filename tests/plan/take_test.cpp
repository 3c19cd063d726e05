// SPDX-License-Identifier: Apache-2.0
// How captures are taken: what is commanded, what a person is asked for, and what the twin is told.
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "calib/plan/take.h"
#include "plans.h"

namespace toftwin::plan {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// What happened, in order: cameras and person write into it.
using Story = std::vector<std::string>;

class FakeCamera final : public compare::Feed {
 public:
  /// Opened five minutes ago, as in a run that is long under way.
  FakeCamera(std::string name, Story& story)
      : Feed(std::chrono::system_clock::now() - std::chrono::minutes{5}), story_(story) {
    details_.entry.name = std::move(name);
  }
  [[nodiscard]] const SourceDetails& details() const override { return details_; }
  Result<Frame> next(std::chrono::milliseconds) override {
    Frame frame = makes;
    frame.source = details_.entry.name;
    if (stale_frames > 0) --stale_frames, frame.moment.exposures = {Exposure{{}, 1_us, 20_MHz}};
    if (details_.can_set_pose)
      frame.moment.world_from_camera = frames_ < made_before ? Transform<World, Camera>{} : pose_;
    frame.sequence = static_cast<std::uint64_t>(frames_);
    for (Exposure& one : frame.moment.exposures) one.start.ns += frames_ * frame_apart_ns;
    if (clock_ahead != std::chrono::seconds{}) {
      const auto received = std::chrono::system_clock::now() + clock_ahead;
      frame.moment.received.ns = std::chrono::nanoseconds{received.time_since_epoch()}.count();
    }
    ++frames_;
    return frame;
  }
  Result<> setPose(const Transform<World, Camera>& pose) override {
    story_.push_back(fmt::format("{} goes to z {:.4g}", details_.entry.name, pose.translation_m.z));
    pose_ = pose;
    return {};
  }
  Result<> setParameter(std::string_view name, double value) override {
    story_.push_back(fmt::format("{}: {} = {:.6g}", details_.entry.name, name, value));
    if (name == refuses) return Error{Error::Code::InvalidArgument, "out of bounds"};
    if (name == "exposure_us") makes.moment.exposures = {Exposure{{}, value * microsecond, 20_MHz}};
    return {};
  }
  void takes(const std::vector<std::pair<std::string, double>>& parameters) {
    for (const auto& [name, value] : parameters) details_.parameters.push_back({name, value, {}});
  }
  void makesFramesWhenAsked() { details_.can_lockstep = true; }
  void moves() {
    details_.can_set_pose = true;
    details_.world_from_camera = Transform<World, Camera>{};
  }

  Frame makes{};
  int stale_frames = 0;
  std::chrono::seconds clock_ahead{};  ///< of its daemon; 0: its frames do not say when they were received
  std::int64_t frame_apart_ns = 0, made_before = 0;  ///< so many frames were made before a pose was set
  std::string refuses{};

 private:
  Story& story_;
  SourceDetails details_;
  Transform<World, Camera> pose_;
  std::int64_t frames_ = 0;
};

class FakePerson final : public Person {
 public:
  explicit FakePerson(Story& story) : story_(story) {}
  Result<> doThis(const std::string& what) override {
    story_.push_back("person: " + what);
    return what.find(declines) != std::string::npos && !declines.empty()
               ? Result<>{Error{Error::Code::Stopped, "it was not done"}}
               : Result<>{};
  }
  std::string declines{};

 private:
  Story& story_;
};

class Take : public testing::Test {
 protected:
  void begin(const std::string& toml, std::optional<Duration> powered_on_for = {}) {
    plan_ = planOf(toml);
    schedule_ = *scheduleOf(plan_);
    TakeOptions options;
    options.timeout = std::chrono::milliseconds{100};
    options.person = &person_, options.powered_on_for = powered_on_for;
    options.now = [this] { return now_; };
    options.sleep = [this](std::chrono::duration<double> time) {
      slept_s_ += time.count();
      now_ += std::chrono::duration_cast<std::chrono::nanoseconds>(time);
    };
    taker_.emplace(plan_, options);
  }
  Result<Taken> take(std::size_t number) {
    story_.clear(), a_frames_.clear(), b_frames_.clear();
    const auto to = [](std::vector<Frame>& frames) {
      return [&frames](const Frame& frame) { return frames.push_back(frame), Result<>{}; };
    };
    return taker_->take(schedule_.captures.at(number), a_, b_, to(a_frames_), to(b_frames_));
  }
  /// A camera that says nothing and can nothing, and a twin that can everything.
  void realAndTwin() {
    b_.moves();
    b_.takes({{"exposure_us", 700.0}, {"ambient_klx", 3.0}, {"room_temperature_c", 21.0}});
    b_.takes({{"since_power_on_s", 0.0}});
  }

  Story story_;
  FakePerson person_{story_};
  FakeCamera a_{"cam", story_}, b_{"twin", story_};
  std::vector<Frame> a_frames_, b_frames_;
  std::chrono::steady_clock::time_point now_{};
  double slept_s_ = 0.0;
  Plan plan_;
  Schedule schedule_;
  std::optional<Taker> taker_;
};

const std::string kTwoBlocks =
    "frames = 2\n[[block]]\nname = 'near'\nkind = 'locked'\nsetup = 'put up the wall'\ndistance_m = [0.5]\n"
    "repeats = 2\n[[block]]\nname = 'far'\nkind = 'locked'\ndistance_m = [1.5]\n";

/// The first frame in lockstep is made at once: whether before the pose is set or after it, hangs on chance. What moves
/// in the scene is then a frame farther on, and noise is another one.
TEST_F(Take, KeepsTheSameFramesWheneverTheFirstOneIsMade) {
  for (const std::int64_t made_before : {0, 1}) {
    FakeCamera a{"cam", story_}, b{"twin", story_};
    for (FakeCamera* camera : {&a, &b}) camera->moves(), camera->makesFramesWhenAsked();
    b.made_before = made_before;
    begin(kTwoBlocks);
    std::vector<std::uint64_t> of_a, of_b;
    const auto into = [](std::vector<std::uint64_t>& all) {
      return [&all](const Frame& frame) { return all.push_back(frame.sequence), Result<>{}; };
    };
    ASSERT_TRUE(taker_->take(schedule_.captures.at(0), a, b, into(of_a), into(of_b)));
    EXPECT_EQ(of_a, (std::vector<std::uint64_t>{2, 3}));
    EXPECT_EQ(of_b, of_a) << made_before << " made before the pose was set";
  }
}

TEST_F(Take, AsksAPersonForWhatTheCameraCannotAndOnlyOnce) {
  realAndTwin();
  begin(kTwoBlocks);
  ASSERT_TRUE(take(0));
  EXPECT_THAT(story_, ElementsAre("person: Before \"near\": put up the wall",
                                  "person: Bring cam to \"0.5 m\": its lens at x 0, y 0, z 1.5 m",
                                  "twin goes to z 1.5", "twin: ambient_klx = 0"));
  const auto again = take(1);
  ASSERT_TRUE(again);
  EXPECT_THAT(story_, ElementsAre("twin goes to z 1.5"));
  EXPECT_EQ(again->pose_by, "person");
  ASSERT_TRUE(take(2));
  EXPECT_THAT(story_, ElementsAre("person: Bring cam to \"1.5 m\": its lens at x 0, y 0, z 0.5 m",
                                  "twin goes to z 0.5"));
}

TEST_F(Take, SaysInItsFramesWhereTheyWereTaken) {
  realAndTwin();
  begin(kTwoBlocks);
  ASSERT_TRUE(take(0));
  ASSERT_EQ(a_frames_.size(), 2u);
  ASSERT_EQ(b_frames_.size(), 2u);
  EXPECT_EQ(a_frames_[0].moment.world_from_camera->translation_m.z, 1.5);
}

TEST_F(Take, TellsTheTwinTheCamerasMoment) {
  realAndTwin();
  a_.makes.moment.since_power_on = 321_s;
  a_.makes.moment.ambient = 2.5_klx;
  a_.makes.moment.temperatures = {{"sensor", 40_degC}, {"room", 19_degC}};
  a_.makes.moment.exposures = {Exposure{{}, 200_us, 20_MHz}, Exposure{{}, 900_us, 20_MHz}};
  begin(kTwoBlocks);
  const auto taken = take(2);
  ASSERT_TRUE(taken);
  EXPECT_THAT(story_, testing::IsSupersetOf({"twin: since_power_on_s = 321", "twin: ambient_klx = 2.5",
                                             "twin: room_temperature_c = 19", "twin: exposure_us = 900"}));
  EXPECT_THAT(taken->notes, IsEmpty());
  EXPECT_EQ(taken->a.since_power_on, 321_s);
}

TEST_F(Take, NotesThatACameraDoesNotSayHowLongItWasOn) {
  realAndTwin();
  begin(kTwoBlocks);
  const auto taken = take(2);
  ASSERT_TRUE(taken);
  EXPECT_THAT(taken->notes, ElementsAre(HasSubstr("cam does not say how long it has been on")));
  begin(kTwoBlocks, 500_s);
  const auto told = take(2);
  ASSERT_TRUE(told);
  EXPECT_THAT(told->notes, IsEmpty());
  EXPECT_GE(told->a.since_power_on->in(second), 500.0);
  EXPECT_EQ(b_frames_[0].moment.since_power_on, told->a.since_power_on);
}

TEST_F(Take, GivesEachFrameItsOwnTimeSincePowerOnByItsExposure) {
  realAndTwin();
  a_.makes.moment.exposures = {Exposure{{.ns = 7'000'000'000}, 200_us, 20_MHz}};
  a_.frame_apart_ns = 40'000'000;
  begin(kTwoBlocks, 500_s);
  ASSERT_TRUE(take(2));
  ASSERT_EQ(a_frames_.size(), 2u);
  EXPECT_NEAR(a_frames_[1].moment.since_power_on->in(second) - a_frames_[0].moment.since_power_on->in(second), 0.04,
              1e-9);
}

const std::string kSettings =
    "frames = 2\nexposure_us = 100\n[[block]]\nname = 'b'\nkind = 'exposure'\norder = 'as_written'\n"
    "distance_m = [1]\nexposure_us = [100, 400]\nambient_klx = [5]\n";

TEST_F(Take, SetsExposureAndLightByCommandOrByAPerson) {
  realAndTwin();
  begin(kSettings);
  ASSERT_TRUE(take(0));
  EXPECT_THAT(story_, testing::IsSupersetOf({"person: Set the ambient light to 5 klx",
                                             "person: Set the exposure of cam to 100 us",
                                             "twin: ambient_klx = 5", "twin: exposure_us = 100"}));
  ASSERT_TRUE(take(1));
  EXPECT_THAT(story_, ElementsAre("twin goes to z 1", "person: Set the exposure of cam to 400 us",
                                  "twin: exposure_us = 400"));
}

TEST_F(Take, SkipsFramesThatStillHaveTheExposureFromBefore) {
  realAndTwin();
  begin(kSettings);
  b_.stale_frames = 5;
  ASSERT_TRUE(take(0));
  ASSERT_EQ(b_frames_.size(), 2u);
  for (const Frame& frame : b_frames_)
    EXPECT_NEAR(frame.moment.exposures[0].duration.in(microsecond), 100.0, 1e-9);
  b_.stale_frames = 1000;
  const auto never = take(1);
  ASSERT_FALSE(never);
  EXPECT_THAT(never.error().message,
              HasSubstr("twin was set to an exposure of 400 us, but its frames say 1 us"));
}

TEST_F(Take, SaysWhichCaptureACameraCannotDoAndWhatToDo) {
  realAndTwin();
  b_.refuses = "exposure_us";
  begin(kSettings);
  const auto refused = take(0);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message,
            "capture 0 (\"b: 1 m, 100 us\"): twin: out of bounds; a block that this camera cannot do is left "
            "out with "
            "--skip");
}

TEST_F(Take, EndsWhenAPersonDeclines) {
  realAndTwin();
  begin(kTwoBlocks);
  person_.declines = "Bring cam";
  EXPECT_EQ(take(0).error().code, Error::Code::Stopped);
  EXPECT_THAT(a_frames_, IsEmpty());
}

TEST_F(Take, WaitsForTheIntervalOfARealCamera) {
  begin(
      "frames = 2\n[[block]]\nname = 'w'\nkind = 'warm_up'\ndistance_m = [1]\nrepeats = 3\ninterval_s = 60\n");
  ASSERT_TRUE(take(0));
  EXPECT_EQ(slept_s_, 0.0);
  ASSERT_TRUE(take(1));
  EXPECT_NEAR(slept_s_, 60.0, 0.1);  // looks every 0.05 s whether it is to stop
  now_ += std::chrono::seconds{45};  // what something else takes counts
  ASSERT_TRUE(take(2));
  EXPECT_NEAR(slept_s_, 60.0 + 15.0, 0.2);
}

/// Each capture's frames say that the clock is off; it is news once, and again when it was set.
TEST_F(Take, SaysOnceThatADaemonsClockIsOff) {
  realAndTwin();
  begin(kTwoBlocks);
  a_.clock_ahead = b_.clock_ahead = std::chrono::seconds{30};
  const auto clockNotes = [](const Result<Taken>& taken) {
    return std::ranges::count_if(taken->notes, [](const std::string& note) { return note.starts_with("The clock"); });
  };
  EXPECT_EQ(clockNotes(take(0)), 2) << "of A and of B";
  EXPECT_EQ(clockNotes(take(1)), 0);
  b_.clock_ahead = std::chrono::seconds{10};
  EXPECT_EQ(clockNotes(take(0)), 1);
  EXPECT_EQ(clockNotes(take(1)), 0);
}

/// However long ago its feed was opened: a frame was made after its capture asked for it.
TEST_F(Take, KnowsThatAClockIsBehindAndWasSetInALongRun) {
  realAndTwin();
  begin(kTwoBlocks);
  b_.clock_ahead = std::chrono::seconds{-30};
  const auto notes = [&](std::size_t number) {
    const auto taken = take(number);
    return taken ? taken->notes : std::vector<std::string>{taken.error().message};
  };
  EXPECT_THAT(notes(0), testing::Contains(HasSubstr("behind ours")));
  EXPECT_THAT(notes(1), testing::Each(testing::Not(HasSubstr("The clock"))));
  b_.clock_ahead = std::chrono::seconds{-10};
  EXPECT_THAT(notes(0), testing::Contains(HasSubstr("behind ours")));
}

TEST_F(Take, PutsBackWhatItSetAndNothingElse) {
  realAndTwin();
  begin(kSettings);
  ASSERT_TRUE(take(1));
  story_.clear();
  EXPECT_THAT(taker_->putBack(b_), IsEmpty());
  EXPECT_THAT(story_, testing::UnorderedElementsAre("twin goes to z 0", "twin: exposure_us = 700",
                                                    "twin: ambient_klx = 3"));
  story_.clear();
  EXPECT_THAT(taker_->putBack(a_), IsEmpty());
  EXPECT_THAT(story_, IsEmpty());
}

}  // namespace
}  // namespace toftwin::plan
