// SPDX-License-Identifier: Apache-2.0
// Packets of frames, and what goes wrong with packets on purpose.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <future>
#include <optional>
#include <random>
#include <set>
#include <thread>

#include "daemon/facades/event_thread.h"
#include "daemon/facades/gige_vision/gvsp.h"
#include "daemon/facades/gige_vision/sender.h"
#include "daemon/facades/gige_vision/struck_line.h"
#include "daemon/facades/line_faults.h"

namespace toftwin::daemon::gige_vision {
namespace {

Payload payloadOfSizes(const std::vector<std::size_t>& sizes, std::mt19937& random) {
  Payload payload;
  for (const std::size_t size : sizes) {
    payload.parts.push_back({.component = 4,
                             .data_type = 5,
                             .format = Pixel::kC16,
                             .width = 7,
                             .height = 9,
                             .x = 0,
                             .y = 0,
                             .offset = payload.bytes.size(),
                             .size = size});
    for (std::size_t i = 0; i < size; ++i) payload.bytes.push_back(static_cast<std::byte>(random() & 0xFFU));
  }
  return payload;
}

TEST(GigeVisionStream, PacketsHoldThePayloadWholeAndOnce) {
  constexpr unsigned kSeed = 71;
  std::mt19937 random{kSeed};
  for (const bool is_multipart : {false, true}) {
    for (const std::uint32_t packet_size : {576U, 1500U, 9000U}) {
      for (const std::size_t size :
           {std::size_t{1}, std::size_t{1463}, std::size_t{1464}, std::size_t{1465}, std::size_t{30'000}}) {
        const bool has_long_ids = is_multipart || size % 2 == 0;
        const Payload payload = payloadOfSizes(
            is_multipart ? std::vector{size, std::size_t{10}, size} : std::vector{size}, random);
        const Block block{
            {.id = 5, .packet_size = packet_size, .is_multipart = is_multipart, .has_long_ids = has_long_ids},
            payload};
        const std::size_t header = has_long_ids ? 20 : 8;
        Bytes got(payload.bytes.size());
        std::size_t filled = 0, next = 0;
        for (std::uint32_t i = 0; i < block.packets(); ++i) {
          const Bytes packet = block.packet(i);
          ASSERT_LE(packet.size() + 28, packet_size);
          const auto kind = numberAt(packet, 4, 1);
          EXPECT_EQ((kind & 0x80) != 0, has_long_ids);
          EXPECT_EQ(has_long_ids ? numberAt(packet, 16, 4) : numberAt(packet, 5, 3), i);
          EXPECT_EQ(has_long_ids ? numberAt(packet, 8, 8) : numberAt(packet, 2, 2), 5U);
          if (i == 0 || i + 1 == block.packets()) {
            EXPECT_EQ(kind & 0x7F, i == 0 ? 1U : 2U);
            continue;
          }
          EXPECT_EQ(kind & 0x7F, is_multipart ? 7U : 3U);
          const std::size_t begin = header + (is_multipart ? 8 : 0);
          const std::size_t at = is_multipart ? numberAt(packet, header + 2, 6) : next;
          ASSERT_LE(at + packet.size() - begin, got.size());
          std::copy(packet.begin() + static_cast<std::ptrdiff_t>(begin), packet.end(),
                    got.begin() + static_cast<std::ptrdiff_t>(at));
          filled += packet.size() - begin;
          next = at + packet.size() - begin;
        }
        EXPECT_EQ(filled, payload.bytes.size());
        EXPECT_EQ(got, payload.bytes) << "seed " << kSeed;
      }
    }
  }
}

/// A socket that takes a packet at every third try must lose, double and swap those alone that the log names:
/// with shares at which the three meet in one packet.
TEST(GigeVisionStream, AFullSocketLosesNoPacketBesideThePlan) {
  constexpr int kPackets = 2000;
  const auto log = std::filesystem::path{::testing::TempDir()} / fmt::format("struck_{}.csv", ::getpid());
  std::ofstream{log} << "of the last run\n";
  std::vector<std::uint64_t> got;
  std::map<std::string, std::set<std::uint64_t>> logged;
  {
    int tries = 0;
    StruckLine line{LineFaults{{.loss = 0.1, .duplicate = 0.4, .reorder = 0.4, .seed = 9}, "test", log}, 0_s,
                    [&](const Bytes& packet) {
                      if (++tries % 3 != 0) return false;
                      got.push_back(numberAt(packet, 0, 4));
                      return true;
                    }};
    std::ifstream heading{log};
    std::string first;
    EXPECT_TRUE(std::getline(heading, first));
    EXPECT_EQ(first, "packet,kind,what");  // anew, before anything is struck
    for (std::uint64_t i = 0; i < kPackets; ++i) {
      Bytes packet;
      append(packet, i, 4);
      line.take(packet, [&] { return std::to_string(i); });
      while (!line.flush()) {
      }
    }
    while (!line.finish()) {
    }
  }
  std::ifstream lines{log};
  std::string one;
  std::getline(lines, one);
  while (std::getline(lines, one)) {
    const auto first = one.find(','), second = one.rfind(',');
    logged[one.substr(first + 1, second - first - 1)].insert(std::stoull(one));
  }
  std::map<std::uint64_t, int> times;
  std::set<std::uint64_t> overtaken;
  std::uint64_t last = 0;
  for (const std::uint64_t i : got) {
    ++times[i];
    if (i < last) overtaken.insert(i);
    last = std::max(last, i);
  }
  for (std::uint64_t i = 0; i < kPackets; ++i) {
    EXPECT_EQ(times[i], logged["loss"].contains(i) ? 0 : logged["duplicate"].contains(i) ? 2 : 1) << i;
  }
  EXPECT_EQ(overtaken, logged["reorder"]);
  EXPECT_GT(std::min({logged["loss"].size(), logged["duplicate"].size(), overtaken.size()}), 100u);
  std::filesystem::remove(log);
}

/// What is delayed leaves later and none sooner, what is corrupted has one bit changed, and the log names
/// each.
TEST(GigeVisionStream, APacketIsDelayedOrCorruptedOnPurpose) {
  using std::chrono::steady_clock;
  constexpr std::uint64_t kPackets = 400;
  const auto log = std::filesystem::path{::testing::TempDir()} / fmt::format("delayed_{}.csv", ::getpid());
  const LineShares shares{.delay = 0.2, .corruption = 0.2, .seed = 6};
  std::vector<steady_clock::time_point> taken;
  std::vector<std::pair<Bytes, steady_clock::time_point>> got;
  {
    StruckLine line{LineFaults{shares, "test", log}, 20_ms, [&](const Bytes& packet) {
                      got.emplace_back(packet, steady_clock::now());
                      return true;
                    }};
    for (std::uint64_t i = 0; i < kPackets; ++i) {
      taken.push_back(steady_clock::now());
      Bytes packet;
      for (int copy = 0; copy < 3; ++copy) append(packet, i, 8);
      line.take(std::move(packet), [&] { return std::to_string(i); });
      line.flush();
    }
    while (!line.finish()) ::usleep(100);
  }
  ASSERT_EQ(got.size(), kPackets);
  std::set<std::uint64_t> delayed, corrupted;
  for (const auto& [packet, at] : got) {
    const std::array copies{numberAt(packet, 0, 8), numberAt(packet, 8, 8), numberAt(packet, 16, 8)};
    const std::uint64_t number = (copies[0] & copies[1]) | (copies[1] & copies[2]) | (copies[0] & copies[2]);
    int changed = 0;
    for (const std::uint64_t copy : copies) changed += std::popcount(copy ^ number);
    const auto fate = LineFaults::fateOf(shares, number);
    EXPECT_EQ(changed, fate.is_corrupted ? 1 : 0) << number;
    if (fate.is_corrupted) corrupted.insert(number);
    if (!fate.is_delayed) continue;
    delayed.insert(number);
    EXPECT_GE(at - taken[number], std::chrono::milliseconds{20}) << number;
  }
  std::map<std::string, std::set<std::uint64_t>> logged;
  std::ifstream lines{log};
  std::string one;
  std::getline(lines, one);
  while (std::getline(lines, one))
    logged[one.substr(one.find(',') + 1, one.rfind(',') - one.find(',') - 1)].insert(std::stoull(one));
  EXPECT_EQ(logged["delay"], delayed);
  EXPECT_EQ(logged["corruption"], corrupted);
  EXPECT_GT(std::min(delayed.size(), corrupted.size()), 40u);
  std::filesystem::remove(log);
}

TEST(GigeVisionStream, APausesLengthSpreadsABlockOverHalfTheTimeBetweenTwoAndTenMillisecondsAtMost) {
  using std::chrono::milliseconds, std::chrono::microseconds;
  EXPECT_EQ(pauseBetween(100, microseconds{10}, milliseconds{100}), microseconds{100});
  EXPECT_EQ(pauseBetween(100, microseconds{10}, milliseconds{10}), microseconds{50});
  EXPECT_EQ(pauseBetween(2000, microseconds{10}, milliseconds{33}), microseconds{10});  // as was set
}

TEST(GigeVisionStream, TheTimeBetweenBlocksIsThatOfMostOfThem) {
  using std::chrono::milliseconds;
  BlockInterval interval;
  EXPECT_GE(interval.median(), milliseconds{20}) << "nothing is known yet";
  std::chrono::steady_clock::time_point now{};
  interval.note(now);
  for (const int ms : {50, 50, 100, 0, 50}) {  // the fourth came late, and the fifth with it
    interval.note(now += milliseconds{ms});
    EXPECT_EQ(interval.median(), milliseconds{50});
  }
  for (int i = 0; i < 3; ++i) interval.note(now += milliseconds{5});
  EXPECT_EQ(interval.median(), milliseconds{5}) << "another rate counts from its third frame on";
}

/// 208 kB is room for 92 packets of 1500 bytes and for 12 of 9000 as loopback was seen to deliver them.
TEST(GigeVisionStream, AtOnceGoesAThirdOfWhatAClientsSocketHasRoomFor) {
  EXPECT_EQ(packetsAtOnce(576), 55);
  EXPECT_EQ(packetsAtOnce(1500), 30);
  EXPECT_EQ(packetsAtOnce(9000), 4);
  EXPECT_EQ(packetsAtOnce(16'112), 2);
}

/// A socket that tells when the kernel got each datagram.
class StampedSocket {
 public:
  StampedSocket() {
    socket.set_option(boost::asio::socket_base::receive_buffer_size{1 << 20});
    const int on = 1;
    ::setsockopt(socket.native_handle(), SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
    // The kernel begins to stamp some time later; what came before has the time when it was read.
    for (bool is_stamped = false; !is_stamped;) {
      socket.send_to(boost::asio::buffer("x"), socket.local_endpoint());
      ::usleep(1000);
      timespec now{};
      ::clock_gettime(CLOCK_REALTIME, &now);
      is_stamped = next() < nanoseconds(now);
    }
  }
  /// In nanoseconds; nothing if none came for 10 s.
  std::optional<std::int64_t> next() {
    pollfd ready{socket.native_handle(), POLLIN, 0};
    alignas(cmsghdr) std::array<char, 64> control{};
    msghdr message{};
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    if (::poll(&ready, 1, 10'000) != 1 || ::recvmsg(socket.native_handle(), &message, 0) < 0) return {};
    timespec at{};
    std::memcpy(&at, CMSG_DATA(CMSG_FIRSTHDR(&message)), sizeof at);
    return nanoseconds(at);
  }
  boost::asio::io_context io;
  boost::asio::ip::udp::socket socket{io, {boost::asio::ip::address_v4::loopback(), 0}};

 private:
  static std::int64_t nanoseconds(const timespec& at) {
    return std::int64_t{at.tv_sec} * 1'000'000'000 + at.tv_nsec;
  }
};

/// Of as many blocks that come together. The bound holds however late the computer lets the sender come: what
/// leaves in one go is bounded, and where that is interrupted, once more after it; beside those goes one
/// packet per pause.
class GigeVisionPace : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Blocks, GigeVisionPace, testing::Values(1, 3));
TEST_P(GigeVisionPace, NoMillisecondOverrunsAClientsSocket) {
  StampedSocket client;
  std::mt19937 random{1};
  const Payload payload = payloadOfSizes({176 * 132 * 2, 176 * 132 * 2, 176 * 132 * 2}, random);
  for (const std::uint32_t size : {1500U, 9000U}) {
    Sender sender{client.io,
                  boost::asio::ip::udp::socket{client.io, {boost::asio::ip::address_v4::loopback(), 0}},
                  LineFaults{{}, "test", {}},
                  0_s,
                  0,
                  "test"};
    sender.aim(client.socket.local_endpoint(), size, std::chrono::microseconds{10});
    const auto block = std::make_shared<const Block>(
        Block::Header{.packet_size = size, .is_multipart = true, .has_long_ids = true}, payload);
    for (int i = 0; i < 2; ++i) {  // that it knows how often they come
      ASSERT_TRUE(sender.send(block));
      client.io.restart();
      client.io.run();
      ::usleep(50'000);
    }
    for (std::uint32_t i = 0; i < 2 * block->packets(); ++i) ASSERT_TRUE(client.next());
    for (int i = 0; i < GetParam(); ++i) ASSERT_TRUE(sender.send(block));
    client.io.restart();
    client.io.run();
    std::vector<std::int64_t> times;
    while (times.size() < static_cast<std::size_t>(GetParam()) * block->packets()) {
      const auto at = client.next();
      ASSERT_TRUE(at) << "after " << times.size() << " packets";
      times.push_back(*at);
    }
    const std::int64_t window_ns = 1'000'000, pause_ns = 10'000'000 / block->packets();
    std::ptrdiff_t most = 0;
    for (auto first = times.begin(); first != times.end(); ++first)
      most = std::max(most, std::upper_bound(first, times.end(), *first + window_ns) - first);
    EXPECT_LE(most, 2 * (packetsAtOnce(size) + 1) + window_ns / pause_ns + 1) << size;
  }
}

TEST(EventThread, ThatIsUrgentRunsBeforeOthersWhereItMay) {
  const auto ownNice = [] { return ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid())); };
  int allowed = 0, urgent = 0, usual = 0;
  std::thread{[&] {
    static_cast<void>(::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), -10));
    allowed = ownNice();
  }}.join();
  for (const bool is_urgent : {false, true}) {
    EventThread thread{"test"};
    std::promise<int> nice;
    thread.door()->post([&] { nice.set_value(ownNice()); });
    is_urgent ? thread.startUrgent() : thread.start();
    (is_urgent ? urgent : usual) = nice.get_future().get();
  }
  EXPECT_EQ(urgent, allowed) << "-10, as root";
  EXPECT_EQ(usual, ownNice());
}

TEST(GigeVisionStream, IdsOfSixteenBitsLeaveOutZero) {
  EXPECT_EQ(idAfter(65'534, 1, false), 65'535U);
  EXPECT_EQ(idAfter(65'535, 1, false), 1U);
  EXPECT_EQ(idAfter(65'535, 3, false), 3U);
  EXPECT_EQ(idAfter(65'535, 1, true), 65'536U);
}

TEST(LineFaults, StrikeAsManyAsWasSaidAndTheSameOnesForTheSameSeed) {
  LineShares keys{.loss = 0.02, .duplicate = 0.1, .reorder = 0.5, .seed = 3};
  constexpr int kPackets = 100'000;
  std::array<double, 3> struck{};
  for (std::uint64_t i = 0; i < kPackets; ++i) {
    const auto fate = LineFaults::fateOf(keys, i);
    EXPECT_EQ(fate, LineFaults::fateOf(keys, i));
    struck[0] += fate.is_lost ? 1 : 0;
    struck[1] += fate.is_doubled ? 1 : 0;
    struck[2] += fate.is_late ? 1 : 0;
  }
  const std::array share{keys.loss, keys.duplicate, keys.reorder};
  for (std::size_t i = 0; i < share.size(); ++i) {
    // Six standard deviations of a binomial: one false alarm in 10^9, and the seed is fixed.
    const double sd = std::sqrt(kPackets * share[i] * (1.0 - share[i]));
    EXPECT_NEAR(struck[i], kPackets * share[i], 6.0 * sd) << i;
  }
  LineShares other = keys;
  other.seed = 4;
  int different = 0;
  for (std::uint64_t i = 0; i < 1000; ++i)
    different += LineFaults::fateOf(keys, i) == LineFaults::fateOf(other, i) ? 0 : 1;
  EXPECT_GT(different, 400);  // half of them, by reorder alone
}

}  // namespace
}  // namespace toftwin::daemon::gige_vision
