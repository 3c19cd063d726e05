// SPDX-License-Identifier: Apache-2.0
// A comparison whose cameras are carried from pose to pose.
#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "calib/compare/capture.h"
#include "calib/compare/follow.h"

namespace toftwin::compare {
namespace {

/// What happened, in order: both cameras and the carrier write into it.
using Story = std::vector<std::string>;

class FakeFeed final : public Feed {
 public:
  FakeFeed(std::string name, Story& story) : story_(story) {
    details_.entry.name = std::move(name);
  }
  [[nodiscard]] const SourceDetails& details() const override { return details_; }
  Result<Frame> next(std::chrono::milliseconds) override {
    story_.push_back("frame of " + details_.entry.name);
    Frame frame;
    frame.sequence = sequence_++;
    frame.camera = {.width = 4,
                    .height = 2,
                    .fx = 4,
                    .fy = 4,
                    .cx = 1.5,
                    .cy = 0.5,
                    .distortion = {},
                    .calibration_id = {}};
    frame.planes = {toPlane(PlaneKind::Range, Image<float>{4, 2, 1.0F}),
                    toPlane(PlaneKind::Amplitude, Image<float>{4, 2, 1.0F})};
    return frame;
  }
  Result<> setPose(const Transform<World, Camera>&) override {
    return Error{Error::Code::Unsupported, "a real camera"};
  }
  Result<> beginAnew() override {
    return story_.push_back("anew " + details_.entry.name), Result<>{};
  }

 private:
  Story& story_;
  SourceDetails details_;
  std::uint64_t sequence_ = 0;
};

class FakeCarrier final : public Carrier {
 public:
  explicit FakeCarrier(Story& story) : story_(story) {}
  Result<Transform<World, Camera>> go(const PoseSpec& pose) override {
    story_.push_back("go " + pose.name);
    if (pose.name == stalls_at) return Error{Error::Code::Timeout, "it has stalled"};
    auto reached = pose.world_from_camera();
    reached.translation_m.x += 1e-3;  // a rig stands where it stands
    return reached;
  }
  Result<> stillThere() override {
    story_.push_back("still there");
    if (moves) return Error{Error::Code::Internal, "it moved"};
    return {};
  }
  [[nodiscard]] Json log() const override { return Json::object(); }
  [[nodiscard]] std::vector<NamedTemperature> temperatures() const override { return {{"room", 18_degC}}; }

  std::string stalls_at;
  bool moves = false;

 private:
  Story& story_;
};

struct Rig {
  Story story;
  FakeFeed a{"a", story}, b{"b", story};
  FakeCarrier carrier{story};
  Progress progress{nullptr};
  CaptureOptions options{
      .poses = {{.name = "one"}, {.name = "two"}}, .frames = 2, .carrier = &carrier};

  Result<Capture> run() {
    planCapture(progress, options);
    return capture(a, b, options, progress);
  }
};

TEST(Carried, EachPoseIsCapturedWhenItIsReachedAndLookedAtAgainAfterwards) {
  Rig rig;
  const auto captured = rig.run();
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  const Story at_a_pose{"anew a",     "anew b",     "frame of a", "frame of b",
                        "frame of a", "frame of b", "still there"};
  Story expected;
  for (const char* pose : {"go one", "go two"}) {
    expected.emplace_back(pose);
    expected.insert(expected.end(), at_a_pose.begin(), at_a_pose.end());
  }
  EXPECT_EQ(rig.story, expected);
  ASSERT_EQ(captured->poses.size(), 2u);
  EXPECT_DOUBLE_EQ(captured->poses[0].a.pose()->translation_m.x, 1e-3) << "where it really stood";
  EXPECT_THAT(captured->warnings, testing::Each(testing::HasSubstr("gives no flags"))) << "and nothing else";
}

TEST(Carried, TheRigsRoomTemperatureCountsWhereTheCameraKnowsNone) {
  Rig rig;
  const auto roomOf = [&](const Frame& frame) {
    for (const auto& [parameter, value] : settingsOf(frame, &rig.carrier)) {
      if (std::string{parameter} == kRoom) return value;
    }
    return 0.0;
  };
  Frame frame;
  EXPECT_DOUBLE_EQ(roomOf(frame), 18.0);
  frame.moment.temperatures = {{"sensor", 44_degC}, {"room", 25_degC}};
  EXPECT_DOUBLE_EQ(roomOf(frame), 25.0);
}

TEST(Carried, NothingIsCapturedAtAPoseThatWasNotReached) {
  Rig rig;
  rig.carrier.stalls_at = "two";
  const auto captured = rig.run();
  ASSERT_FALSE(captured.ok());
  EXPECT_EQ(captured.error().message, "nothing was captured at \"two\": it has stalled");
  EXPECT_EQ(rig.story.back(), "go two");
}

TEST(Carried, APoseThatDidNotHoldIsNoCapture) {
  Rig rig;
  rig.carrier.moves = true;
  const auto captured = rig.run();
  ASSERT_FALSE(captured.ok());
  EXPECT_EQ(captured.error().message, "it moved");
}

}  // namespace
}  // namespace toftwin::compare
