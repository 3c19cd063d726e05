// SPDX-License-Identifier: Apache-2.0
// What spoils a comparison without ending it, and is said.
#include <gmock/gmock.h>

#include <chrono>

#include "calib/compare/capture.h"
#include "protocol/record/recording.h"
#include "tests/record/record_testing.h"

namespace toftwin::compare {
namespace {

using testing::HasSubstr;

/// A frame that its daemon had so long ago by our clock.
Frame frameFrom(std::chrono::milliseconds ago) {
  Frame frame;
  frame.source = "kinect";
  frame.camera.width = 8, frame.camera.height = 4;
  frame.camera.fx = frame.camera.fy = 8.0, frame.camera.cx = 3.5, frame.camera.cy = 1.5;
  const auto then = std::chrono::system_clock::now() - ago;
  frame.moment.received.ns =
      std::chrono::duration_cast<std::chrono::nanoseconds>(then.time_since_epoch()).count();
  frame.planes = {toPlane(PlaneKind::Range, Image<float>(8, 4, 1.0F))};
  return frame;
}

/// So many of it, numbered.
void recordFrames(const std::filesystem::path& file, std::uint64_t count, Frame frame,
                  const record::WriterOptions& options = {}) {
  auto writer = record::Writer::create(file, options);
  ASSERT_TRUE(writer) << writer.error().message;
  for (frame.sequence = 0; frame.sequence < count; ++frame.sequence) ASSERT_TRUE(writer->write(frame));
  ASSERT_TRUE(writer->close());
}

TEST(Warnings, TellOfADaemonWhoseClockIsOff) {
  using std::chrono::milliseconds;
  const auto now = std::chrono::system_clock::now(), long_ago = now - std::chrono::minutes{5};
  EXPECT_EQ(clockWarning(frameFrom(milliseconds{100}), now), "");
  EXPECT_THAT(clockWarning(frameFrom(milliseconds{20'400}), now),
              HasSubstr("kinect comes from is 20 s or more behind ours"));
  EXPECT_EQ(clockWarning(frameFrom(milliseconds{20'400}), long_ago), "") << "it waited for the other camera's";
  EXPECT_THAT(clockWarning(frameFrom(milliseconds{-3'200}), long_ago), HasSubstr("3 s or more ahead of ours"));
  Frame recorded = frameFrom(milliseconds{20'400});
  recorded.provenance.kind = FrameKind::Replayed;
  EXPECT_EQ(clockWarning(recorded, now), "") << "its time is that of the recording";
}

/// Of one that is three seconds ahead, known to how long its frames were under way; then of one that was set right.
TEST(Warnings, KnowWhetherAClockIsStillAsItWasSaid) {
  using std::chrono::milliseconds;
  const auto opened = std::chrono::system_clock::now() - std::chrono::seconds{5};
  const auto at_once = clockOffset(frameFrom(milliseconds{-3'000}), opened),
             waited = clockOffset(frameFrom(milliseconds{-1'200}), opened),
             in_time = clockOffset(frameFrom(milliseconds{10}), opened),
             behind = clockOffset(frameFrom(milliseconds{9'000}), opened);
  ASSERT_TRUE(at_once && waited && in_time && behind);
  EXPECT_NEAR(at_once->low_s, 3.0, 0.5);
  EXPECT_NEAR(at_once->high_s, 8.0, 0.5);
  EXPECT_TRUE(at_once->mayBe(*waited)) << "1.2 to 6.2 s";
  EXPECT_TRUE(at_once->isNotable() && behind->isNotable() && !in_time->isNotable());
  EXPECT_FALSE(at_once->mayBe(*behind)) << "-9 to -4 s";
}

TEST(Warnings, TellOfARecordingThatWasCutOff) {
  const record::Folder folder;
  const auto file = folder / "a.mcap";
  recordFrames(file, 40, frameFrom(std::chrono::milliseconds{0}));
  const auto whole = openRecording(file.string());
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_EQ((*whole)->warning(), "");
  const auto bytes = record::bytesOf(file);
  record::writeBytes(file, std::span{bytes}.first(bytes.size() - 100));
  const auto cut = openRecording(file.string());
  ASSERT_TRUE(cut) << cut.error().message;
  EXPECT_THAT((*cut)->warning(), HasSubstr("The recording of kinect is damaged, or was not closed: "));
  record::writeBytes(file, std::span{bytes}.first(100));
  const auto nothing = openRecording(file.string());
  ASSERT_FALSE(nothing);
  EXPECT_THAT(nothing.error().message, HasSubstr("a.mcap: no frame of it can be read: "));
}

/// One byte in the middle of the file, behind the two frames that are asked for.
TEST(Warnings, TellOfOneFlippedByteHoweverFewFramesAreRead) {
  const record::Folder folder;
  const auto file = folder / "a.mcap";
  recordFrames(file, 40, frameFrom(std::chrono::milliseconds{0}), {.chunk_bytes = 4000, .zstd_level = 0});
  auto bytes = record::bytesOf(file);
  bytes[bytes.size() / 2] ^= std::byte{0x40};
  record::writeBytes(file, bytes);
  const auto a = openRecording(file.string()), b = openRecording(file.string());
  ASSERT_TRUE(a && b);
  Progress silent{nullptr};
  const auto captured = capture(**a, **b, {.frames = 2}, silent);
  ASSERT_TRUE(captured) << captured.error().message;
  EXPECT_THAT(captured->warnings, testing::Contains(testing::MatchesRegex(
                                      "Of the recording of kinect, 1 of [0-9]* chunks cannot be read, and no .*")));
}

/// A frame of so long ago from where the world begins.
Frame frameFromOrigin(std::chrono::milliseconds ago) {
  Frame frame = frameFrom(ago);
  frame.moment.world_from_camera = Transform<World, Camera>{};
  return frame;
}

TEST(Warnings, SayNothingOfTheClockOfWhatWasRecordedLongAgo) {
  const record::Folder folder;
  const auto file = folder / "a.mcap";
  recordFrames(file, 4, frameFromOrigin(std::chrono::hours{24}));
  const auto a = openRecording(file.string()), b = openRecording(file.string());
  ASSERT_TRUE(a && b);
  Progress silent{nullptr};
  const auto captured = capture(**a, **b, {.poses = {{.name = "here"}}, .frames = 2}, silent);
  ASSERT_TRUE(captured) << captured.error().message;
  EXPECT_THAT(captured->warnings, testing::Not(testing::Contains(HasSubstr("clock"))));
}

/// What is said of a recording of four frames, all at the origin, against itself, where these are asked for.
std::string saidWhereAskedFor(CaptureOptions options) {
  const record::Folder folder;
  const auto file = folder / "a.mcap";
  recordFrames(file, 4, frameFromOrigin(std::chrono::milliseconds{0}));
  const auto a = openRecording(file.string()), b = openRecording(file.string());
  if (!a || !b) return "not opened";
  Progress silent{nullptr};
  options.frames = 2;
  const auto captured = capture(**a, **b, options, silent);
  return captured ? "captured" : captured.error().message;
}

TEST(Warnings, TellOfARecordingOfOtherPoses) {
  EXPECT_THAT(saidWhereAskedFor({.poses = {{.name = "elsewhere", .position_m = {0.0, 0.0, 0.1}}}}),
              HasSubstr("kinect: none of its last 4 frames was taken at the pose asked for; it must have been"));
}

/// A degree about the optical axis: place and axis are the same.
TEST(Warnings, TellByHowMuchARecordingsPosesAreOthers) {
  EXPECT_THAT(saidWhereAskedFor({.poses = {{.name = "turned", .euler_deg = {0.0, 0.0, 1.0}}}, .most_skipped = 2}),
              HasSubstr("which is 0 mm and 1° from it"));
}

TEST(Warnings, TellThatARecordingEndedBeforeThePoseForItWasCutOff) {
  const record::Folder folder;
  const auto whole = folder / "a.mcap", cut = folder / "b.mcap";
  recordFrames(whole, 4, frameFromOrigin(std::chrono::milliseconds{0}));
  const auto bytes = record::bytesOf(whole);
  record::writeBytes(cut, std::span{bytes}.first(bytes.size() - 100));
  const auto a = openRecording(whole.string()), b = openRecording(cut.string());
  ASSERT_TRUE(a && b);
  Progress silent{nullptr};
  const PoseSpec here{.name = "here"}, elsewhere{.name = "elsewhere", .position_m = {0.0, 0.0, 0.1}};
  const auto captured = capture(**b, **a, {.poses = {elsewhere, here}, .frames = 2}, silent);
  ASSERT_FALSE(captured);
  EXPECT_THAT(captured.error().message, testing::AllOf(HasSubstr("what is missing of it may have been"),
                                                       HasSubstr("The recording of kinect is damaged, or was not closed: ")));
}

}  // namespace
}  // namespace toftwin::compare
