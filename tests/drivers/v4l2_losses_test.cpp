// SPDX-License-Identifier: Apache-2.0
// The driver against an emulated kernel: losses, clocks, stops, and a kernel that talks nonsense.
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <linux/ioctl.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <future>
#include <random>
#include <thread>

#include "drivers/pace.h"
#include "drivers/v4l2/pairing.h"
#include "v4l2_testing.h"
#include "start_stop.h"

namespace toftwin::drivers::v4l2 {
namespace {

using std::chrono::milliseconds;
using test::DescriptionFile;
using test::EmulatedV4l2;
using test::kLens;
using test::kUri;
using test::openWith;
using test::someControls;
using test::started;

// ---- losses ------------------------------------------------------------------------------------

std::uint64_t lostIn(Source& source, int frames, std::string* because = nullptr) {
  std::uint64_t lost = 0;
  for (int i = 0; i < frames; ++i) {
    const auto frame = source.next({}, false);
    EXPECT_TRUE(frame.ok()) << frame.error().message;
    if (frame) lost += frame->dropped_by_device;
    if (frame && because != nullptr) *because += frame->dropped_because;
  }
  return lost;
}

TEST(V4l2, PicturesThatTheKernelDroppedAreCountedAlsoWhereItsCountWraps) {
  EmulatedV4l2 system{{{}}};
  system.beginAt(0, 0xFFFFFFFEU);
  const auto source = started(system);
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(lostIn(*source, 5), 0u);
  system.lose(0, 3);
  std::string because;
  EXPECT_EQ(lostIn(*source, 5, &because), 3u);
  EXPECT_EQ(because, "the kernel had no buffer free for it, or threw it away (3)");
}

TEST(V4l2, DamagedAndShortPicturesAreCountedAndNotShown) {
  EmulatedV4l2 system{{{}}};
  const auto source = started(system);
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(lostIn(*source, 2), 0u);
  system.damage(0, 2);
  std::string damaged, shortened;
  EXPECT_EQ(lostIn(*source, 3, &damaged), 2u);
  EXPECT_EQ(damaged, "its data came damaged, says the kernel (2)");
  system.shorten(0, 3);
  EXPECT_EQ(lostIn(*source, 3, &shortened), 3u);
  EXPECT_EQ(shortened, "bytes of it did not come (3)");
}

TEST(V4l2, AStreamOfDamagedPicturesIsOpenedAnew) {
  EmulatedV4l2 system{{{}}};
  const auto source = started(system);
  ASSERT_NE(source, nullptr);
  system.damage(0, 1'000'000);
  Result<Frame> frame = source->next({}, false);
  for (int i = 0; i < 5 && frame; ++i) frame = source->next({}, false);
  ASSERT_FALSE(frame.ok());
  EXPECT_EQ(frame.error().code, Error::Code::Disconnected);
  EXPECT_NE(frame.error().message.find("damaged"), std::string::npos);
}

TEST(V4l2, ACameraThatHangsIsFirstATimeoutThenDisconnected) {
  EmulatedV4l2 system{{{}}};
  const auto source = started(system);
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(source->next({}, false).ok());
  system.hang(0);
  // One picture may be under way.
  Result<Frame> frame = source->next({}, false);
  if (frame) frame = source->next({}, false);
  ASSERT_FALSE(frame.ok());
  EXPECT_EQ(frame.error().code, Error::Code::Timeout);
  frame = source->next({}, false);
  ASSERT_FALSE(frame.ok());
  EXPECT_EQ(frame.error().code, Error::Code::Disconnected) << frame.error().message;
}

TEST(V4l2, AnUnpluggedCameraIsDisconnectedAndComesBack) {
  EmulatedV4l2 system{{{}}};
  auto source = started(system);
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(source->next({}, false).ok());
  auto unplugged = std::async(std::launch::async, [&] {
    std::this_thread::sleep_for(milliseconds{20});
    system.unplug();
  });
  Result<Frame> frame = source->next({}, false);
  while (frame) frame = source->next({}, false);
  EXPECT_EQ(frame.error().code, Error::Code::Disconnected) << frame.error().message;
  EXPECT_FALSE(source->start().ok());
  source.reset();
  EXPECT_EQ(system.heldByUser(), 0u);
  EXPECT_EQ(openWith(system).error().code, Error::Code::NotFound);
  system.plugIn();
  source = started(system);
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(source->next({}, false).ok());
}

TEST(V4l2, AnyWordOfTheKernelsForAVanishedCameraIsDisconnected) {
  for (const int error : {ENODEV, EIO, EINVAL, EPIPE}) {
    EmulatedV4l2 system{{{}}};
    const auto source = started(system);
    ASSERT_NE(source, nullptr);
    system.failWith(VIDIOC_DQBUF, error);
    const auto frame = source->next({}, false);
    ASSERT_FALSE(frame.ok());
    EXPECT_EQ(frame.error().code, Error::Code::Disconnected) << error;
  }
}

// ---- two nodes ---------------------------------------------------------------------------------

Stream::Picture pictureAt(std::int64_t stamp_ns) {
  Stream::Picture picture;
  picture.stamp_ns = stamp_ns;
  return picture;
}

TEST(V4l2Pairing, TakesTheNearestAndLeavesOutWhatHasNoPartner) {
  Pairing pairing{10};
  for (const int depth : {100, 133, 166, 200}) pairing.addDepth(pictureAt(depth));
  for (const int infrared : {60, 95, 101, 168, 190, 203}) pairing.addInfrared(pictureAt(infrared));
  std::vector<std::pair<std::int64_t, std::int64_t>> pairs;
  while (const auto pair = pairing.take()) {
    pairs.emplace_back(pair->depth.stamp_ns, pair->infrared.stamp_ns);
  }
  EXPECT_EQ(pairs, (std::vector<std::pair<std::int64_t, std::int64_t>>{
                       {100, 101}, {166, 168}, {200, 203}}));
  const auto lonely = pairing.takeLonelyDepth();
  ASSERT_EQ(lonely.size(), 1u);
  EXPECT_EQ(lonely[0].stamp_ns, 133);
  EXPECT_EQ(pairing.takeLonelyInfrared().size(), 3u);
}

TEST(V4l2Pairing, KeepsNoMoreBuffersThanItNeeds) {
  Pairing pairing{10};
  std::size_t given_back = 0;
  for (int i = 0; i < 100; ++i) {
    pairing.addDepth(pictureAt(100 * i));
    EXPECT_FALSE(pairing.take());
    given_back += pairing.takeLonelyDepth().size();
  }
  EXPECT_EQ(given_back, 98u);
}

TEST(V4l2, InfraredComesFromItsOwnNodeAndFromTheOnePlaneThatHasBoth) {
  EmulatedV4l2 two{{{}, {.path = "/dev/video1", .formats = {V4L2_PIX_FMT_GREY}}}};
  const DescriptionFile description{"[infrared]\nformat = 'Y8'\n"};
  const auto source = started(two, description.key());
  ASSERT_NE(source, nullptr);
  const auto frame = source->next({}, false);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  const auto amplitude = frame->find(PlaneKind::Amplitude)->as<float>();
  EXPECT_EQ(amplitude[1], static_cast<float>(EmulatedV4l2::codeAt(0, 1, 0) & 0xFFU));
  EXPECT_EQ(lostIn(*source, 10), 0u);

  EmulatedV4l2 both{{{.formats = {V4L2_PIX_FMT_INZI}}}};
  const auto second = started(both);
  ASSERT_NE(second, nullptr);
  const auto frame_of_both = second->next({}, false);
  ASSERT_TRUE(frame_of_both.ok()) << frame_of_both.error().message;
  EXPECT_EQ(frame_of_both->find(PlaneKind::Amplitude)->as<float>()[1],
            static_cast<float>(EmulatedV4l2::codeAt(0, 1, 0)));
  EXPECT_FLOAT_EQ(frame_of_both->find(PlaneKind::Depth)->as<float>()[1],
                  static_cast<float>(EmulatedV4l2::codeAt(0, 1, 8)) * 1e-3F);
}

TEST(V4l2, ANodeWithoutInfraredPicturesIsACameraThatHangs) {
  EmulatedV4l2 system{{{}, {.path = "/dev/video1", .formats = {V4L2_PIX_FMT_GREY}}}};
  const DescriptionFile description{"[infrared]\nformat = 'Y8'\n"};
  const auto source = started(system, description.key());
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(source->next({}, false).ok());
  system.hang(1);
  Result<Frame> frame = source->next({}, false);
  for (int i = 0; i < 5 && (frame || frame.error().code == Error::Code::Timeout); ++i) {
    frame = source->next({}, false);
  }
  ASSERT_FALSE(frame.ok());
  EXPECT_EQ(frame.error().code, Error::Code::Disconnected) << frame.error().message;
}

// ---- clocks ------------------------------------------------------------------------------------

std::int64_t wallMinus(DeviceTime time) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count() - time.ns;
}

TEST(V4l2, AStampOfTheHostsClockRelatesToTheWallClockAtOnce) {
  EmulatedV4l2 system{{{}}};
  const auto source = started(system, "delay_ms = 2");
  ASSERT_NE(source, nullptr);
  const auto frame = source->next({}, false);
  ASSERT_TRUE(frame.ok());
  EXPECT_GE(frame->moment.clock.uncertainty_ns, 0);
  EXPECT_LT(frame->moment.clock.uncertainty_ns, 2'000'000);
  // The picture was stamped when it was taken: now less the delay, less what passed since.
  const std::int64_t age =
      wallMinus(frame->moment.exposures[0].start) - frame->moment.clock.host_minus_device_ns;
  EXPECT_GE(age, 2'000'000);
  EXPECT_LT(age, 2'000'000'000);
}

TEST(V4l2, AnUnknownDelayIsAnUncertaintyOfAFrameInterval) {
  EmulatedV4l2 system{{{}}};
  const auto source = started(system);
  ASSERT_NE(source, nullptr);
  const auto frame = source->next({}, false);
  ASSERT_TRUE(frame.ok());
  // A uniform distribution over 5 ms: 5 ms / √12.
  EXPECT_NEAR(static_cast<double>(frame->moment.clock.uncertainty_ns), 5e6 / std::sqrt(12.0),
              0.5e6);
}

TEST(V4l2, AClockOfTheDevicesOwnIsFoundAndItsStepsDoNotShow) {
  EmulatedV4l2 system{{{.stamp_flag = 0, .stamp_offset_us = -1'000'000'000}}};
  const auto source = started(system, "delay_ms = 0.001");
  ASSERT_NE(source, nullptr);
  std::int64_t last = 0;
  Result<Frame> frame = source->next({}, false);
  for (int i = 0; i < 40 && frame; ++i, frame = source->next({}, false)) {
    if (i == 20) system.setClock(0, 5'000'000'000);
    const DeviceTime time = frame->moment.exposures[0].start;
    if (i > 0) {
      EXPECT_GT(time.ns, last);
      EXPECT_LT(time.ns - last, 1'000'000'000) << "the clock that was set must not show";
    }
    last = time.ns;
    EXPECT_EQ(frame->moment.clock.uncertainty_ns == -1, i < 7) << i;
  }
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  const std::int64_t error =
      frame->moment.clock.host_minus_device_ns - wallMinus(frame->moment.exposures[0].start);
  EXPECT_LT(std::abs(error), 200'000'000) << "1,000 s and more if it were not found";
}

// ---- a kernel that talks nonsense ---------------------------------------------------------------

/// Answers what the emulated kernel answers, but now and then with another byte, or with an error.
class GarbledV4l2 final : public System {
 public:
  GarbledV4l2(EmulatedV4l2& kernel, std::uint32_t seed) : kernel_(kernel), random_(seed) {}
  std::vector<std::string> nodes() override { return kernel_.nodes(); }
  std::string usbAttribute(const std::string& node, std::string_view name) override {
    return kernel_.usbAttribute(node, name);
  }
  int open(const std::string& node) override { return kernel_.open(node); }
  void close(int file) override { kernel_.close(file); }
  int ioctl(int file, unsigned long request, void* argument) override {
    constexpr std::array kErrors{EINVAL, EIO, ENODEV, EBUSY, ENOTTY, EAGAIN, EACCES, ENOMEM};
    if (random_() % 64 == 0) return -kErrors.at(random_() % kErrors.size());
    const int result = kernel_.ioctl(file, request, argument);
    if (random_() % 16 == 0 && (_IOC_DIR(request) & _IOC_READ) != 0) {
      auto* bytes = static_cast<unsigned char*>(argument);
      bytes[random_() % _IOC_SIZE(request)] = static_cast<unsigned char>(random_());
    }
    return result;
  }
  int poll(std::span<pollfd> files, int timeout_ms) override {
    return kernel_.poll(files, timeout_ms);
  }
  std::span<std::byte> map(int file, std::size_t length, std::int64_t offset) override {
    return kernel_.map(file, length, offset);
  }
  void unmap(std::span<std::byte> bytes) override { kernel_.unmap(bytes); }

 private:
  EmulatedV4l2& kernel_;
  std::mt19937 random_;
};

TEST(V4l2, NothingThatAKernelSaysBringsItDown) {
  constexpr std::uint32_t kFirstSeed = 20261121, kRounds = 1000;
  const DescriptionFile description{kLens};  // or the log is full of its absence
  int frames = 0, errors = 0;
  for (std::uint32_t round = 0; round < kRounds; ++round) {
    SCOPED_TRACE(fmt::format("seed {}", kFirstSeed + round));
    EmulatedV4l2 kernel{{{.interval = std::chrono::microseconds{50}, .controls = someControls()}}};
    GarbledV4l2 garbled{kernel, kFirstSeed + round};
    const auto opened =
        openWith(garbled, fmt::format("{}set = ['gain = 8']\nmemory = '{}'", description.key(),
                                      round % 2 == 0 ? "mmap" : "dmabuf"));
    if (!opened || !(*opened)->start()) {
      ++errors;
      continue;
    }
    // A camera that says nothing more is not waited for.
    std::stop_source stop;
    const std::jthread watch{[&](const std::stop_token& done) {
      if (sleepUntil(std::chrono::steady_clock::now() + milliseconds{30}, done))
        stop.request_stop();
    }};
    for (int i = 0; i < 5; ++i) {
      const auto frame = (*opened)->next(stop.get_token(), false);
      frames += frame ? 1 : 0;
      errors += frame ? 0 : 1;
      (*opened)->state();
    }
  }
  EXPECT_GT(frames, 100) << "most was refused: the test does not reach far";
  EXPECT_GT(errors, 100) << "hardly anything was garbled";
}

// ---- stopping and leaks ------------------------------------------------------------------------

TEST(V4l2, AStopEndsTheWaitAndLosesNoFrame) {
  EmulatedV4l2 system{{{.interval = milliseconds{200}}}};
  const auto source = started(system);
  ASSERT_NE(source, nullptr);
  for (int i = 0; i < 10; ++i) {
    std::stop_source stop;
    stop.request_stop();
    EXPECT_EQ(source->next(stop.get_token(), false).error().code, Error::Code::Stopped);
  }
  std::stop_source stop;
  auto waiting =
      std::async(std::launch::async, [&] { return source->next(stop.get_token(), false); });
  std::this_thread::sleep_for(milliseconds{20});
  stop.request_stop();
  EXPECT_EQ(waiting.get().error().code, Error::Code::Stopped);
  EXPECT_EQ(lostIn(*source, 2), 0u);
}

TEST(V4l2, TenThousandStartsAndStopsKeepNoMemory) {
  EmulatedV4l2 system{{{}}};
  const auto opened = openWith(system);
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  toftwin::test::expectNothingKept("v4l2", **opened, 1000);
}

TEST(V4l2, TenThousandStartsAndStopsLeakNothing) {
  EmulatedV4l2 system{{{}}};
  const auto files = toftwin::test::entriesOf("/proc/self/fd");
  {
    const auto opened = openWith(system, "memory = 'dmabuf'");
    ASSERT_TRUE(opened.ok());
    ASSERT_TRUE((*opened)->start().ok());
    const std::size_t held = system.heldByUser();
    for (int i = 0; i < 10'000; ++i) {
      (*opened)->stop();
      ASSERT_TRUE((*opened)->start().ok());
    }
    EXPECT_EQ(system.heldByUser(), held);
    EXPECT_TRUE((*opened)->next({}, false).ok());
  }
  EXPECT_EQ(system.heldByUser(), 0u);
  EXPECT_EQ(toftwin::test::entriesOf("/proc/self/fd"), files);
}

}  // namespace
}  // namespace toftwin::drivers::v4l2
