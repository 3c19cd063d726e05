// SPDX-License-Identifier: Apache-2.0
// Clients and hosts over TCP whose machine or cable is gone, in a network of the test's own that goes down.
#include <gtest/gtest.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/wait.h>

#include <atomic>
#include <boost/asio/post.hpp>
#include <fstream>

#include "daemon/facades/usb_camera/server.h"
#include "daemon/server.h"
#include "facades/usb_host.h"
#include "running_daemon.h"

namespace toftwin::daemon {
namespace {

using namespace std::chrono_literals;
using namespace test;
using Policy = SubscribeOptions::Policy;

constexpr int kImpossibleHere = 77;

/// Enters a network namespace; whoever may not, in a user namespace in which they are root.
bool enterNetwork() {
  const auto uid = ::geteuid();
  if (::unshare(CLONE_NEWNET) == 0) return true;
  if (::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
  std::ofstream{"/proc/self/uid_map"} << "0 " << uid << " 1";
  return true;
}

/// Whether everything that is sent arrives, or nothing does.
bool setLoopback(bool is_up) {
  const transport::FileDescriptor any{::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)};
  ifreq request{};
  std::string{"lo"}.copy(request.ifr_name, IFNAMSIZ - 1);
  if (::ioctl(any.get(), SIOCGIFFLAGS, &request) != 0) return false;
  const int flags = is_up ? request.ifr_flags | IFF_UP : request.ifr_flags & ~IFF_UP;
  request.ifr_flags = static_cast<short>(flags);
  return ::ioctl(any.get(), SIOCSIFFLAGS, &request) == 0;
}

/// A daemon's server with one camera, whose patience is a second for some and far longer for others.
struct Served {
  FakeClock clock;
  std::shared_ptr<Remote> remote = std::make_shared<Remote>();
  boost::asio::io_context io{1};
  Hub hub{{}, clock};
  Server server;
  std::thread thread;

  explicit Served(const Connection::Options& options) : server(io, hub, {.connection = options}) {
    remote->info.camera.width = 4;
    const auto open = opener(remote);
    hub.add(std::make_shared<SourceHost>("cam", open, open(), SourceHost::Options{}, clock));
    EXPECT_TRUE(server.listenTcp("127.0.0.1", 0).ok());
    thread = std::thread{[this] { io.run(); }};
  }
  ~Served() {
    io.stop();
    thread.join();
  }
  Client client() {
    auto connected = Client::connect("tcp:127.0.0.1:" + std::to_string(server.port()));
    EXPECT_TRUE(connected.ok()) << connected.error().message;
    return *std::move(connected);
  }
};

constexpr Connection::Options kImpatient{.patience = 1000ms, .lockstep_patience = 100'000ms};
constexpr Connection::Options kImpatientInLockstep{.patience = 100'000ms, .lockstep_patience = 1000ms};

/// In a process with a network of its own: connects, takes a frame, cuts the line, perhaps lets a frame be
/// sent into the void, and waits until the daemon notices.
int vanish(const Connection::Options& options, Policy policy, bool is_sending) {
  const pid_t child = ::fork();
  if (child == 0) {
    if (!enterNetwork() || !setLoopback(true)) ::_exit(kImpossibleHere);
    Served served{options};
    auto client = served.client();
    auto stream = client.subscribe("cam", {.policy = policy});
    EXPECT_TRUE(stream.ok());
    served.remote->give();
    EXPECT_TRUE(stream->next(kSoon).ok());
    EXPECT_EQ(served.hub.sessions, 1u);
    EXPECT_TRUE(setLoopback(false));
    if (is_sending) served.remote->give();
    EXPECT_TRUE(eventually([&] { return served.hub.sessions == 0; })) << "it is still waited for";
    ::_exit(testing::Test::HasFailure() ? 1 : 0);
  }
  int status = 0;
  if (child < 0 || ::waitpid(child, &status, 0) != child || !WIFEXITED(status)) return -1;
  return WEXITSTATUS(status);
}

void expectNoticed(const Connection::Options& options, Policy policy, bool is_sending) {
  const int status = vanish(options, policy, is_sending);
  if (status == kImpossibleHere) GTEST_SKIP() << "this user may not make a network of their own";
  EXPECT_EQ(status, 0);
}

TEST(VanishedClient, IsNoticedWhileNothingIsSent) { expectNoticed(kImpatient, Policy::Latest, false); }

TEST(VanishedClient, IsNoticedWhileAFrameIsOnItsWay) { expectNoticed(kImpatient, Policy::Latest, true); }

TEST(VanishedClient, IsNoticedSoonerWhereASourceWaitsForIt) {
  expectNoticed(kImpatientInLockstep, Policy::Lockstep, false);
}

/// Nothing but a stream that has something to say once `has_bytes`.
class Stub final : public usb_camera::UsbDevice {
 public:
  [[nodiscard]] usb_camera::Bytes deviceDescriptor() const override { return usb_camera::Bytes(18); }
  [[nodiscard]] usb_camera::Bytes configurationDescriptor() const override { return usb_camera::Bytes(9); }
  [[nodiscard]] std::string text(int) const override { return {}; }
  usb_camera::Answer control(const usb_camera::Setup&, std::span<const std::byte>) override {
    return usb_camera::stall();
  }
  bool serve(usb_camera::Transfer& transfer, SteadyTime) override {
    if (has_bytes) transfer.data.resize(transfer.length);
    return has_bytes;
  }
  [[nodiscard]] SteadyTime due(std::uint8_t) const override { return SteadyTime::max(); }
  std::atomic<bool> has_bytes{false};
};

/// The line is cut while bytes are on their way, and comes back when the host's time is over.
void loseUsbHost() {
  namespace asio = boost::asio;
  constexpr std::chrono::milliseconds kPatience = 1000ms;
  asio::io_context io{1};
  asio::ip::tcp::acceptor acceptor{io, {asio::ip::address_v4::loopback(), 0}};
  Stub device;
  usb_camera::Server server{std::move(acceptor), "test", kPatience};
  server.plug(device);
  std::thread thread{[&io] { io.run(); }};
  UsbHost host{server.port()};
  EXPECT_EQ(host.import(), 0u);
  host.ask(1, 512);
  EXPECT_EQ(UsbHost{server.port()}.import(), 2u) << "busy; what was asked for has arrived";
  EXPECT_TRUE(setLoopback(false));
  asio::post(io, [&] {
    device.has_bytes = true;
    server.pump();
  });
  std::this_thread::sleep_for(4 * kPatience);
  EXPECT_TRUE(setLoopback(true));
  EXPECT_EQ(UsbHost{server.port()}.import(), 0u) << "the device is free again";
  io.stop();
  thread.join();
}

TEST(VanishedUsbHost, GivesTheCameraBackWhileAnImageIsOnItsWay) {
  const pid_t child = ::fork();
  if (child == 0) {
    if (!enterNetwork() || !setLoopback(true)) ::_exit(kImpossibleHere);
    loseUsbHost();
    ::_exit(testing::Test::HasFailure() ? 1 : 0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == kImpossibleHere) GTEST_SKIP() << "this user may not make a network of their own";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace toftwin::daemon
