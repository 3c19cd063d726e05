// SPDX-License-Identifier: Apache-2.0
// What the clients of the O3D303 facade see of the line's faults.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "facade_testing.h"
#include "o3d303_client.h"

// Behind the client, whose o3d303 is the wire's.
#include "daemon/facades/ifm/pcic_server.h"
#include "drivers/o3d303/wire/frame_writer.h"

namespace toftwin::daemon {
namespace {

using namespace std::chrono_literals;
using namespace test;

class O3d303Line : public RunningFacade {
 protected:
  O3d303Client camera() { return O3d303Client{xmlrpc_}; }
};

/// Of each kind of fault in a line's log: which frames it struck.
std::map<std::string, std::set<std::uint32_t>> framesOf(const std::filesystem::path& log) {
  std::map<std::string, std::set<std::uint32_t>> frames;
  std::ifstream lines{log};
  std::string text;
  for (std::getline(lines, text); std::getline(lines, text);) {
    const auto first = text.find(','), second = text.rfind(',');
    frames[text.substr(first + 1, second - first - 1)].insert(
        static_cast<std::uint32_t>(std::stoul(text.substr(second + 7))));
  }
  return frames;
}

/// All that a client of the vendor's sees of the line's faults is what the log says.
TEST_F(O3d303Line, ItsLineLosesAndDoublesTheFramesOfTheLog) {
  startO3d303(kPattern,
              "[facade.line]\nloss = 0.2\nduplicate = 0.2\nreorder = 0.2\nseed = 3\nlog = 'line.csv'");
  PcicClient one{camera().pcicPort()};
  EXPECT_EQ(one.setSchema({toftwin::o3d303::kDistanceBlob}), "*");
  std::vector<std::uint32_t> came;
  while (came.size() < 100) came.push_back(one.frame().chunks.at(0).header.frame_count);
  auto logged = framesOf(folder_ / "line.csv");
  // The ends are left out: what is there may have its twin beyond them.
  for (std::uint32_t i = came.front() + 3; i < came.at(90); ++i) {
    const auto times = std::ranges::count(came, i);
    EXPECT_EQ(times, logged["loss"].contains(i) ? 0 : logged["duplicate"].contains(i) ? 2 : 1) << i;
    const auto first = std::ranges::find(came, i);
    const bool is_overtaken =
        std::any_of(came.begin(), first, [i](std::uint32_t other) { return other > i; });
    EXPECT_TRUE(first == came.end() || is_overtaken == logged["reorder"].contains(i)) << i;
  }
  EXPECT_GT(logged["loss"].size(), 5u);
  EXPECT_GT(logged["reorder"].size(), 5u);
}

TEST_F(O3d303Line, ACutLineEndsTheConnectionInTheMiddleOfAMessage) {
  startO3d303(kPattern, "[facade.line]\ndisconnect = 0.1\nseed = 2\nlog = 'line.csv'");
  PcicClient one{camera().pcicPort()};
  EXPECT_TRUE(one.isClosedByPeer());
  EXPECT_TRUE(one.isWithinMessage());
  const auto logged = framesOf(folder_ / "line.csv");
  ASSERT_EQ(logged.size(), 1u) << "disconnect, and nothing else";
  const std::uint32_t cut = *logged.at("disconnect").begin();
  while (one.framesSoFar() > 0)
    EXPECT_LT(one.frame().chunks.at(0).header.frame_count, cut) << "what came before is whole";
  PcicClient again{camera().pcicPort()};  // and the camera is there as before
  EXPECT_EQ(again.command("V?"), "03 01 04");
}

/// The seed is one whose first bits are all within the images, so that messages stay messages.
TEST_F(O3d303Line, ACorruptMessageHasOneBitWrong) {
  startO3d303(kPattern, "[facade.line]\ncorruption = 1.0\nseed = 1");
  PcicClient one{camera().pcicPort()};
  EXPECT_EQ(one.setSchema({toftwin::o3d303::kUnitVectorsBlob}), "*");
  constexpr std::size_t kImageAt = 4 + 48, kImageSize = std::size_t{64} * 48 * 12;
  const std::string first = one.nextOf("0000").substr(kImageAt, kImageSize),
                    second = one.nextOf("0000").substr(kImageAt, kImageSize);
  int bits = 0;
  for (std::size_t i = 0; i < kImageSize; ++i)
    bits += std::popcount(static_cast<unsigned char>(first.at(i) ^ second.at(i)));
  EXPECT_EQ(bits, 2) << "unit vectors are the same in each frame, and each has a wrong bit of its own";
}

/// Frames fill all buffers between the two before the line is cut.
TEST(PcicServer, ACutConnectionEndsThoughItsClientReadsNothing) {
  using boost::asio::ip::tcp;
  boost::asio::io_context io;
  std::size_t connections = 0;
  ifm::PcicServer server{
      tcp::acceptor{io, {boost::asio::ip::address_v4::loopback(), 0}},
      {.trigger = {},
       .default_schema = [] { return toftwin::o3d303::schemaOf({toftwin::o3d303::kDistanceBlob}); },
       .ask = [](std::string_view) { return std::string{}; },
       .connections = [&](std::size_t count) { connections = count; }}};
  PcicClient reads_nothing{server.port()};
  while (connections == 0) ASSERT_EQ(io.run_one_for(kSoon), 1u);
  const std::vector<std::uint16_t> pixels(1024 * 1024, 1);
  toftwin::o3d303::CameraFrame frame;
  frame.width = frame.height = 1024;
  frame.distance_mm = pixels;
  const auto write = [&](const auto& schema) { return writeFrameContent(schema, frame); };
  for (int i = 0; i < 1000 && server.publish(write); ++i) io.poll();
  EXPECT_FALSE(server.publish(write)) << "2 MB each: it takes no more";
  EXPECT_TRUE(server.publish(write, {.noise = {}, .is_cut = true})) << "the half goes all the same";
  reads_nothing.sendBytes(toftwin::o3d303::textOf(toftwin::o3d303::encodePcic("1000", "V?")));
  const auto soon = std::chrono::steady_clock::now() + kSoon;
  while (connections > 0 && std::chrono::steady_clock::now() < soon) io.run_one_for(1s);
  EXPECT_EQ(connections, 0u);
}

}  // namespace
}  // namespace toftwin::daemon
