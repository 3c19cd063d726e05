// SPDX-License-Identifier: Apache-2.0
// The facade usb_camera of a running daemon, plugged into this kernel over USB/IP: what uvcvideo, v4l2-ctl
// and our own driver see of it.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>

#include "facade_frames.h"

namespace toftwin::kernel_test {
namespace {

using daemon::test::eventually;
using daemon::test::kSoon;

constexpr std::uint16_t kUsbipPort = 3240;

bool hasTool(const std::string& name) { return std::filesystem::exists("/bin/" + name); }

class UsbCamera : public FacadeFrames {
 protected:
  void SetUp() override {
    run("ip link set lo up; mkdir -p /var/run");
    FacadeFrames::SetUp();
  }
  void TearDown() override {
    stop();
    EXPECT_TRUE(eventually([] { return drivers::v4l2::row().list().empty(); }))
        << "it is unplugged with the daemon";
    FacadeFrames::TearDown();
  }

  void startCamera(const std::string& source, const std::string& facade = {}) {
    start(fmt::format("{}[[facade]]\nkind = 'usb_camera'\nsource = 'cam'\n{}\n", source, facade));
  }

  /// What `usbip attach` does. False: the facade has no camera, or the kernel does not take it.
  static bool attach() {
    const transport::FileDescriptor socket{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(kUsbipPort);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) return false;
    std::array<char, 40> request{0x01, 0x11, '\x80', 0x03, 0, 0, 0, 0, '1', '-', '1'};
    std::array<unsigned char, 8 + 312> answer{};
    if (::send(socket.get(), request.data(), request.size(), MSG_NOSIGNAL) != 40) return false;
    const auto got = ::recv(socket.get(), answer.data(), answer.size(), MSG_WAITALL);
    if (got != static_cast<ssize_t>(answer.size()) || answer[7] != 0) return false;
    const unsigned speed = answer[8 + 256 + 32 + 11];
    // Ports of high speed come first, then eight of SuperSpeed.
    const std::string wish = fmt::format("{} {} 65538 {}", speed == 5 ? 8 : 0, socket.get(), speed);
    std::ofstream file{"/sys/devices/platform/vhci_hcd.0/attach"};
    return static_cast<bool>(file << wish << std::flush);
  }
  /// And until the kernel has nodes for it.
  static void attachAndWait() {
    ASSERT_TRUE(eventually([] { return attach(); }));
    waitForNode();
  }
  static void waitForNode() {
    ASSERT_TRUE(eventually([] { return !drivers::v4l2::row().list().empty(); }));
  }
};

/// In millimetres, 0 where there is none: what the driver made metres of.
Codes depthCodesOf(const Frame& frame) {
  Codes codes;
  for (const float depth_m : frame.find(PlaneKind::Depth)->as<float>())
    codes.push_back(std::isnan(depth_m) ? std::uint16_t{0}
                                        : static_cast<std::uint16_t>(std::lround(depth_m * 1000.0F)));
  return codes;
}

TEST_F(UsbCamera, EveryFrameOfOurDriverIsTheNativeOneBitForBitInDepthAndInfrared) {
  std::ofstream{"/tmp/facade.toml"} << "[depth]\nformat = 'Z16'\n[infrared]\nformat = 'Y16'\n"
                                       "[lens]\nfx = 64\ncx = 31.5\ncy = 23.5\n";
  for (const std::string facade :
       {"", "transfers = 'isochronous'", "speed = 'super'", "speed = 'super'\ntransfers = 'isochronous'"}) {
    startCamera(kFacadePattern, facade);
    attachAndWait();
    collect();
    const auto source =
        started(fmt::format("uri = '{}'\ncamera = '/tmp/facade.toml'", drivers::v4l2::row().list().front()));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().serial, "cam");
    EXPECT_EQ(source->info().model, "toftwin test pattern");
    int last = -1;
    for (int i = 0; i < 8; ++i) {
      const auto frame = nextFrame(*source);
      ASSERT_TRUE(frame.ok()) << frame.error().message;
      const int place = placeOf(depthCodesOf(*frame));
      ASSERT_GE(place, 0) << "frame " << i << " is none of the native ones; " << facade;
      if (last >= 0) {
        EXPECT_EQ(place, last + 1) << facade;
      }
      last = place;
      const auto infrared = frame->find(PlaneKind::Amplitude)->as<float>();
      const Codes expected = codesOf(seen_.at(static_cast<std::size_t>(place)), PlaneKind::Amplitude);
      EXPECT_TRUE(std::ranges::equal(infrared, expected)) << facade;
    }
    source->stop();
    natives_.reset();
    native_.reset();
    seen_.clear();
    stop();
    ASSERT_TRUE(eventually([] { return drivers::v4l2::row().list().empty(); }));
  }
}

TEST_F(UsbCamera, OurDriverFindsItCompliant) {
  startCamera(kFacadePattern);
  attachAndWait();
  expectCompliant(drivers::v4l2::row().list().front());
}

/// The payload headers that uvcvideo's node for metadata gives: their presentation times.
/// [Linux kernel, Documentation/userspace-api/media/v4l/metafmt-uvc.rst]
std::vector<std::uint32_t> presentationTimesIn(const std::string& file) {
  std::ifstream in{file, std::ios::binary};
  const std::string bytes{std::istreambuf_iterator<char>{in}, {}};
  constexpr std::size_t kLengthAt = 10, kTimeAt = 12;
  std::vector<std::uint32_t> times;
  for (std::size_t at = 0; at + kTimeAt + 4 <= bytes.size();) {
    std::uint32_t time = 0;
    std::memcpy(&time, bytes.data() + at + kTimeAt, sizeof time);
    if (times.empty() || times.back() != time) times.push_back(time);
    at += kLengthAt + static_cast<unsigned char>(bytes[at + kLengthAt]);
  }
  return times;
}

TEST_F(UsbCamera, StockToolsListAttachAndStreamItWithTheNativeFramesAndTimeStamps) {
  if (!hasTool("usbip") || !hasTool("v4l2-ctl")) GTEST_SKIP() << "usbip and v4l2-ctl are not installed here";
  startCamera(kFacadePattern);
  ASSERT_TRUE(eventually(
      [] { return std::system("usbip list -r 127.0.0.1 > /tmp/list && grep -q 1-1: /tmp/list") == 0; }));
  run("cat /tmp/list");
  run("usbip attach -r 127.0.0.1 -b 1-1");
  waitForNode();
  collect();
  constexpr int kCount = 12;
  // The nodes of each stream: images, and metadata of their payloads.
  run("for node in 0 1 2 3; do v4l2-ctl -d /dev/video$node --info | grep -E 'Card|Bus'; done");
  run("v4l2-ctl -d /dev/video1 --stream-mmap=8 --stream-count=12 --stream-to=/tmp/meta.raw > /dev/null 2>&1 "
      "& "
      "v4l2-ctl -d /dev/video0 --list-formats-ext && "
      "v4l2-ctl -d /dev/video0 -v pixelformat='Z16 ' --stream-mmap=4 --stream-count=12 "
      "--stream-to=/tmp/depth.raw");
  const auto images = imagesIn("/tmp/depth.raw");
  ASSERT_EQ(images.size(), std::size_t{kCount});
  int first = -1;
  for (int i = 0; i < kCount; ++i) {
    const int place = placeOf(images[static_cast<std::size_t>(i)]);
    ASSERT_GE(place, 0) << "image " << i << " is none of the native frames";
    if (first < 0) first = place;
    EXPECT_EQ(place, first + i);
  }
  const auto times = presentationTimesIn("/tmp/meta.raw");
  ASSERT_GE(times.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    const Frame& native = seen_.at(static_cast<std::size_t>(first) + i);
    EXPECT_EQ(times[i], static_cast<std::uint32_t>(native.moment.exposures.at(0).start.ns / 1000));
  }
}

TEST_F(UsbCamera, ALostSourcePullsThePlugAndComesBackAsACameraThatStreamsAgain) {
  startCamera(kFacadePattern + "[[source.fault]]\nkind = 'disconnect'\nfirst = 8\noutage_s = 1\n");
  attachAndWait();
  auto source = started(fmt::format("uri = '{}'", drivers::v4l2::row().list().front()));
  ASSERT_NE(source, nullptr);
  const Error end = endOf(*source);
  EXPECT_EQ(end.code, Error::Code::Disconnected) << end.message;
  source.reset();
  ASSERT_TRUE(eventually([] { return drivers::v4l2::row().list().empty(); })) << "the node has gone";
  attachAndWait();
  source = started(fmt::format("uri = '{}'", drivers::v4l2::row().list().front()));
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(nextFrame(*source).ok());
}

TEST_F(UsbCamera, AControlOfTheNodeSetsTheSimulatedCamera) {
  if (!hasTool("v4l2-ctl")) GTEST_SKIP() << "v4l2-ctl is not installed here";
  startCamera("[[source]]\nname = 'cam'\ndriver = 'sim'\nuri = 'sim:o3d303_binned'\n");
  attachAndWait();
  const auto valueOf = [&](std::string_view name) {
    const auto description = client().describe("cam");
    if (!description) return -3.0;
    for (const Parameter& one : description->parameters) {
      if (one.name == name) return one.value.value_or(-1.0);
    }
    return -2.0;
  };
  run("v4l2-ctl -d /dev/video0 --list-ctrls --set-ctrl=exposure_time_absolute=9");
  EXPECT_EQ(valueOf("exposure_us"), 900.0);
}

}  // namespace
}  // namespace toftwin::kernel_test
