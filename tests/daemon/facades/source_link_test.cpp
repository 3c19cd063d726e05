// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/source_link.h"

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <mutex>
#include <utility>
#include <vector>

#include "../../kept_log.h"
#include "../fakes.h"

namespace toftwin::daemon {
namespace {

using test::Remote;

FacadeKeys keysOfCam() {
  FacadeKeys keys;
  keys.source = "cam";
  return keys;
}

/// A source that somebody else sets, too, and what a facade gets of it.
class LinkedSource : public testing::Test {
 protected:
  void SetUp() override {
    hub_.add(host_);
    thread_.start();
    thread_.door()->post([this] { link_.want(true); });
    ASSERT_TRUE(remote_->asked.reaches(1));
  }
  void TearDown() override { thread_.stop(); }

  void take(const Frame& frame) {
    {
      const std::scoped_lock lock{mutex_};
      frames_.push_back(frame);
    }
    taken_.add();
  }
  /// Of the frame with that number, once it came.
  std::vector<PlaneKind> planesOf(std::size_t number) {
    if (!taken_.reaches(static_cast<int>(number) + 1)) return {};
    const std::scoped_lock lock{mutex_};
    EXPECT_EQ(frames_.at(number).sequence, number) << "none is lost";
    std::vector<PlaneKind> kinds;
    for (const Plane& plane : frames_[number].planes) kinds.push_back(plane.kind);
    return kinds;
  }
  Result<> set(double amplitude) {
    std::promise<Result<>> done;
    host_->post([amplitude](drivers::Source& source) { return source.setParameter("amplitude", amplitude); },
                [&](const Result<>& result) { done.set_value(result); });
    return done.get_future().get();
  }

  std::mutex mutex_;
  std::vector<Frame> frames_;
  test::Counter taken_;
  test::FakeClock clock_;
  std::shared_ptr<Remote> remote_ = std::make_shared<Remote>();  // shared with its source
  Hub hub_{Hub::Options{}, clock_};
  std::shared_ptr<SourceHost> host_ = std::make_shared<SourceHost>(
      "cam", test::opener(remote_), test::opener(remote_)(), SourceHost::Options{}, clock_);
  EventThread thread_{"test"};
  SourceLink link_{thread_,
                   {keysOfCam(), hub_, clock_},
                   {.planes = {PlaneKind::Amplitude, PlaneKind::Range}},
                   [this](const Frame& frame) { take(frame); }};
};

TEST_F(LinkedSource, GivesTheFirstFrameAfterAnothersChangeWithThePlaneThatItBrought) {
  const std::vector<PlaneKind> without{PlaneKind::Range}, with{PlaneKind::Amplitude, PlaneKind::Range};
  remote_->give();
  EXPECT_EQ(planesOf(0), without);
  ASSERT_TRUE(set(1).ok());
  remote_->give(2);
  EXPECT_EQ(planesOf(1), with);
  EXPECT_EQ(planesOf(2), with);
  ASSERT_TRUE(set(0).ok());
  remote_->give();
  EXPECT_EQ(planesOf(3), without);
}

/// In 1 + 21 ms the second frame is early by ten, and the first waits for as long; both by the latency more.
TEST(SourceLink, HoldsEveryFacadesFramesBackByItsKeys) {
  using std::chrono::milliseconds;
  const test::FakeClock clock;
  const auto remote = std::make_shared<Remote>();  // shared with its source
  Hub hub{Hub::Options{}, clock};
  hub.add(std::make_shared<SourceHost>("cam", test::opener(remote), test::opener(remote)(),
                                       SourceHost::Options{}, clock));
  FacadeKeys keys = keysOfCam();
  keys.latency = 30_ms;
  EventThread thread{"test"};
  std::vector<std::chrono::steady_clock::time_point> came(2);
  test::Counter taken;
  SourceLink link{thread,
                  {keys, hub, clock, Unevenness{{milliseconds{1}, milliseconds{21}}}},
                  {.planes = {PlaneKind::Range}},
                  [&](const Frame& frame) {
                    came.at(frame.sequence) = std::chrono::steady_clock::now();
                    taken.add();
                  }};
  thread.start();
  thread.door()->post([&] { link.want(true); });
  ASSERT_TRUE(remote->asked.reaches(1));
  const auto given = std::chrono::steady_clock::now();
  remote->give();
  ASSERT_TRUE(taken.reaches(1));
  const auto given_again = std::chrono::steady_clock::now();
  remote->give();
  ASSERT_TRUE(taken.reaches(2));
  EXPECT_GE(came[0] - given, milliseconds{40});
  EXPECT_GE(came[1] - given_again, milliseconds{30});
  thread.stop();
}

TEST(SourceLink, ThatThereIsNoMemoryForItsFramesIsSaidOnceAndTriedAgain) {
  const auto log = std::make_shared<toftwin::test::KeptLog>();  // shared with spdlog
  const toftwin::test::LoggingTo kept{log};
  const test::FakeClock clock;
  const auto remote = std::make_shared<Remote>();  // shared with its source
  Hub hub{{.recording_folder = {}, .recording = {}, .total_bytes = 1}, clock};
  const auto host = std::make_shared<SourceHost>("cam", test::opener(remote), test::opener(remote)(),
                                                 SourceHost::Options{}, clock);
  hub.add(host);
  EventThread thread{"test"};
  SourceLink link{thread, {keysOfCam(), hub, clock}, {.planes = {PlaneKind::Range}}, [](const Frame&) {}};
  thread.start();
  std::promise<void> was_tried;
  thread.door()->post([&] {
    link.want(true);
    link.want(false);
    link.want(true);
    was_tried.set_value();
  });
  was_tried.get_future().wait();
  EXPECT_EQ(log->count("a facade of cam gets no frames, and tries again: "), 1);
  hub.setOptions({});
  EXPECT_TRUE(remote->asked.reaches(1));
  thread.stop();
}

}  // namespace
}  // namespace toftwin::daemon
