// SPDX-License-Identifier: Apache-2.0
// What one client or one log does to the daemon must hurt nobody else. All on this machine, bounded in number and time.
#include <gmock/gmock.h>
#include <grp.h>
#include <sys/resource.h>

#include <set>

#include "protocol/record/recording.h"
#include "running_daemon.h"
#include "toftwind_process.h"

namespace toftwin {
namespace {

using daemon::test::RawClient;
using test::Process;
using test::Toftwind;
using namespace std::chrono_literals;
using Policy = SubscribeOptions::Policy;
constexpr auto kSoon = test::kSoon;

const std::string kCamera = "[[source]]\nname = 'cam'\ndriver = 'pattern'\n";

class Attack : public Toftwind {
 protected:
  /// A client that has introduced itself as one of that minor version.
  std::unique_ptr<RawClient> greeted() {
    auto client = std::make_unique<RawClient>(path("s"));
    client->send(wire::Hello{1, "attacker", {}});
    EXPECT_TRUE(client->message().has_value());
    return client;
  }
  void serve(const std::string& keys) {
    configure("recording_folder = '.'\n" + keys);
    daemon_ = std::make_unique<Process>(arguments(), path("log"));
    ASSERT_TRUE(daemon_->says("source cam: driver pattern")) << daemon_->said();
  }
  std::unique_ptr<Process> daemon_;
};

wire::Subscribe wish(std::uint64_t id, wire::Policy policy, std::uint32_t window = 0) {
  wire::Subscribe request{.id = id, .source = "cam"};
  request.policy = policy;
  request.window = window;
  return request;
}

/// 100 frames a second of 0.2 MB for each of 16 streams: a second of them, counted apart, is more than the clients may hold.
TEST_F(Attack, AStalledClientOfSixteenLosslessStreamsTakesNoFrameFromARecording) {
  serve("[limits]\nbacklog_mb = 64\n" + kCamera + "width = 128\nheight = 106\nframe_rate_hz = 100\n");
  auto bystander = client();
  ASSERT_TRUE(bystander.ok());
  ASSERT_TRUE(bystander->startRecording("cam", "run").ok());
  const auto stalled = greeted();
  for (std::uint64_t id = 2; id < 18; ++id) stalled->send(wish(id, wire::Policy::Lossless, 1));
  auto stream = bystander->subscribe("cam", {.planes = {PlaneKind::Flags}, .policy = Policy::Queue, .queue = 500});
  ASSERT_TRUE(stream.ok()) << stream.error().message;
  std::uint64_t dropped = 0, seen = 0;
  for (int i = 0; i < 300; ++i) {
    const auto frame = stream->next(kSoon);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    dropped += frame->dropped_before, seen = frame->sequence;
  }
  EXPECT_EQ(dropped, 0u);
  const auto recorded = bystander->stopRecording("cam");
  ASSERT_TRUE(recorded.ok()) << recorded.error().message;
  auto reader = record::Reader::open(*recorded);
  ASSERT_TRUE(reader.ok());
  std::optional<std::uint64_t> last;
  for (auto frame = reader->next("cam"); frame.ok(); frame = reader->next("cam")) {
    if (last) {
      EXPECT_EQ(frame->sequence, *last + 1);
    }
    last = frame->sequence;
  }
  EXPECT_GE(last.value_or(0), seen);  // counted from 0
}

TEST_F(Attack, ALockstepThatIsNeverAcknowledgedLetsTheSourceGoOnForOthers) {
  serve("[limits]\nlockstep_s = 0.5\n" + kCamera + "width = 64\nheight = 48\n");
  auto bystander = client();
  auto stream = bystander->subscribe("cam", {.policy = Policy::Queue, .queue = 100});
  ASSERT_TRUE(stream->next(kSoon).ok());
  const auto holder = greeted();
  holder->send(wish(2, wire::Policy::Lockstep));
  for (int i = 0; i < 60; ++i) {
    const auto frame = stream->next(20s);
    ASSERT_TRUE(frame.ok()) << "frame " << i << ": " << frame.error().message;
  }
}

/// Bytes that are no message, by clients that come one after another.
void greetBadly(const std::string& path, int times) {
  for (int i = 0; i < times; ++i) {
    RawClient client{path};
    client.sendBytes(std::vector<std::byte>(64, std::byte{7}));
    while (client.receive(4096) > 0) continue;  // until it is closed
  }
}

/// The daemon's log is a pipe, of which the test has the other end and never reads.
class LogPipe {
 public:
  LogPipe() { EXPECT_EQ(::pipe2(ends_, O_CLOEXEC), 0); }
  ~LogPipe() { closeBoth(); }
  void becomeLog() const { ::dup2(ends_[1], 2); }
  void makeSmall() const { EXPECT_GT(::fcntl(ends_[1], F_SETPIPE_SZ, 4096), 0); }
  void closeBoth() {
    for (int& end : ends_) {
      if (end >= 0) ::close(std::exchange(end, -1));
    }
  }

 private:
  int ends_[2] = {-1, -1};
};

bool appears(const std::string& path) {
  for (int i = 0; i < 3000 && !std::filesystem::exists(path); ++i) std::this_thread::sleep_for(10ms);
  return std::filesystem::exists(path);
}

TEST_F(Attack, AFullLogPipeStopsNobody) {
  configure(kCamera);
  LogPipe log;
  log.makeSmall();
  Process daemon{arguments(), path("log"), [&] { log.becomeLog(); }};
  ASSERT_TRUE(appears(path("s")));
  std::atomic<bool> is_over = false;
  std::jthread attacker{[&] {
    greetBadly(path("s"), 478);
    is_over = true;
  }};
  const auto deadline = std::chrono::steady_clock::now() + 30s;
  while (!is_over && std::chrono::steady_clock::now() < deadline) std::this_thread::sleep_for(10ms);
  EXPECT_TRUE(is_over) << "frozen";
  auto bystander = Client::connect("unix:" + path("s"));
  EXPECT_TRUE(bystander.ok() && bystander->health().ok());
  daemon.signal(is_over ? SIGTERM : SIGKILL);  // which ends the attacker, too
  const int status = daemon.wait();
  EXPECT_TRUE(!is_over || status == 0) << "it stops although nobody reads its last lines: " << status;
}

TEST_F(Attack, AClosedLogPipeKillsNobody) {
  configure(kCamera);
  LogPipe log;
  Process daemon{arguments(), path("log"), [&] { log.becomeLog(); }};
  log.closeBoth();
  ASSERT_TRUE(appears(path("s")));
  greetBadly(path("s"), 5);
  auto bystander = client();
  ASSERT_TRUE(bystander.ok()) << bystander.error().message;
  EXPECT_TRUE(bystander->health().ok());
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
}

TEST_F(Attack, ClientsThatSayNothingAfterTheirHelloMakeRoomForOthers) {
  serve("[limits]\nidle_s = 1\n" + kCamera);
  std::vector<std::unique_ptr<RawClient>> silent;
  for (int i = 0; i < 64; ++i) {
    silent.push_back(std::make_unique<RawClient>(path("s")));
    silent.back()->send(wire::Hello{1, "attacker", {}});
  }
  const auto deadline = std::chrono::steady_clock::now() + 20s;
  auto bystander = client();
  while (!bystander && std::chrono::steady_clock::now() < deadline) bystander = client();
  ASSERT_TRUE(bystander.ok()) << bystander.error().message;
  std::this_thread::sleep_for(2s);  // twice what silent ones may be
  EXPECT_TRUE(bystander->health().ok()) << "a client that lives is not silent, whatever its application does";
}

TEST_F(Attack, ClientsThatSayNoHelloKeepNobodyOut) {
  serve("[limits]\nhandshake_s = 3600\n" + kCamera);
  std::vector<std::unique_ptr<RawClient>> silent;
  for (int i = 0; i < 64; ++i) silent.push_back(std::make_unique<RawClient>(path("s")));
  auto bystander = client();
  ASSERT_TRUE(bystander.ok()) << bystander.error().message;
  EXPECT_TRUE(bystander->health().ok());
}

/// In a process of another user, which only root can make: what the daemon answers to that user's wish to stop a recording.
std::optional<Error::Code> stoppedBy(uid_t user, const std::string& path) {
  const pid_t child = ::fork();
  if (child == 0) {
    if (::setgroups(0, nullptr) != 0 || ::setgid(user) != 0 || ::setuid(user) != 0) ::_exit(100);
    RawClient client{path};
    client.send(wire::Hello{1, "somebody else", {}});
    if (!client.message()) ::_exit(101);
    client.send(wire::Record{2, "cam", ""});
    const auto answer = client.message();
    const auto* failure = answer ? std::get_if<wire::Failure>(&*answer) : nullptr;
    ::_exit(failure == nullptr ? 102 : static_cast<int>(failure->error.code));
  }
  int status = 0;
  if (::waitpid(child, &status, 0) != child || !WIFEXITED(status) || WEXITSTATUS(status) >= 100) return std::nullopt;
  return static_cast<Error::Code>(WEXITSTATUS(status));
}

TEST_F(Attack, AnotherUserStopsNobodysRecording) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can be somebody else";
  serve(kCamera + "width = 64\nheight = 48\n");
  std::filesystem::permissions(folder_, std::filesystem::perms{0755});
  if (!test::othersMayEnter(folder_)) GTEST_SKIP() << "no folder here that another user may enter";
  auto owner = client();
  ASSERT_TRUE(owner->startRecording("cam", "run").ok());
  EXPECT_EQ(stoppedBy(65534, path("s")), Error::Code::PermissionDenied);
  EXPECT_EQ(owner->health()->sources.at(0).recording_by.find("user 0"), 0u);
  EXPECT_TRUE(owner->stopRecording("cam").ok());
}

}  // namespace
}  // namespace toftwin
