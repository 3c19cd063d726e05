// SPDX-License-Identifier: Apache-2.0
// The emulated camera is lost in every way and comes back, while a subscriber stays.
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <charconv>
#include <functional>
#include <vector>

#include "drivers/o3d303/o3d303.h"
#include "emulated_o3d303.h"
#include "recovery_rig.h"

namespace toftwin::test {
namespace {

using std::chrono::milliseconds;

constexpr double kInterval_ms = 50.0;

struct Loss {
  const char* name;
  std::function<void(EmulatedO3d303&)> happen, end;
  // Long enough for the daemon to ask as rarely as it ever does; 0: nothing keeps it from
  // returning.
  milliseconds away{700};
};
void PrintTo(const Loss& loss, std::ostream* out) { *out << loss.name; }

class O3d303Recovery : public testing::TestWithParam<Loss> {};

TEST_P(O3d303Recovery, IsWithinASecondOfTheCamerasReturnWithTheGapCountedAndSettingsRestored) {
  EmulatedO3d303 camera;
  RecoveryRig rig{[uri = camera.uri()]() -> Result<std::unique_ptr<drivers::Source>> {
    auto table =
        settings::Table::parse(fmt::format("uri = '{}'\nexposure_us = 500", uri), "t.toml");
    return drivers::o3d303::row().open(*table);
  }};
  ASSERT_TRUE(rig.isSubscribed());
  const Result<> set =
      rig.command([](drivers::Source& source) { return source.setParameter("exposure_us", 321); });
  ASSERT_TRUE(set.ok()) << set.error().message;
  auto frame = rig.next();
  for (int i = 0; i < 100 && frame && frame->moment.exposures[0].duration != 321_us; ++i) {
    frame = rig.next();
  }
  ASSERT_TRUE(frame.has_value());

  const auto outcome = rig.loseAndFind(
      GetParam().name, GetParam().away, [&] { GetParam().happen(camera); },
      [&] { GetParam().end(camera); });
  ASSERT_TRUE(outcome.has_value());
  const auto& [last, first, took] = *outcome;
  EXPECT_LT(took, kBackWithin);
  EXPECT_EQ(first.sequence, last.sequence + 1) << "the subscription went on";
  EXPECT_FALSE(rig.host().health().last_error.empty()) << "the reason";
  const double gap_ms =
      static_cast<double>(first.moment.received.ns - last.moment.received.ns) * 1e-6;
  // An interval of rounding, and one because a frame may have come up to an interval late.
  EXPECT_NEAR(static_cast<double>(first.dropped_by_device + 1), gap_ms / kInterval_ms, 2.0);
  EXPECT_GT(first.moment.exposures[0].start, last.moment.exposures[0].start);
  EXPECT_EQ(first.moment.exposures[0].duration, 321_us);
}

INSTANTIATE_TEST_SUITE_P(
    Every, O3d303Recovery,
    testing::Values(
        Loss{"Unplugged", [](auto& c) { c.unplug(); }, [](auto& c) { c.plugIn(); }},
        Loss{"Rebooted", [](auto& c) { c.reboot(); }, [](auto& c) { c.plugIn(); }},
        Loss{"Replaced", [](auto& c) { c.reboot(true); }, [](auto& c) { c.plugIn(); }},
        Loss{"Hung", [](auto& c) { c.hang(); }, [](auto& c) { c.recover(); }},
        Loss{"LineDropped", [](auto& c) { c.dropLine(); }, [](auto&) {}, milliseconds{0}},
        Loss{"Corrupted", [](auto& c) { c.corrupt(1, true); }, [](auto&) {}, milliseconds{0}}),
    [](const auto& test) { return std::string{test.param.name}; });

/// A port of loopback whose SYNs nobody answers, as behind a cable that is out: its queue of connections is
/// full.
class SilentPort {
 public:
  explicit SilentPort(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(port);
    const auto* at = reinterpret_cast<const sockaddr*>(&address);
    const int listener = make();
    const int yes = 1;
    EXPECT_EQ(::setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes), 0);
    EXPECT_EQ(::bind(listener, at, sizeof address), 0);
    EXPECT_EQ(::listen(listener, 0), 0);
    constexpr int kLongest_ms = 200;
    for (bool is_answered = true; is_answered && sockets_.size() < 10;) {
      pollfd caller{make(), POLLOUT, 0};
      (void)::connect(caller.fd, at, sizeof address);
      is_answered = ::poll(&caller, 1, kLongest_ms) > 0;
    }
    EXPECT_LT(sockets_.size(), 10u) << "somebody answers";
  }
  ~SilentPort() {
    for (const int one : sockets_) ::close(one);
  }
  SilentPort(const SilentPort&) = delete;
  SilentPort& operator=(const SilentPort&) = delete;

 private:
  int make() {
    return sockets_.emplace_back(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  }
  std::vector<int> sockets_;
};

std::uint16_t portOf(const std::string& uri) {
  std::uint16_t port = 0;
  const char* end = uri.data() + uri.size();
  EXPECT_EQ(std::from_chars(uri.data() + uri.rfind(':') + 1, end, port).ptr, end);
  return port;
}

// What the kernel alone would take two minutes to tell.
TEST(O3d303Silence, ACameraThatAnswersNoSynsIsSaidToBeAwayAndIsTakenUpAgain) {
  EmulatedO3d303 camera;
  RecoveryRig rig{[uri = camera.uri()]() -> Result<std::unique_ptr<drivers::Source>> {
    auto table = settings::Table::parse(fmt::format("uri = '{}'", uri), "t.toml");
    return drivers::o3d303::row().open(*table);
  }};
  ASSERT_TRUE(rig.isSubscribed());
  ASSERT_TRUE(rig.next().has_value());
  camera.unplug();
  {
    const SilentPort silent{portOf(camera.uri())};
    for (int tried = 0; rig.host().health().last_error.find("took more than 300 ms") == std::string::npos;
         ++tried) {
      ASSERT_LT(tried, 3000) << rig.host().health().last_error;
      std::this_thread::sleep_for(milliseconds{10});
    }
    EXPECT_NE(rig.host().summary().problem.find("is the camera powered, its cable in"), std::string::npos)
        << rig.host().summary().problem;
    EXPECT_GT(rig.host().health().reconnects, 0u);
  }
  rig.drain();
  camera.plugIn();
  const auto back = rig.next();
  ASSERT_TRUE(back.has_value());
  EXPECT_FALSE(back->dropped_because.empty());
}

// Frames, unit vectors, identities and configurations, whichever is under way: the daemon opens the
// camera as often as it takes, and goes on when it talks sense again.
TEST(O3d303Garbled, AThousandDamagedMessagesKeepNobodyFromTheNextGoodFrame) {
  EmulatedO3d303 camera{{.schedule = FrameSchedule{milliseconds{2}}}};
  RecoveryRig rig{[uri = camera.uri()]() -> Result<std::unique_ptr<drivers::Source>> {
                    auto table = settings::Table::parse(fmt::format("uri = '{}'", uri), "t.toml");
                    return drivers::o3d303::row().open(*table);
                  },
                  {.first_retry = milliseconds{1}, .longest_retry = milliseconds{1}}};
  ASSERT_TRUE(rig.isSubscribed());
  ASSERT_TRUE(rig.next().has_value());
  camera.garble(1000);
  for (int i = 0; i < 60'000 && camera.toGarble() > 0; ++i) {
    std::this_thread::sleep_for(milliseconds{1});
    rig.drain();
  }
  ASSERT_EQ(camera.toGarble(), 0);
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(rig.next().has_value()) << i;
  const auto health = rig.host().health();
  fmt::print("opened again {} times, {} frames lost\n", health.reconnects,
             health.dropped_by_device);
  EXPECT_GT(health.reconnects, 10u);
}

}  // namespace
}  // namespace toftwin::test
