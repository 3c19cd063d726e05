// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <fstream>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/compare/characteristics.h"
#include "calib/compare/compare.h"
#include "daemon/daemon.h"
#include "protocol/record/recording.h"

namespace toftwin::compare {
namespace {

/// A daemon in this program with a simulated camera, its equal with another seed, and one 10 mm
/// off.
class ThroughTheDaemon : public testing::Test {
 protected:
  void SetUp() override {
    folder = std::filesystem::path{testing::TempDir()} /
             (std::string{"compare_daemon_"} +
              testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    write("scene.toml",
          "[[material]]\nname = \"wall\"\nalbedo = 0.6\n[[object]]\nshape = \"rectangle\"\nsize_m "
          "= [9, 9, 0]\nposition_m = [0, 0, 2]\nmaterial = \"wall\"\n");
    std::string config = "[listen]\naddress = \"127.0.0.1\"\nport = 0\nsocket = \"\"\n";
    for (const auto& [name, seed, delay_mm] :
         {std::tuple{"a", 1, 0.0}, std::tuple{"equal", 2, 0.0}, std::tuple{"off", 3, 10.0}}) {
      write(
          fmt::format("{}.toml", name),
          fmt::format(
              "model = \"{}\"\n[lens]\nwidth = 48\nheight = 36\nfx = 50.0\nfy = 50.0\ncx = "
              "23.5\ncy = 17.5\n[[emitter]]\nposition_mm = [0.0, 0.0, "
              "0.0]\n[[modulation]]\nfrequency_mhz = 30.0\n"
              "[sampling]\nsteps = 4\n[decoder]\nalgorithm = "
              "\"n_phase\"\nminimum_amplitude_electrons = 1.0\nnearest_m = 0.1\nfarthest_m = 4.9\n"
              "[[effect]]\ntype = \"shot_noise\"\n[[effect]]\ntype = \"delay\"\noffset_mm = "
              "{:.1f}\n",
              name, delay_mm));
      config += fmt::format(
          "[[source]]\nname = \"{0}\"\ndriver = \"sim\"\ncamera = \"{0}.toml\"\nscene = "
          "\"scene.toml\"\nsamples_per_pixel = 4\nmax_surfaces = 1\npixel_extent = 0.0\nseed = "
          "{1}\n",
          name, seed);
    }
    write("toftwind.toml", config);
    daemon::Daemon::Options options;
    options.config = folder / "toftwind.toml";
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
  }
  void write(const std::string& name, const std::string& text) {
    std::ofstream{folder / name} << text;
  }
  [[nodiscard]] static std::vector<PoseSpec> poses() {
    return {{.name = "one"},
            {.name = "two", .position_m = {0.1, 0.0, -0.3}, .euler_deg = {0.0, 10.0, 0.0}},
            {.name = "one, again"}};
  }
  Result<Capture> captureBoth(Feed& a, Feed& b) {
    return capture(a, b, {.poses = poses(), .frames = kFrames}, silent_);
  }
  static Summary surfaceDifference(const Capture& captured) {
    std::vector<PoseComparison> compared;
    for (const auto& pose : captured.poses) {
      auto result = comparePose(pose.a, pose.b);
      EXPECT_TRUE(result.ok()) << result.error().message;
      compared.push_back(*std::move(result));
    }
    return characterise(compared).regions.front().difference_mm;
  }

  static constexpr int kFrames = 8;
  std::filesystem::path folder;
  std::unique_ptr<daemon::Daemon> daemon_;
  std::thread runner_;
  std::unique_ptr<Client> client_;
  Progress silent_{nullptr};
};

TEST_F(ThroughTheDaemon, EqualCamerasShowNoBias) {
  auto a = openFeed(*client_, "a"), b = openFeed(*client_, "equal");
  ASSERT_TRUE(a.ok() && b.ok());
  const auto captured = captureBoth(**a, **b);
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  const Summary all = surfaceDifference(*captured);
  EXPECT_EQ(all.n, 3U * 48U * 36U);
  EXPECT_NEAR(all.mean, 0.0, 4.0 * all.sd / std::sqrt(static_cast<double>(all.n)));  // 1 in 16,000 for other seeds
}

TEST_F(ThroughTheDaemon, TenMillimetresAreFoundAndNoFrameIsLost) {
  auto a = openFeed(*client_, "a"), b = openFeed(*client_, "off");
  ASSERT_TRUE(a.ok() && b.ok());
  const auto captured = captureBoth(**a, **b);
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  const Summary all = surfaceDifference(*captured);
  EXPECT_NEAR(all.mean, 10.0, 4.0 * all.sd / std::sqrt(static_cast<double>(all.n)));
  for (const Json& entry : captured->log) {
    EXPECT_THAT(entry.line(), testing::HasSubstr("\"dropped_before\": 0,\"dropped_by_device\": 0"));
  }
}

TEST_F(ThroughTheDaemon, ARecordingOfTheSamePosesCanStandInForACamera) {
  const auto file = folder / "off.mcap";
  {
    auto off = openFeed(*client_, "off");
    ASSERT_TRUE(off.ok());
    auto writer = record::Writer::create(file);
    ASSERT_TRUE(writer.ok());
    for (const PoseSpec& pose : poses()) {
      ASSERT_TRUE((*off)->setPose(pose.world_from_camera()).ok());
      for (int kept = 0; kept < kFrames;) {
        auto frame = (*off)->next(std::chrono::seconds{10});
        ASSERT_TRUE(frame.ok()) << frame.error().message;
        if (!samePose(*frame->moment.world_from_camera, pose.world_from_camera())) continue;
        ASSERT_TRUE(writer->write(*frame).ok());
        ++kept;
      }
    }
    ASSERT_TRUE(writer->close().ok());
  }
  auto a = openFeed(*client_, "a"), b = openRecording(file.string());
  ASSERT_TRUE(a.ok() && b.ok());
  const auto captured = captureBoth(**a, **b);
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  const Summary all = surfaceDifference(*captured);
  EXPECT_NEAR(all.mean, 10.0, 4.0 * all.sd / std::sqrt(static_cast<double>(all.n)));
}

TEST_F(ThroughTheDaemon, AnUnknownSourceAndAnUnknownRecordingAreNamed) {
  const auto source = openFeed(*client_, "nobody");
  ASSERT_FALSE(source.ok());
  EXPECT_THAT(source.error().message, testing::HasSubstr("nobody"));
  const auto recording = openRecording((folder / "none.mcap").string());
  ASSERT_FALSE(recording.ok());
  EXPECT_THAT(recording.error().message, testing::HasSubstr("none.mcap"));
}

}  // namespace
}  // namespace toftwin::compare
