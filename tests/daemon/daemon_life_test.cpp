// SPDX-License-Identifier: Apache-2.0
// The daemon's life: listening, reloading, systemd.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>

#include "daemon/facades/facades.h"
#include "daemon/server.h"
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

TEST_F(RunningDaemon, AFacadeThatThisBuildLacksIsToldInTheLog) {
  boost::asio::io_context io;
  Hub hub{Hub::Options{}, clock_};
  Facades facades{io, hub, clock_};
  facades.apply({{.keys = {.kind = "telegraph", .source = "cam", .allow = {}, .intervals = {}},
                  .unevenness = {},
                  .fingerprint = "",
                  .start = {},
                  .not_built = "d.toml:5: it was not built: install libmorse-dev"}});
  EXPECT_EQ(log_->count("facade telegraph of cam is not there: d.toml:5: it was not built: install libmorse-dev"),
            1);
  io.run();  // ends at once: nothing is tried again
  EXPECT_EQ(log_->count("telegraph"), 1);
}

TEST_F(RunningDaemon, ASecondSignalIsNotCaughtWhileItStops) {
  configure(kTriggered);
  auto with_signals = options();
  with_signals.handle_signals = true;
  start(with_signals);
  daemon_->stop();
  thread_.join();
  for (const int number : {SIGTERM, SIGINT}) {
    struct sigaction now {};
    ASSERT_EQ(::sigaction(number, nullptr, &now), 0);
    EXPECT_EQ(now.sa_handler, SIG_DFL) << number;
  }
  daemon_.reset();
}

/// A stream socket to a TCP port of this machine, not connected yet.
struct TcpSocket {
  transport::FileDescriptor fd{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  int connect(std::uint16_t port) const {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return ::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
  }
};
/// Connects without needing a file descriptor, which RawClient does.
int connectUnix(const transport::FileDescriptor& fd, const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  return ::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
}
/// Whether the daemon answers a Hello.
bool isServed(const transport::FileDescriptor& fd) {
  const auto hello = wire::toBytes(*wire::encode(wire::Hello{1, "test", {}}));
  timeval patience{.tv_sec = kSoon.count(), .tv_usec = 0};
  ::setsockopt(fd.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  char byte = 0;
  return ::send(fd.get(), hello.data(), hello.size(), MSG_NOSIGNAL) > 0 &&
         ::recv(fd.get(), &byte, 1, 0) == 1;
}

/// UBSan looks through a pipe at each type that it meets, and there is none when files ran out.
constexpr bool kSanitizerNeedsFiles =
#if defined(__SANITIZE_ADDRESS__)
    true;
#else
    false;
#endif

TEST_F(RunningDaemon, BothListenersGoOnWhenFilesRanOut) {
  if (kSanitizerNeedsFiles) GTEST_SKIP() << "the sanitizer itself needs files";
  start(kTriggered);
  const TcpSocket tcp;
  const transport::FileDescriptor local{::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  const int free = ::dup(local.get());
  ::close(free);
  const rlimit none{.rlim_cur = static_cast<rlim_t>(free), .rlim_max = before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &none), 0);
  EXPECT_EQ(tcp.connect(daemon_->port()), 0);
  EXPECT_EQ(connectUnix(local, daemon_->socketPath()), 0);
  // Each tries again after 100 ms: both have failed when there are more lines than one can write.
  const bool failed = log_->waitFor("cannot accept a client", 4);
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
  ASSERT_TRUE(failed);
  EXPECT_TRUE(isServed(tcp.fd));
  EXPECT_TRUE(isServed(local));
}

TEST_F(RunningDaemon, FramesComeInlineWhenFilesRanOut) {
  if (kSanitizerNeedsFiles) GTEST_SKIP() << "the sanitizer itself needs files";
  start("[[source]]\nname = 'cam'\ndriver = 'pattern'\npace = 'trigger'\nwidth = 160\n"
        "height = 120\n");  // large enough for shared memory
  auto client = this->client();
  auto stream = client.subscribe("cam", {.policy = Policy::Queue, .queue = 4});
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  const rlimit none{.rlim_cur = 0, .rlim_max = before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &none), 0);
  const bool is_triggered = client.trigger("cam").ok();
  const auto frame = stream->next(kSoon);
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
  ASSERT_TRUE(is_triggered);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  EXPECT_EQ(frame->sequence, 0u);
}

TEST_F(RunningDaemon, AClientWhoseAcceptIsQueuedWhenItShutsDownIsNotServed) {
  boost::asio::io_context io{1};
  Hub hub{{}, clock_};
  Server server{io, hub, {}};
  const std::string path = (folder_ / "s").string();
  ASSERT_TRUE(server.listenUnix(path).ok());
  const transport::FileDescriptor first{::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  const transport::FileDescriptor second{::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  ASSERT_EQ(connectUnix(first, path), 0);
  ASSERT_EQ(connectUnix(second, path), 0);
  io.run_one();  // takes the first, and the second at once, whose handler is queued
  bool is_done = false;
  server.shutDown({Error::Code::Stopped, "over"}, [&] { is_done = true; });
  ::shutdown(first.get(), SHUT_RDWR);
  io.run();
  EXPECT_TRUE(is_done);
  char byte = 0;
  EXPECT_EQ(::recv(second.get(), &byte, 1, 0), 0) << "it was served after the end";
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

TEST_F(RunningDaemon, AReloadOpensASourceAnewWhoseSceneOrItsMeshChanged) {
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream{folder_ / name} << text;
  };
  const std::string scene = "[[material]]\nname = 'm'\n[[object]]\nmaterial = 'm'\nmesh = 'o.obj'\n";
  write("scene.toml", scene);
  write("o.obj", "v -9 -9 2\nv 9 -9 2\nv 0 9 2\nf 1 2 3\n");
  const std::string camera = " driver = 'sim'\nsamples_per_pixel = 1\nmax_surfaces = 1\n";
  start("[[source]]\nname = 'seen'\nscene = 'scene.toml'\n" + camera +
        "[[source]]\nname = 'other'\n" + camera);
  EXPECT_EQ(log_->count("source seen: "), 1);
  int reloads = 0;
  const auto reload = [&] {
    daemon_->reload();
    return log_->waitFor("the new configuration is in force", ++reloads);
  };
  ASSERT_TRUE(reload());
  EXPECT_EQ(log_->count("source seen: "), 1) << "nothing changed";
  write("scene.toml", "# longer\n" + scene);
  ASSERT_TRUE(reload());
  EXPECT_EQ(log_->count("source seen: "), 2);
  write("o.obj", "v -9 -9 2.5\nv 9 -9 2\nv 0 9 2\nf 1 2 3\n");
  ASSERT_TRUE(reload());
  EXPECT_EQ(log_->count("source seen: "), 3);
  EXPECT_EQ(log_->count("source other: "), 1);
  write("o.obj", "this is no mesh\n");
  daemon_->reload();
  ASSERT_TRUE(log_->waitFor("stays as it was", 1));
  EXPECT_EQ(client().sources()->size(), 2u) << "the source runs on with what it has";
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
  configure("[listen]\naddress = '192.0.2.1'\nallow_remote = true\ninsecure = true\n");  // RFC 5737: nobody's
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
