// SPDX-License-Identifier: Apache-2.0
// The daemon's life: listening, reloading, systemd.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>

#include "running_daemon.h"

namespace toftwin::daemon {
namespace {

using namespace std::chrono_literals;
using namespace test;
using testing::HasSubstr;
using Policy = SubscribeOptions::Policy;

TEST_F(RunningDaemon, AReloadKeepsWhatIsAsBeforeAndChangesTheRest) {
  const std::string other =
      "[[source]]\nname = 'other'\ndriver = 'pattern'\npace = 'trigger'\nwidth = ";
  start(kTriggered + other + "32\n");
  auto client = this->client();
  auto kept = client.subscribe("cam", {.policy = Policy::Queue, .queue = 8});
  auto changed = client.subscribe("other", {.policy = Policy::Queue, .queue = 8});
  ASSERT_TRUE(client.trigger("cam").ok());
  ASSERT_TRUE(kept->next(kSoon).ok());
  configure("# moved\n" + other + "64\n" + kTriggered +
            "[[source]]\nname = 'new'\ndriver = 'pattern'\n");
  daemon_->reload();
  const auto end = changed->next(kSoon);
  ASSERT_FALSE(end.ok());
  EXPECT_EQ(end.error().code, Error::Code::Stopped);
  ASSERT_TRUE(eventually([&] { return client.sources()->size() == 3; }));
  EXPECT_EQ(client.describe("other")->camera.width, 64);
  ASSERT_TRUE(client.trigger("cam").ok());
  EXPECT_EQ(kept->next(kSoon)->sequence, 1u) << "the source that was kept began anew";
}

TEST_F(RunningDaemon, AReloadOfAWrongFileChangesNothing) {
  start(kTriggered);
  auto client = this->client();
  configure("[[source]]\nname = 'cam'\ndriver = 'pattern'\nwidth = 1\n");
  daemon_->reload();
  ASSERT_TRUE(log_->waitFor("toftwind.toml:4: width = 1 is out of bounds", 1));
  EXPECT_EQ(client.describe("cam")->camera.width, 32);
  configure(kTriggered + "[[source]]\nname = 'new'\ndriver = 'pattern'\n");
  daemon_->reload();
  ASSERT_TRUE(eventually([&] { return client.sources()->size() == 2; }));
  EXPECT_EQ(client.describe("cam")->camera.width, 32);
}

TEST_F(RunningDaemon, ASecondDaemonIsRefusedWithThePidOfTheFirst) {
  start(kTriggered);
  const auto second = Daemon::start(options());
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, Error::Code::Busy);
  EXPECT_THAT(second.error().message, HasSubstr("pid " + std::to_string(::getpid())));
  EXPECT_TRUE(client().health().ok()) << "the first was harmed";
}

TEST_F(RunningDaemon, APortInUseIsRefusedWithTheNameOfItsHolder) {
  start(kTriggered);
  Daemon::Options other = options();
  other.port = daemon_->port();
  other.socket = (folder_ / "other").string();
  const auto second = Daemon::start(other);
  ASSERT_FALSE(second.ok());
  EXPECT_THAT(second.error().message, HasSubstr("port " + std::to_string(daemon_->port())));
  EXPECT_THAT(second.error().message, HasSubstr("pid " + std::to_string(::getpid())));
  EXPECT_THAT(second.error().message, HasSubstr("--port"));
}

TEST_F(RunningDaemon, ASocketThatAKilledDaemonLeftIsReplaced) {
  configure(kTriggered);
  const transport::FileDescriptor left{::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string path = folder_ / "s";
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(left.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  start(options());
  EXPECT_TRUE(client().health().ok());
}

TEST_F(RunningDaemon, AFileInTheSocketsPlaceIsLeftAlone) {
  configure(kTriggered);
  std::ofstream{folder_ / "s"} << "precious";
  const auto refused = Daemon::start(options());
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("not a socket"));
  std::string content;
  std::ifstream{folder_ / "s"} >> content;
  EXPECT_EQ(content, "precious");
}

TEST_F(RunningDaemon, ASocketInAFolderThatIsNotThereIsNamed) {
  configure(kTriggered);
  Daemon::Options elsewhere = options();
  elsewhere.socket = (folder_ / "no" / "s").string();
  const auto refused = Daemon::start(elsewhere);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr((folder_ / "no" / "s").string()));
  EXPECT_THAT(refused.error().message, HasSubstr("--socket"));
}

TEST_F(RunningDaemon, AnAddressThatThisMachineLacksIsRefused) {
  configure("[listen]\naddress = '192.0.2.1'\nallow_remote = true\n");  // RFC 5737: nobody's
  const auto refused = Daemon::start(options());
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("does not have that address"));
}

/// systemd's end of NOTIFY_SOCKET.
class FakeSystemd {
 public:
  explicit FakeSystemd(const std::string& path)
      : fd_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    const timeval limit{30, 0};
    ::setsockopt(fd_.get(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
  }
  ~FakeSystemd() {
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) ::unsetenv(name);
  }
  std::string next() {
    std::array<char, 1024> text{};
    const ssize_t got = ::recv(fd_.get(), text.data(), text.size(), 0);
    return got > 0 ? std::string(text.data(), static_cast<std::size_t>(got)) : "nothing came";
  }
  bool isSilent() {
    char byte = 0;
    return ::recv(fd_.get(), &byte, 1, MSG_PEEK | MSG_DONTWAIT) < 0;
  }

 private:
  transport::FileDescriptor fd_;
};

TEST_F(RunningDaemon, TellsSystemdWhatItDoes) {
  FakeSystemd systemd{folder_ / "notify"};
  start(kTriggered);
  EXPECT_THAT(systemd.next(), HasSubstr("READY=1\n"));
  daemon_->reload();
  EXPECT_THAT(systemd.next(),
              testing::AllOf(HasSubstr("RELOADING=1\n"), HasSubstr("MONOTONIC_USEC=")));
  EXPECT_THAT(systemd.next(), HasSubstr("READY=1\n"));
  stop();
  EXPECT_EQ(systemd.next(), "STOPPING=1");
}

const std::shared_ptr<test::Remote>& stuckCamera() {
  static const auto remote = std::make_shared<test::Remote>();
  return remote;
}
constexpr drivers::Driver kStuckDriver{
    .name = "stuck",
    .summary = "a camera that never comes back",
    .list = [] { return std::vector<std::string>{}; },
    .open = [](settings::Table&) { return test::opener(stuckCamera())(); },
    .document = [] { return std::string{}; }};

TEST_F(RunningDaemon, FeedsTheWatchdogUnlessADriverIsStuck) {
  FakeSystemd systemd{folder_ / "notify"};
  ::setenv("WATCHDOG_USEC", "20000", 1);
  configure(
      "[limits]\nsource_stuck_s = 5\n[[source]]\nname = 'cam'\ndriver = 'stuck'\nstart = "
      "'always'\n");
  Daemon::Options watched = options();
  watched.clock = &clock_;
  watched.drivers = {&kStuckDriver, 1};
  start(watched);
  EXPECT_THAT(systemd.next(), HasSubstr("READY=1\n"));
  ASSERT_TRUE(stuckCamera()->asked.reaches(1));
  EXPECT_EQ(systemd.next(), "WATCHDOG=1");
  EXPECT_EQ(systemd.next(), "WATCHDOG=1");
  clock_.advance(6s);
  ASSERT_TRUE(log_->waitFor("source cam has been in one call of its driver", 1));
  while (!systemd.isSilent()) EXPECT_EQ(systemd.next(), "WATCHDOG=1");  // from before
  ASSERT_TRUE(log_->waitFor("source cam has been in one call of its driver", 3));
  EXPECT_TRUE(systemd.isSilent());
}

}  // namespace
}  // namespace toftwin::daemon
