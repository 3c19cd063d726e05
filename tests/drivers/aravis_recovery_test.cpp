// SPDX-License-Identifier: Apache-2.0
// A GigE camera is lost and comes back, while a subscriber stays: one of ours, and the library's
// own in a process that is killed.
#include <fcntl.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>

#include "aravis_testing.h"
#include "drivers/compliance.h"
#include "recovery_rig.h"

namespace toftwin::test {
namespace {

using drivers::aravis::test::openWith;
using std::chrono::milliseconds;

void losesAndFinds(std::string_view what, const std::function<void(EmulatedGige&)>& lose,
                   const std::function<void(EmulatedGige&)>& giveBack) {
  EmulatedGige camera{ownLoopbackAddress()};
  RecoveryRig rig{[&] { return openWith(camera.address(), "parameters = ['Gain', 'TriggerActivation']"); }};
  ASSERT_TRUE(rig.isSubscribed());
  const Result<> set =
      rig.command([](drivers::Source& source) { return source.setParameter("Gain", 7.0); });
  ASSERT_TRUE(set.ok()) << set.error().message;
  const Result<> chosen = rig.command(
      [](drivers::Source& source) { return source.setParameterText("TriggerActivation", "FallingEdge"); });
  ASSERT_TRUE(chosen.ok()) << chosen.error().message;
  const auto outcome = rig.loseAndFind(
      what, milliseconds{700}, [&] { lose(camera); }, [&] { giveBack(camera); });
  ASSERT_TRUE(outcome.has_value());
  const auto& [last, first, took] = *outcome;
  EXPECT_LT(took, kBackWithin);
  EXPECT_EQ(first.sequence, last.sequence + 1) << "the subscription went on";
  const double gap_ms =
      static_cast<double>(first.moment.received.ns - last.moment.received.ns) * 1e-6;
  // An interval of rounding, and one because a frame may have come up to an interval late.
  EXPECT_NEAR(static_cast<double>(first.dropped_by_device + 1), gap_ms / 20.0, 2.0);
  EXPECT_GT(first.moment.exposures[0].start, last.moment.exposures[0].start);
  EXPECT_EQ(camera.reg(EmulatedGige::kGain), 7u) << "what a client had set is set again";
  EXPECT_EQ(camera.reg(EmulatedGige::kTriggerActivation), 1u);
}

TEST(AravisRecovery, ARebootedCameraIsBackWithinASecond) {
  losesAndFinds(
      "rebooted", [](auto& camera) { camera.is_cut = true; },
      [](auto& camera) {
        camera.reboot();
        camera.is_cut = false;
      });
}

TEST(AravisRecovery, ACutLineIsBackWithinASecond) {
  // The camera waits for the heartbeat of who vanished; that time runs while the line is cut.
  losesAndFinds(
      "cable pulled", [](auto& camera) { camera.is_cut = true; },
      [](auto& camera) { camera.is_cut = false; });
}

TEST(AravisRecovery, AHungCameraIsBackWithinASecond) {
  losesAndFinds(
      "hung", [](auto& camera) { camera.is_hung = true; },
      [](auto& camera) { camera.is_hung = false; });
}

// ---- the library's own camera ------------------------------------------------------------------

/// In a process of its own, on 127.0.0.1, which one test at a time may use.
class LibraryCamera {
 public:
  /// `nodes`: a file of GenICam nodes that make it a 3D camera, or none for the grey one that it is.
  explicit LibraryCamera(const char* nodes = nullptr)
      : nodes_(nodes), lock_(::open("/tmp/toftwin_gige_camera.lock", O_CREAT | O_RDWR | O_CLOEXEC, 0666)) {
    ::flock(lock_, LOCK_EX);
    start();
  }
  LibraryCamera(const LibraryCamera&) = delete;
  LibraryCamera& operator=(const LibraryCamera&) = delete;
  ~LibraryCamera() {
    kill();
    ::close(lock_);
  }
  void kill() {
    if (process_ <= 0) return;
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
    process_ = -1;
  }
  void start() {
    process_ = ::fork();
    if (process_ == 0) {
      ::execl(TOFTWIN_LIBRARY_CAMERA, TOFTWIN_LIBRARY_CAMERA, nodes_, nullptr);
      ::_exit(127);
    }
  }
  /// Small images: the camera sends a frame at once, and the kernel's socket buffers are small.
  static constexpr const char* kKeys =
      "set = ['Width = 128', 'Height = 96']\nparameters = ['ExposureTimeAbs', 'GainRaw']\n";
  Result<std::unique_ptr<drivers::Source>> waitFor() {
    Result<std::unique_ptr<drivers::Source>> opened = openWith("127.0.0.1", kKeys);
    for (int i = 0; i < 100 && !opened; ++i) {
      std::this_thread::sleep_for(milliseconds{50});
      opened = openWith("127.0.0.1", kKeys);
    }
    return opened;
  }

 private:
  const char* nodes_;
  int lock_;
  pid_t process_ = -1;
};

void expectCompliant(const std::string& keys) {
  const drivers::Driver driver = drivers::aravis::row();
  const drivers::Candidate candidate{.driver = &driver,
                                     .keys = "uri = 'aravis:127.0.0.1'\n" + keys,
                                     .absent_keys = "uri = 'aravis:127.0.0.77'",
                                     .absent_name = "aravis:127.0.0.77"};
  for (const drivers::Finding& finding : drivers::checkCompliance(candidate)) {
    EXPECT_NE(finding.outcome, drivers::Finding::Outcome::Failed)
        << finding.check << ", because " << finding.because << "\n  " << finding.detail;
  }
}

const std::string k3dKeys = fmt::format("{}pixel_format = 'Coord3D_C16'\n", LibraryCamera::kKeys);

TEST(AravisLibrary, ItsOwnCameraWithADescriptionOf3dGivesItsDepthExactly) {
  LibraryCamera camera{TOFTWIN_LIBRARY_CAMERA_3D};
  ASSERT_TRUE(camera.waitFor().ok());
  const auto opened = openWith("127.0.0.1", k3dKeys);
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  EXPECT_EQ((*opened)->info().camera.fx, 120.0);
  ASSERT_TRUE((*opened)->start().ok());
  for (int i = 0; i < 5; ++i) {
    auto frame = (*opened)->next({}, false);
    for (int n = 0; n < 20 && !frame; ++n) frame = (*opened)->next({}, false);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    const auto depth_m = frame->find(PlaneKind::Depth)->as<float>(), range_m = frame->find(PlaneKind::Range)->as<float>();
    ASSERT_EQ(depth_m.size(), 128u * 96u);
    // library_gige_camera.c: the frame's number is in every pixel, so any but the diagonal says it.
    const long of_frame = std::lround((static_cast<double>(depth_m[1]) * 1e3 - 100.0) / 0.25) - 1004;
    EXPECT_TRUE(of_frame % 7 == 0 && of_frame >= 0 && of_frame < 7 * 64) << of_frame;
    for (int y = 0; y < 96; ++y) {
      for (int x = 0; x < 128; ++x) {
        const auto at = static_cast<std::size_t>(y) * 128 + static_cast<std::size_t>(x);
        ASSERT_EQ(std::isnan(depth_m[at]), x == y) << x << " " << y;
        if (x == y) continue;
        const double z_m = 1e-3 * (100.0 + 0.25 * static_cast<double>(1000 + 4 * x + 16 * y + of_frame));
        ASSERT_EQ(depth_m[at], static_cast<float>(z_m)) << x << " " << y;
        const double a = (x - 63.5) / 120.0, b = (y - 47.5) / 120.0;
        ASSERT_NEAR(range_m[at], z_m * std::sqrt(1.0 + a * a + b * b), 2e-7 * z_m) << "three floats";
      }
    }
  }
  (*opened)->stop();
}

TEST(AravisLibrary, ItsOwnCameraWithADescriptionOf3dIsCompliant) {
  LibraryCamera camera{TOFTWIN_LIBRARY_CAMERA_3D};
  ASSERT_TRUE(camera.waitFor().ok());
  expectCompliant(k3dKeys);
}

TEST(AravisLibrary, ItsOwnCameraIsCompliantAndTriggered) {
  LibraryCamera camera;
  {
    const auto opened = camera.waitFor();
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    EXPECT_EQ((*opened)->info().model, "Aravis Fake");
    EXPECT_EQ((*opened)->info().planes, std::vector{PlaneKind::Amplitude});
    ASSERT_TRUE((*opened)->setParameter("ExposureTimeAbs", 5000).ok());
    EXPECT_EQ((*opened)->state().parameters.at(0).value, 5000.0);
  }
  for (const char* trigger : {"", "trigger = 'software'\n"}) {
    expectCompliant(fmt::format("{}{}", LibraryCamera::kKeys, trigger));
  }
}

TEST(AravisLibrary, FeaturesOfItsOwnCameraAreReadAndSetByName) {
  LibraryCamera camera;
  ASSERT_TRUE(camera.waitFor().ok());
  const auto source =
      openWith("127.0.0.1", fmt::format("{}parameters = ['GainAuto', 'TestBoolean', 'TestStringReg']",
                                        std::string{LibraryCamera::kKeys}.substr(
                                            0, std::string_view{LibraryCamera::kKeys}.find("parameters"))));
  ASSERT_TRUE(source.ok()) << source.error().message;
  const auto before = (*source)->state().parameters;
  ASSERT_EQ(before.size(), 3U);
  EXPECT_EQ(before[0].choices, (std::vector<std::string>{"Off", "Once", "Continuous"}));
  EXPECT_EQ(before[1].choices, (std::vector<std::string>{"false", "true"}));
  EXPECT_TRUE(before[2].text && !before[2].value && before[2].choices.empty());
  for (const auto& [name, text] :
       {std::pair{"GainAuto", "Continuous"}, {"TestBoolean", "true"}, {"TestStringReg", "dock 3"}}) {
    const Result<> set = (*source)->setParameterText(name, text);
    EXPECT_TRUE(set.ok()) << name << ": " << set.error().message;
  }
  const auto after = (*source)->state().parameters;
  EXPECT_EQ(after[0].text, "Continuous");
  EXPECT_EQ(after[0].value, 2.0) << "the entry's own number";
  EXPECT_EQ(after[1].text, "true");
  EXPECT_EQ(after[1].value, 1.0);
  EXPECT_EQ(after[2].text, "dock 3");
}

TEST(AravisLibrary, ItsOwnCameraIsBackWithinASecondAfterItsProcessWasKilled) {
  LibraryCamera camera;
  ASSERT_TRUE(camera.waitFor().ok());
  RecoveryRig rig{[] { return openWith("127.0.0.1", LibraryCamera::kKeys); }};
  ASSERT_TRUE(rig.isSubscribed());
  const auto outcome = rig.loseAndFind(
      "the library's camera, killed", milliseconds{700}, [&] { camera.kill(); },
      [&] { camera.start(); });
  ASSERT_TRUE(outcome.has_value());
  EXPECT_LT(outcome->took, kBackWithin);
  EXPECT_EQ(outcome->first.sequence, outcome->last.sequence + 1);
}

}  // namespace
}  // namespace toftwin::test
