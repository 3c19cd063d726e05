// SPDX-License-Identifier: Apache-2.0
// One truth: the same frame, read natively and through each facade by an unmodified client.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "drivers/o3d303/wire/confidence.h"
#include "drivers/sim/simulator.h"
#include "facade_testing.h"
#include "protocol/record/recording.h"

namespace toftwin::daemon {
namespace {

using namespace test;
using Policy = SubscribeOptions::Policy;

/// What docs/facades/o3d303.md says becomes of a pixel, and what the driver makes of that.
struct Converted {
  float range_m, amplitude;
  unsigned flags;
};
Converted convert(float range_m, float amplitude, unsigned flags, double electrons_per_count) {
  const double mm = std::round(1000.0 * static_cast<double>(range_m));
  const bool has_range = mm >= 1.0 && mm <= 65'535.0 && (flags & 1U) == 0;
  const double counts = std::min(65'535.0, std::round(static_cast<double>(amplitude) / electrons_per_count));
  const unsigned kept = o3d303::flagsOf(o3d303::confidenceOf(static_cast<std::uint8_t>(flags)));
  return {has_range ? static_cast<float>(mm) * 1e-3F : std::nanf(""),
          std::isnan(amplitude) ? 0.0F : static_cast<float>(counts), has_range ? kept : kept | 1U};
}

void expectSame(const Frame& native, const Frame& through, double electrons_per_count) {
  const auto range_m = native.find(PlaneKind::Range)->as<float>();
  const auto amplitude = native.find(PlaneKind::Amplitude)->as<float>();
  const auto flags = native.find(PlaneKind::Flags)->as<std::uint8_t>();
  const auto range_got = through.find(PlaneKind::Range)->as<float>();
  const auto depth_got = through.find(PlaneKind::Depth)->as<float>();
  const auto amplitude_got = through.find(PlaneKind::Amplitude)->as<float>();
  const auto flags_got = through.find(PlaneKind::Flags)->as<std::uint8_t>();
  ASSERT_EQ(range_got.size(), range_m.size());
  const Plane *exposure = native.find(PlaneKind::Exposure), *exposure_got = through.find(PlaneKind::Exposure);
  ASSERT_EQ(exposure_got == nullptr, exposure == nullptr);
  if (exposure != nullptr) {
    EXPECT_TRUE(std::ranges::equal(exposure_got->data.bytes(), exposure->data.bytes()));
  }
  std::size_t with_value = 0;
  for (std::size_t i = 0; i < range_m.size(); ++i) {
    const Converted expected = convert(range_m[i], amplitude[i], flags[i], electrons_per_count);
    ASSERT_EQ(flags_got[i], expected.flags) << i;
    ASSERT_EQ(amplitude_got[i], expected.amplitude) << i;
    ASSERT_EQ(std::isnan(range_got[i]), std::isnan(expected.range_m)) << i;
    if (std::isnan(expected.range_m)) continue;
    ++with_value;
    ASSERT_EQ(range_got[i], expected.range_m) << i;
    const auto u = static_cast<double>(i % static_cast<std::size_t>(native.camera.width));
    const auto v = static_cast<double>(i / static_cast<std::size_t>(native.camera.width));
    // The driver divides the ray's float z by the length of its float components, of which each errs by 6e-8.
    ASSERT_NEAR(depth_got[i], static_cast<double>(range_got[i]) * rayThroughPixel(native.camera, u, v).v.z,
                3e-7 * static_cast<double>(range_got[i]));
  }
  EXPECT_GT(with_value, range_m.size() / 2);
}

/// The camera says a frame's exposures from the shortest on, others in the order taken.
Duration longestOf(const Frame& frame) {
  return std::ranges::max_element(frame.moment.exposures, {}, &Exposure::duration)->duration;
}

class CrossDialect : public RunningFacade {
 protected:
  /// Five frames of the source, read natively and by our driver from the O3D303 facade before it.
  void expectOneTruth(const std::string& source, FrameKind kind) {
    auto native_client = client();
    Result<std::unique_ptr<drivers::Source>> driver = Error{};
    ASSERT_TRUE(eventually([&] { return (driver = openDriver()).ok(); })) << driver.error().message;
    EXPECT_EQ((*driver)->info().camera.width, 176);
    auto native_stream = native_client.subscribe(source, {.policy = Policy::Queue, .queue = 64});
    ASSERT_TRUE(native_stream.ok()) << native_stream.error().message;
    ASSERT_TRUE((*driver)->start().ok());
    Natives natives{*std::move(native_stream), deviceTimeOf};
    int compared = 0;
    for (int i = 0; i < 60 && compared < 5; ++i) {
      const auto through = nextFrame(**driver);
      ASSERT_TRUE(through.ok()) << through.error().message;
      const auto native = natives.at(deviceTimeOf(*through));
      ASSERT_TRUE(native.ok()) << native.error().message;
      if (*native == nullptr) continue;
      EXPECT_EQ((*native)->provenance.kind, kind);
      ASSERT_NO_FATAL_FAILURE(expectSame(**native, *through, electrons_per_count_));
      EXPECT_EQ(longestOf(*through), longestOf(**native));
      ++compared;
    }
    EXPECT_EQ(compared, 5);
    (*driver)->stop();
  }

  void expectPlcsRanges(const std::string& source_keys,
                        const std::function<std::vector<float>(const Frame&)>& rangesOf);

  double electrons_per_count_ = 6.0;  // the facade's default
};

TEST_F(CrossDialect, TheO3d303sFramesAreTheNativeOnesBitForBitWithTheirTimeStamps) {
  startO3d303(kSmallSim);
  expectOneTruth("cam", FrameKind::Simulated);
}

/// Of two, which exposure a pixel is of comes back from the confidence.
TEST_F(CrossDialect, SoAreThoseOfSeveralExposures) {
  startO3d303(kSmallSim);
  auto native = client();
  ASSERT_TRUE(native.setParameter("cam", "exposures", 2.0).ok());
  ASSERT_TRUE(native.setParameter("cam", "exposure_us", 5000.0).ok());
  // The nearest surfaces fill so small a well.
  ASSERT_TRUE(native.setParameter("cam", "saturation.full_well_electrons", 25000.0).ok());
  auto stream = native.subscribe("cam");
  ASSERT_TRUE(stream.ok()) << stream.error().message;
  const auto frame = stream->next(kSoon);
  ASSERT_TRUE(frame.ok() && frame->find(PlaneKind::Exposure) != nullptr);
  const auto numbers = frame->find(PlaneKind::Exposure)->as<std::uint8_t>();
  EXPECT_TRUE(std::ranges::count(numbers, 0) > 0 && std::ranges::count(numbers, 1) > 0)
      << "the test sees both";
  expectOneTruth("cam", FrameKind::Simulated);
}

TEST_F(CrossDialect, SoAreThoseOfARecording) {
  auto recorded = record::Writer::create(folder_ / "run.mcap");
  ASSERT_TRUE(recorded.ok()) << recorded.error().message;
  auto keys = settings::Table::parse(
      "uri = 'sim:o3d303_binned'\nsamples_per_pixel = 1\nmax_surfaces = 1\nframe_interval_ms = 50\n"
      "pace = 'fast'",
      "sim.toml");
  auto camera = drivers::simulator::row().open(*keys);
  ASSERT_TRUE(camera.ok() && (*camera)->start().ok());
  for (int i = 0; i < 20; ++i) {
    Frame frame = *(*camera)->next({}, false);
    frame.source = "cam";
    frame.sequence = static_cast<std::uint64_t>(i);
    frame.moment.received.ns = 1'700'000'000'000'000'000 + i * 50'000'000;
    ASSERT_TRUE(recorded->write(frame).ok());
  }
  ASSERT_TRUE(recorded->close().ok());
  startO3d303("driver = 'replay'\nfile = 'run.mcap'\nloop = true\n");
  expectOneTruth("cam", FrameKind::Replayed);
}

/// The driver of a real camera, behind whose own facade there is one more.
TEST_F(CrossDialect, SoAreThoseOfACamerasDriver) {
  const std::uint16_t camera = freePort();
  xmlrpc_ = freePort();
  start(fmt::format(
      "[[source]]\nname = 'sim'\n{}\n[[facade]]\nkind = 'o3d303'\nsource = 'sim'\nxmlrpc_port = {}\n"
      "pcic_port = 0\ndiscoverable = false\ntiming = 'fast'\n"
      "[[source]]\nname = 'cam'\ndriver = 'o3d303'\nuri = 'o3d303:127.0.0.1:{}'\n"
      "[[facade]]\nkind = 'o3d303'\nsource = 'cam'\nxmlrpc_port = {}\npcic_port = 0\n"
      "discoverable = false\ntiming = 'fast'\nelectrons_per_count = 1.0\n",
      kSmallSim, camera, camera, xmlrpc_));
  electrons_per_count_ = 1.0;  // the source has counts already
  expectOneTruth("cam", FrameKind::Real);
}

/// Frames of the source as a PLC reads them; `rangesOf` makes ranges of what the source has.
void CrossDialect::expectPlcsRanges(const std::string& source_keys,
                                    const std::function<std::vector<float>(const Frame&)>& rangesOf) {
  const std::uint16_t port = freePort();
  start(
      fmt::format("[[source]]\nname = 'cam'\n{}pace = 'trigger'\n[[facade]]\nkind = 'modbus'\nsource = "
                  "'cam'\nport = {}\nleast_valid = 0.1\n",
                  source_keys, port));
  boost::asio::io_context io;
  boost::asio::ip::tcp::socket plc{io};
  plc.connect({boost::asio::ip::address_v4::loopback(), port});
  // Input registers: a word or, from 30 to 37, centre and nearest range, device time.
  const auto ask = [&](std::uint8_t first, std::uint8_t count) {
    const std::array<std::uint8_t, 12> request{0, 7, 0, 0, 0, 6, 1, 4, 0, first, 0, count};
    std::vector<std::uint8_t> answer(9U + 2U * count);
    boost::asio::write(plc, boost::asio::buffer(request));
    boost::asio::read(plc, boost::asio::buffer(answer));
    std::vector<std::uint32_t> numbers((count + 1U) / 2U);
    for (std::size_t i = 9; i < answer.size(); ++i)
      numbers[(i - 9) / 4] = numbers[(i - 9) / 4] << 8 | answer[i];
    return numbers;
  };
  ask(30, 8);  // now it is connected, and wants frames
  auto native = client();
  auto stream = native.subscribe("cam");
  ASSERT_TRUE(stream.ok()) << stream.error().message;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(native.trigger("cam").ok());
    const auto frame = stream->next(kSoon);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    const std::vector<float> range_m = rangesOf(*frame);
    const auto ns = static_cast<std::uint64_t>(frame->moment.exposures.at(0).start.ns);
    EXPECT_TRUE(
        eventually([&] { return ask(30, 8)[3] == ns % 1'000'000'000 && (ns == 0 || ask(30, 8)[0] != 0); }));
    const auto numbers = ask(30, 8);
    EXPECT_EQ(numbers[2], ns / 1'000'000'000);
    float nearest = std::nanf("");
    for (const float one : range_m) nearest = std::fmin(nearest, one);
    if (i == 0) continue;  // before the first frame the device time is 0, too
    const auto& [width, height] = std::pair{frame->camera.width, frame->camera.height};
    EXPECT_EQ(numbers[0], std::bit_cast<std::uint32_t>(
                              range_m[static_cast<std::size_t>(height / 2 * width + width / 2)]));
    EXPECT_EQ(numbers[1], std::bit_cast<std::uint32_t>(nearest));
    EXPECT_EQ(ask(1, 1)[0], 0U) << "an alarm";
  }
}

TEST_F(CrossDialect, ThePlcsRangesAreTheNativeFloatsWithTheirTimeStamp) {
  expectPlcsRanges(kSmallSim, [](const Frame& frame) {
    const auto range_m = frame.find(PlaneKind::Range)->as<float>();
    return std::vector<float>(range_m.begin(), range_m.end());
  });
}

TEST_F(CrossDialect, OfASourceThatHasDepthAloneTheyFollowFromThePixelsRay) {
  expectPlcsRanges(
      "driver = 'pattern'\nwidth = 64\nheight = 48\nplanes = ['depth']\n", [](const Frame& frame) {
        std::vector<float> range_m;
        for (const float depth_m : frame.find(PlaneKind::Depth)->as<float>()) {
          const auto i = static_cast<int>(range_m.size());
          const double z = rayThroughPixel(frame.camera, i % 64, i / 64).v.z;
          range_m.push_back(
              static_cast<float>(static_cast<double>(depth_m) / static_cast<double>(static_cast<float>(z))));
        }
        return range_m;
      });
}

}  // namespace
}  // namespace toftwin::daemon
