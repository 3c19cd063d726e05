// SPDX-License-Identifier: Apache-2.0
// The facade usb_camera in a running daemon, with a bare USB/IP host. uvcvideo and the stock tools are its
// judges in tests/kernel/usb_camera_test.cpp.
#include <gtest/gtest.h>
#include <linux/usb/video.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>

#include "facade_testing.h"
#include "usb_host.h"

namespace toftwin::daemon {
namespace {

using namespace test;
using usb_camera::Bytes;
using usb_camera::Writer;

constexpr unsigned kSensorEntity = 1U << 8U, kDepthInterface = 1, kDepthEndpoint = 1, kInfraredEndpoint = 2;

class UsbCameraFacade : public RunningFacade {
 protected:
  void startCamera(const std::string& source_keys, const std::string& facade_keys = {}) {
    port_ = freePort();
    start(fmt::format(
        "[[source]]\nname = 'cam'\n{}\n[[facade]]\nkind = 'usb_camera'\nsource = 'cam'\nport = {}\n{}\n",
        source_keys, port_, facade_keys));
    ASSERT_TRUE(eventually([&] { return UsbHost{port_}.list() == 1; }));
  }
  double valueOf(std::string_view name) {
    const auto description = client().describe("cam");
    if (!description) return -2.0;
    for (const Parameter& one : description->parameters) {
      if (one.name == name) return one.value.value_or(-1.0);
    }
    return -3.0;
  }
  static Bytes u32(std::uint32_t value) { return Writer{}.u32(value).done(); }
  std::uint16_t port_ = 0;
};

struct Image {
  std::uint32_t stamp_us = 0;
  std::vector<std::uint16_t> codes;
};

/// Images as uvcvideo puts them together, from transfers of a length that payloads know nothing of.
class Images {
 public:
  Images(UsbHost& host, std::uint32_t endpoint, std::uint32_t transfer) : host_(host) {
    endpoint_ = endpoint;
    transfer_ = transfer;
  }
  std::optional<Image> next() {
    Bytes pixels;
    while (true) {
      const auto payload = nextPayload();
      if (!payload || payload->size() < 12) return std::nullopt;
      pixels.insert(pixels.end(), payload->begin() + 12, payload->end());
      if ((std::to_integer<unsigned>((*payload)[1]) & UVC_STREAM_EOF) == 0) continue;
      Image image;
      std::memcpy(&image.stamp_us, payload->data() + 2, sizeof image.stamp_us);
      image.codes.resize(pixels.size() / 2);
      std::memcpy(image.codes.data(), pixels.data(), pixels.size());
      return image;
    }
  }

 private:
  std::optional<Bytes> nextPayload() {
    constexpr std::size_t kMostPayload = 16'384;
    Bytes payload;
    while (payload.size() < kMostPayload) {
      host_.ask(endpoint_, transfer_);
      const auto reply = host_.reply();
      if (!reply || reply->status != 0) return std::nullopt;
      payload.insert(payload.end(), reply->data.begin(), reply->data.end());
      if (reply->data.size() < transfer_) break;
    }
    return payload;
  }
  UsbHost& host_;
  std::uint32_t endpoint_, transfer_;
};

/// docs/facades/usb_camera.md, for frames that have depth.
std::uint16_t depthCode(float depth_m) {
  const double count = std::round(1000.0 * static_cast<double>(depth_m));
  return count >= 0.0 && count <= 65'535.0 ? static_cast<std::uint16_t>(count) : std::uint16_t{0};
}

TEST_F(UsbCameraFacade, ImagesOfTheSimulatedCameraAreTheNativeOnesBitForBitWithTheirTimeStamps) {
  startCamera(kSmallSim, "amplitude_per_count = 2.0");
  auto native = client();
  auto stream = native.subscribe("cam", {.policy = SubscribeOptions::Policy::Queue, .queue = 64});
  ASSERT_TRUE(stream.ok()) << stream.error().message;
  Natives natives{*std::move(stream), [](const Frame& frame) { return deviceTimeOf(frame) / 1000; }};
  UsbHost host{port_};
  ASSERT_EQ(host.import(), 0u);
  // An image of 176 x 132 has two full payloads and one of 12 + 46464 - 2 · 16372 = 13732 bytes. Transfers of
  // half of that end where it does, and so an empty one must say that it has ended.
  for (const auto& [endpoint, transfer] :
       {std::pair{kDepthEndpoint, 512U}, {kDepthEndpoint, 6866U}, {kInfraredEndpoint, 16'384U}}) {
    Images images{host, endpoint, transfer};
    int compared = 0;
    for (int i = 0; i < 30 && compared < 3; ++i) {
      const auto image = images.next();
      ASSERT_TRUE(image.has_value());
      const auto frame = natives.at(image->stamp_us);
      ASSERT_TRUE(frame.ok()) << frame.error().message;
      if (*frame == nullptr) continue;
      ++compared;
      const bool is_depth = endpoint == kDepthEndpoint;
      const auto values = (*frame)->find(is_depth ? PlaneKind::Depth : PlaneKind::Amplitude)->as<float>();
      ASSERT_EQ(image->codes.size(), values.size());
      std::size_t with_value = 0;
      for (std::size_t k = 0; k < values.size(); ++k) {
        const std::uint16_t expected = is_depth
                                           ? depthCode(values[k])
                                           : static_cast<std::uint16_t>(std::min(
                                                 65'535.0, std::round(static_cast<double>(values[k]) / 2.0)));
        ASSERT_EQ(image->codes[k], expected) << k;
        with_value += expected != 0 ? 1 : 0;
      }
      EXPECT_GT(with_value, values.size() / 2);
    }
    EXPECT_EQ(compared, 3) << endpoint << " " << transfer;
  }
}

TEST_F(UsbCameraFacade, SetsTheSimulatedCameraAndSaysWhatItRefuses) {
  startCamera(kSmallSim);
  UsbHost host{port_};
  ASSERT_EQ(host.import(), 0u);
  EXPECT_EQ(host.set(UVC_SET_CUR, UVC_CT_EXPOSURE_TIME_ABSOLUTE_CONTROL, kSensorEntity, u32(7)).status, 0);
  EXPECT_EQ(valueOf("exposure_us"), 700.0);
  EXPECT_EQ(host.get(UVC_GET_CUR, UVC_CT_EXPOSURE_TIME_ABSOLUTE_CONTROL, kSensorEntity, 4).data, u32(7));
  // 4 exposures of 15 ms do not fit into 50 ms, which only the source knows.
  EXPECT_EQ(host.set(UVC_SET_CUR, UVC_CT_EXPOSURE_TIME_ABSOLUTE_CONTROL, kSensorEntity, u32(150)).status,
            -EPIPE);
  EXPECT_EQ(host.get(UVC_GET_CUR, UVC_VC_REQUEST_ERROR_CODE_CONTROL, 0, 1).data, Bytes{std::byte{4}})
      << "out of range";
  EXPECT_EQ(valueOf("exposure_us"), 700.0);
  // What is committed is set: 80 ms.
  Bytes probe = host.get(UVC_GET_CUR, UVC_VS_PROBE_CONTROL, kDepthInterface, 34).data;
  ASSERT_EQ(probe.size(), 34u);
  const Bytes interval = u32(800'000);
  std::ranges::copy(interval, probe.begin() + 4);
  EXPECT_EQ(host.set(UVC_SET_CUR, UVC_VS_PROBE_CONTROL, kDepthInterface, probe).status, 0);
  EXPECT_EQ(valueOf("frame_rate_hz"), 20.0) << "it was only asked for";
  EXPECT_EQ(host.set(UVC_SET_CUR, UVC_VS_COMMIT_CONTROL, kDepthInterface, probe).status, 0);
  EXPECT_NEAR(valueOf("frame_rate_hz"), 12.5, 1e-9);
}

TEST_F(UsbCameraFacade, OneHostHasItAtATimeAndTheNextWhenThatLeaves) {
  startCamera(kPattern);
  EXPECT_EQ(log_->count("the camera is plugged in"), 1);
  EXPECT_EQ(log_->count("has become another one"), 0) << "it is the first one";
  {
    UsbHost first{port_};
    ASSERT_EQ(first.import(), 0u);
    EXPECT_EQ(UsbHost{port_}.import(), 2u) << "busy";
    EXPECT_EQ(UsbHost{port_}.list(), 1u);
    EXPECT_TRUE(eventually([&] { return facadeClients() == 1u; }));
  }
  EXPECT_TRUE(eventually([&] { return facadeClients() == 0u; }));
  EXPECT_TRUE(eventually([&] { return UsbHost{port_}.import() == 0; }));
}

TEST_F(UsbCameraFacade, ACableThatIsPulledOnPurposeIsPluggedInAgain) {
  startCamera(kPattern, "[facade.line]\ndisconnect = 0.2\nseed = 2\nlog = 'cable.csv'\n");
  for (int pulled = 0; pulled < 2; ++pulled) {
    std::optional<UsbHost> host;
    ASSERT_TRUE(eventually([&] { return host.emplace(port_).import() == 0; }));
    int transfers = 0;
    for (bool is_there = true; is_there && transfers < 2000; ++transfers) {
      host->ask(kDepthEndpoint, 16'384);
      is_there = host->reply().has_value();
    }
    EXPECT_LT(transfers, 2000) << "after 600 images with a fifth of them cut";
  }
  std::string text;  // is written after the host has seen it
  EXPECT_TRUE(eventually([&] {
    std::ifstream log{folder_ / "cable.csv"};
    text.assign(std::istreambuf_iterator<char>{log}, {});
    return std::ranges::count(text, '\n') == 3;
  })) << text;
  EXPECT_NE(text.find(",disconnect,"), std::string::npos) << text;
}

TEST_F(UsbCameraFacade, UnlinkedTransfersAreNotAnsweredAndUnknownOnesAreNoError) {
  startCamera("driver = 'pattern'\npace = 'trigger'\nwidth = 64\nheight = 48\n");
  UsbHost host{port_};
  ASSERT_EQ(host.import(), 0u);
  const std::uint32_t waiting = host.ask(kDepthEndpoint, 16'384);
  host.command(UsbHost::kUnlink, 90, 0, 0, waiting);
  host.command(UsbHost::kUnlink, 91, 0, 0, 12'345);
  const auto first = host.reply(), second = host.reply();
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->number, 90u);
  EXPECT_EQ(first->status, -ECONNRESET);
  EXPECT_EQ(second->number, 91u);
  EXPECT_EQ(second->status, 0);
}

TEST_F(UsbCameraFacade, AHostThatLiesIsCutOffAndHarmsNobody) {
  startCamera("driver = 'pattern'\npace = 'trigger'\nwidth = 64\nheight = 48\n");
  const std::vector<std::function<void(UsbHost&)>> lies{
      [](UsbHost& host) { host.command(77, 1, 0, 0, 0); },
      [](UsbHost& host) { host.command(UsbHost::kSubmit, 1, UsbHost::kIn, 16, 64); },
      [](UsbHost& host) { host.command(UsbHost::kSubmit, 1, UsbHost::kIn, 1, 0xFFFF'FFF0); },
      [](UsbHost& host) { host.command(UsbHost::kSubmit, 1, 0, 0, 1U << 20U); },
      [](UsbHost& host) { host.command(UsbHost::kSubmit, 1, UsbHost::kIn, 1, 64, {}, {}, 0x7FFF'FFFF); },
      [](UsbHost& host) {
        for (int i = 0; i < 1025; ++i) host.ask(kDepthEndpoint, 16'384);
      }};
  for (std::size_t i = 0; i < lies.size(); ++i) {
    std::optional<UsbHost> host;
    ASSERT_TRUE(eventually([&] { return host.emplace(port_).import() == 0; })) << "after lie " << i;
    lies[i](*host);
    EXPECT_FALSE(host->reply().has_value()) << "lie " << i;
  }
  EXPECT_EQ(log_->count("is cut off"), static_cast<int>(lies.size()));
  UsbHost noise{port_};
  noise.send(Bytes(100, std::byte{0x55}));
  EXPECT_FALSE(noise.receive(1).has_value());
  EXPECT_EQ(UsbHost{port_}.list(), 1u);
}

TEST_F(UsbCameraFacade, AHostThatDoesNotReadHoldsUpNobody) {
  startCamera("driver = 'pattern'\nwidth = 640\nheight = 480\nframe_rate_hz = 100\n");
  UsbHost host{port_};
  ASSERT_EQ(host.import(), 0u);
  for (int i = 0; i < 1020; ++i) host.ask(kDepthEndpoint, 16'384);  // 16 MB that it never takes
  EXPECT_TRUE(log_->waitFor("more slowly than they come", 1));
  auto native = client();
  auto stream = native.subscribe("cam");
  ASSERT_TRUE(stream.ok());
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(stream->next(kSoon).ok());
  EXPECT_EQ(UsbHost{port_}.list(), 1u);
}

TEST_F(UsbCameraFacade, TheCameraIsUnpluggedWhileItsSourceIsLost) {
  startCamera(kPattern + "[[source.fault]]\nkind = 'disconnect'\nfirst = 3\noutage_s = 0.5\n");
  UsbHost host{port_};
  ASSERT_EQ(host.import(), 0u);
  Images images{host, kDepthEndpoint, 16'384};
  int seen = 0;
  while (images.next()) ++seen;
  EXPECT_LE(seen, 3);
  EXPECT_GE(seen, 1);
  EXPECT_TRUE(eventually([&] { return UsbHost{port_}.list() == 0; }));
  EXPECT_EQ(UsbHost{port_}.import(), 4u) << "no device";
  EXPECT_TRUE(eventually([&] { return UsbHost{port_}.import() == 0; }));
}

}  // namespace
}  // namespace toftwin::daemon
