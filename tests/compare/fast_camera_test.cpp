// SPDX-License-Identifier: Apache-2.0
// A camera that does not wait for anyone, compared with one that takes its time.
#include <filesystem>
#include <fstream>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../daemon/fakes.h"
#include "calib/compare/capture.h"
#include "daemon/daemon.h"

namespace toftwin::compare {
namespace {

using daemon::test::FakeSource;
using daemon::test::Remote;

/// What the daemon's only driver opens; a driver's row holds plain functions.
std::shared_ptr<Remote>& remote() {
  static std::shared_ptr<Remote> camera;  // shared with the source that the daemon opens
  return camera;
}

constexpr drivers::Driver kFake{
    .name = "fake",
    .summary = "a camera that the test steers",
    .list = [] { return std::vector<std::string>{}; },
    .open = [](settings::Table&) -> Result<std::unique_ptr<drivers::Source>> {
      return std::unique_ptr<drivers::Source>{std::make_unique<FakeSource>(remote())};
    },
    .document = [] { return std::string{}; }};

/// Over 1 MB, the daemon's limit here, at 4 kB and more a frame.
constexpr int kFramesMeanwhile = 300;

/// A simulator that takes so long for a frame that the camera makes 300: it comes back when the daemon
/// has them all.
class SlowFeed final : public Feed {
 public:
  SlowFeed() {
    details_.entry.name = "slow";
    details_.can_lockstep = true;
  }
  [[nodiscard]] const SourceDetails& details() const override { return details_; }
  Result<Frame> next(std::chrono::milliseconds) override {
    given_ += kFramesMeanwhile;
    remote()->give(kFramesMeanwhile);
    if (!remote()->asked.reaches(given_ + 1))  // asked for the one after the last
      return Error{Error::Code::Timeout, "the daemon did not take the frames"};
    Frame frame;
    frame.source = "slow";
    frame.camera = remote()->info.camera;
    frame.moment.world_from_camera = Transform<World, Camera>{};
    frame.planes.push_back(toPlane(PlaneKind::Range, Image<float>{4, 2, 1.0F}));
    return frame;
  }
  Result<> setPose(const Transform<World, Camera>&) override { return {}; }

 private:
  SourceDetails details_;
  int given_ = 0;
};

class FastCamera : public testing::Test {
 protected:
  void SetUp() override {
    remote() = std::make_shared<Remote>();
    remote()->info.can_lockstep = remote()->info.can_trigger = remote()->info.can_set_pose = false;
    const auto folder = std::filesystem::path{testing::TempDir()} / "compare_fast_camera";
    std::filesystem::create_directories(folder);
    std::ofstream{folder / "toftwind.toml"}
        << "[listen]\naddress = \"127.0.0.1\"\nport = 0\nsocket = \"\"\n"
           "[limits]\nsubscription_backlog_mb = 1\n[[source]]\nname = \"fast\"\ndriver = \"fake\"\n";
    daemon::Daemon::Options options;
    options.config = folder / "toftwind.toml";
    options.drivers = {&kFake, 1};
    auto started = daemon::Daemon::start(options);
    ASSERT_TRUE(started.ok()) << started.error().message;
    daemon_ = *std::move(started);
    runner_ = std::thread{[this] { daemon_->run(); }};
    auto client = Client::connect(fmt::format("127.0.0.1:{}", daemon_->port()));
    ASSERT_TRUE(client.ok()) << client.error().message;
    client_ = std::make_unique<Client>(*std::move(client));
  }
  void TearDown() override {
    client_.reset();
    if (daemon_) daemon_->stop();
    if (runner_.joinable()) runner_.join();
    remote().reset();
  }

  std::unique_ptr<daemon::Daemon> daemon_;
  std::thread runner_;
  std::unique_ptr<Client> client_;
  Progress silent_{nullptr};
};

/// Of each frame of that source in the log, in order: which one of all that the camera made.
std::vector<int> sequencesOf(const Capture& captured, const std::string& source) {
  std::vector<int> sequences;
  for (const Json& entry : captured.log) {
    const std::string line = entry.line(), key = "\"sequence\": ";
    if (line.find(fmt::format("\"source\": \"{}\"", source)) == std::string::npos) continue;
    sequences.push_back(std::stoi(line.substr(line.find(key) + key.size())));
  }
  return sequences;
}

TEST_F(FastCamera, OfWhichThousandsAreMadeMeanwhileIsComparedByItsNewestFrames) {
  constexpr int kPairs = 8;
  SlowFeed slow;
  auto fast = openFeed(*client_, "fast");
  ASSERT_TRUE(fast.ok()) << fast.error().message;
  const auto captured = capture(slow, **fast, {.frames = kPairs}, silent_);
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  const auto sequences = sequencesOf(*captured, "fast");
  ASSERT_EQ(sequences.size(), static_cast<std::size_t>(kPairs));
  // Waiting frames would make these 0 … 7. A frame can be on its way while the next is made, but the
  // one of the last pair is none of the first round's.
  EXPECT_GE(sequences.back(), kFramesMeanwhile);
}

TEST_F(FastCamera, IsAskedAfterTheSlowOneAlsoWhereItIsA) {
  // The camera has made nothing before the simulator is asked: waiting for it first would not end.
  SlowFeed slow;
  auto fast = openFeed(*client_, "fast");
  ASSERT_TRUE(fast.ok()) << fast.error().message;
  const auto captured =
      capture(**fast, slow, {.frames = 2, .timeout = std::chrono::seconds{20}}, silent_);
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  EXPECT_EQ(captured->a.entry.name, "fast");
  EXPECT_EQ(captured->poses.front().a.frames(), 2U);
  EXPECT_EQ(sequencesOf(*captured, "fast").size(), 2U);
}

}  // namespace
}  // namespace toftwin::compare
