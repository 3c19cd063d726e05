// SPDX-License-Identifier: Apache-2.0
// The whole daemon in this process, with real clients on its sockets and the pattern as camera.
#include "daemon/daemon.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <fstream>
#include <mutex>
#include <optional>
#include <thread>

#include <toftwin/client.h>

#include "drivers/pattern/pattern.h"
#include "fakes.h"
#include "protocol/record/recording.h"
#include "protocol/transport/memfd.h"

namespace toftwin::daemon {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using Policy = SubscribeOptions::Policy;

constexpr auto kSoon = 30s;  // only a broken daemon needs that long

/// Keeps what the daemon logs.
class Log final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  test::Counter lines;
  int count(const std::string& part) {
    const std::scoped_lock lock{mutex_};
    return static_cast<int>(std::ranges::count_if(
        texts_, [&](const std::string& text) { return text.find(part) != std::string::npos; }));
  }
  /// Waits until so many lines with that part were logged.
  bool waitFor(const std::string& part, int wanted) {
    for (int seen = lines.count(); count(part) < wanted; seen = lines.count()) {
      if (!lines.reaches(seen + 1)) return false;
    }
    return true;
  }

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    texts_.emplace_back(message.payload.begin(), message.payload.end());
    lines.add();
  }
  void flush_() override {}
  std::vector<std::string> texts_;
};

/// A folder of its own for a test, and a daemon in it.
class RunningDaemon : public testing::Test {
 protected:
  void SetUp() override {
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("test", log_));
    std::string pattern = testing::TempDir() + "toftwindXXXXXX";
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override {
    stop();
    std::filesystem::remove_all(folder_);
  }

  void configure(const std::string& toml) { std::ofstream{folder_ / "toftwind.toml"} << toml; }
  [[nodiscard]] Daemon::Options options() const {
    return {.config = folder_ / "toftwind.toml", .port = 0, .socket = (folder_ / "s").string()};
  }
  void start(const std::string& sources) {
    configure("recording_folder = 'recordings'\n" + sources);
    start(options());
  }
  void start(Daemon::Options options) {
    auto started = Daemon::start(std::move(options));
    ASSERT_TRUE(started.ok()) << started.error().message;
    daemon_ = *std::move(started);
    thread_ = std::thread{[this] { daemon_->run(); }};
  }
  void stop() {
    if (!daemon_) return;
    daemon_->stop();
    thread_.join();
    daemon_.reset();
  }
  Client client(bool over_tcp = false) {
    auto connected = Client::connect(over_tcp ? "tcp:127.0.0.1:" + std::to_string(daemon_->port())
                                              : "unix:" + daemon_->socketPath());
    EXPECT_TRUE(connected.ok()) << connected.error().message;
    return *std::move(connected);
  }

  test::FakeClock clock_;  // for the test that wants it; outlives the daemon
  std::shared_ptr<Log> log_ = std::make_shared<Log>();  // shared with spdlog
  std::filesystem::path folder_;
  std::unique_ptr<Daemon> daemon_;
  std::thread thread_;
};

const std::string kTriggered = "[[source]]\nname = 'cam'\ndriver = 'pattern'\npace = 'trigger'\n"
                               "width = 32\nheight = 16\n";
const std::string kFast = "[[source]]\nname = 'cam'\ndriver = 'pattern'\npace = 'fast'\n"
                          "width = 32\nheight = 16\n";

/// Waits until `holds`; for what other threads do without telling.
template <class Condition>
testing::AssertionResult eventually(Condition holds) {
  const auto deadline = std::chrono::steady_clock::now() + kSoon;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > deadline) return testing::AssertionFailure() << "it did not come";
    std::this_thread::yield();
  }
  return testing::AssertionSuccess();
}

class OnEachTransport : public RunningDaemon, public testing::WithParamInterface<bool> {};
INSTANTIATE_TEST_SUITE_P(Transports, OnEachTransport, testing::Bool(),
                         [](const auto& test) { return test.param ? "Tcp" : "Unix"; });

TEST_P(OnEachTransport, FramesArriveAsTheSourceMadeThem) {
  // Large enough for shared memory on the Unix socket.
  start("[[source]]\nname = 'cam'\ndriver = 'pattern'\npace = 'trigger'\nwidth = 160\nheight = 120\n");
  auto client = this->client(GetParam());
  auto stream = client.subscribe("cam", {.policy = Policy::Queue, .queue = 8});
  ASSERT_TRUE(stream.ok()) << stream.error().message;
  for (std::uint64_t shift = 0; shift < 3; ++shift) {
    ASSERT_TRUE(client.trigger("cam").ok());
    const auto frame = stream->next(kSoon);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    EXPECT_EQ(frame->source, "cam");
    EXPECT_EQ(frame->sequence, shift);
    EXPECT_EQ(frame->dropped_before, 0u);
    ASSERT_NE(frame->find(PlaneKind::Range), nullptr);
    const auto range = frame->find(PlaneKind::Range)->as<float>();
    const auto flags = frame->find(PlaneKind::Flags)->as<std::uint8_t>();
    for (int y = 0; y < 120; ++y) {
      for (int x = 0; x < 160; ++x) {
        const auto i = static_cast<std::size_t>(160 * y + x);
        const auto expected = drivers::pattern::pixelAt(160, 120, shift, x, y);
        ASSERT_EQ(flags[i], expected.flags);
        ASSERT_TRUE(std::isnan(expected.range_m) ? std::isnan(range[i]) : range[i] == expected.range_m);
      }
    }
  }
}

TEST_P(OnEachTransport, AStalledClientDelaysNobodyAndIsToldWhatItMissed) {
  start(kTriggered);
  auto stalled = client(GetParam()), lively = client(GetParam());
  auto slow = stalled.subscribe("cam", {.policy = Policy::Queue, .queue = 4});
  auto quick = lively.subscribe("cam", {.policy = Policy::Queue, .queue = 4});
  ASSERT_TRUE(slow.ok() && quick.ok());
  constexpr std::uint64_t kFrames = 200;
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    ASSERT_TRUE(lively.trigger("cam").ok());
    const auto frame = quick->next(kSoon);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    ASSERT_EQ(frame->sequence, i);
    ASSERT_EQ(frame->dropped_before, 0u);
  }
  // The window of four was sent, four wait in the daemon, the others were dropped and counted.
  std::uint64_t got = 0, dropped = 0, last = 0;
  while (got + dropped < kFrames) {
    const auto frame = slow->next(kSoon);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    if (got > 0) {
      EXPECT_EQ(frame->sequence, last + 1 + frame->dropped_before);
    }
    last = frame->sequence;
    dropped += frame->dropped_before;
    ++got;
  }
  EXPECT_EQ(got, 8u);
  EXPECT_EQ(dropped, kFrames - 8);
}

TEST_P(OnEachTransport, LockstepMakesTheNextFrameWhenBothClientsAskedForIt) {
  start(kFast);
  auto one = client(GetParam()), two = client(GetParam());
  auto first = one.subscribe("cam", {.policy = Policy::Lockstep});
  auto a = first->next(kSoon);  // alone; the next is made when both ask
  ASSERT_TRUE(a.ok());
  auto second = two.subscribe("cam", {.policy = Policy::Lockstep});
  auto b = a;
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(a.ok() && b.ok());
    ASSERT_EQ(a->sequence, b->sequence);
    const std::uint64_t made = daemon_->hub().health().sources.at(0).frames;
    EXPECT_EQ(made, a->sequence + 1) << "a frame was made that nobody asked for";
    const Transform<World, Camera> pose{{1, 0, 0, 0}, {0, 0, static_cast<double>(i)}};
    ASSERT_TRUE(one.setPose("cam", pose).ok());
    std::thread other{[&] { b = second->next(kSoon); }};
    a = first->next(kSoon);
    other.join();
    ASSERT_TRUE(a.ok());
    EXPECT_EQ(a->moment.world_from_camera, pose);
  }
}

TEST_F(RunningDaemon, AVanishedLockstepClientHoldsNobodyUp) {
  start(kFast);
  auto one = client();
  std::optional<Client> two = client();
  auto second = two->subscribe("cam", {.policy = Policy::Lockstep});
  ASSERT_TRUE(second->next(kSoon).ok());  // and never asks for another
  auto first = one.subscribe("cam", {.policy = Policy::Lockstep});
  EXPECT_EQ(first->next(50ms).error().code, Error::Code::Timeout);
  second = Error{};
  two.reset();
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(first->next(kSoon).ok());
}

/// A client that says Hello and Subscribe and then reads no more than some bytes of a frame.
class RawClient {
 public:
  explicit RawClient(const std::string& path) : fd_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(::connect(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  void send(const wire::Message& message) { sendBytes(wire::toBytes(wire::encode(message))); }
  void sendBytes(const std::vector<std::byte>& bytes) {
    EXPECT_EQ(::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(bytes.size()));
  }
  /// Some bytes, at least one unless the daemon closed.
  std::size_t receive(std::size_t count) {
    std::vector<std::byte> bytes(count);
    const ssize_t got = ::recv(fd_.get(), bytes.data(), count, 0);
    return got > 0 ? static_cast<std::size_t>(got) : 0;
  }
  /// The next message, or nothing when the daemon closed.
  std::optional<wire::Message> message() {
    std::vector<std::byte> bytes(wire::kPreambleSize);
    if (!fill(bytes, 0)) return std::nullopt;
    const auto preamble = wire::decodePreamble(std::span{bytes}.first<wire::kPreambleSize>(), {});
    EXPECT_TRUE(preamble.ok());
    const std::size_t size = wire::kPreambleSize + preamble->header_bytes + preamble->body_bytes;
    bytes.resize(size);
    if (!fill(bytes, wire::kPreambleSize)) return std::nullopt;
    auto decoded = wire::decode(Buffer::adopt(bytes));
    EXPECT_TRUE(decoded.ok());
    return *std::move(decoded);
  }

 private:
  bool fill(std::vector<std::byte>& bytes, std::size_t from) {
    while (from < bytes.size()) {
      const ssize_t got = ::recv(fd_.get(), bytes.data() + from, bytes.size() - from, 0);
      if (got <= 0) return false;
      from += static_cast<std::size_t>(got);
    }
    return true;
  }
  transport::FileDescriptor fd_;
};

TEST_F(RunningDaemon, AClientKilledInTheMiddleOfAFrameHarmsNobody) {
  // Two megabytes a frame: more than the socket's buffers, so that it is cut in the middle.
  start("[[source]]\nname = 'cam'\ndriver = 'pattern'\npace = 'trigger'\n");
  auto client = this->client();
  auto stream = client.subscribe("cam", {.policy = Policy::Queue, .queue = 4});
  for (std::uint64_t i = 0; i < 5; ++i) {
    RawClient victim{daemon_->socketPath()};
    victim.send(wire::Hello{1, "victim", {}});
    wire::Subscribe subscribe;
    subscribe.source = "cam";
    victim.send(subscribe);
    ASSERT_TRUE(victim.message() && victim.message());  // Hello, Subscribed
    ASSERT_TRUE(client.trigger("cam").ok());
    ASSERT_GT(victim.receive(1000), 0u);
    const auto frame = stream->next(kSoon);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    EXPECT_EQ(frame->sequence, i);
  }
  EXPECT_TRUE(eventually([&] { return daemon_->hub().health().sessions == 1; }));
}

TEST_F(RunningDaemon, AClientThatNeverReadsDelaysNobody) {
  start("[[source]]\nname = 'cam'\ndriver = 'pattern'\npace = 'trigger'\n");
  RawClient stalled{daemon_->socketPath()};
  stalled.send(wire::Hello{1, "stalled", {}});
  wire::Subscribe subscribe;
  subscribe.source = "cam";
  stalled.send(subscribe);
  auto client = this->client();
  auto stream = client.subscribe("cam", {.policy = Policy::Queue, .queue = 4});
  for (std::uint64_t i = 0; i < 20; ++i) {
    ASSERT_TRUE(client.trigger("cam").ok());
    const auto frame = stream->next(kSoon);
    ASSERT_TRUE(frame.ok());
    EXPECT_EQ(frame->sequence, i);
  }
}

TEST_F(RunningDaemon, ALosslessClientGetsEveryFrameOrIsToldThatItCannot) {
  configure("[limits]\nlossless_mb = 1\n" + kFast);  // 1 MB are some hundred of these frames
  start(options());
  auto client = this->client();
  auto stream = client.subscribe("cam", {.policy = Policy::Lossless});
  auto health = this->client();
  ASSERT_TRUE(eventually([&] { return health.health()->sources.at(0).subscribers == 0; }));
  std::uint64_t expected = 0;
  while (true) {
    const auto frame = stream->next(kSoon);
    if (!frame) {
      EXPECT_EQ(frame.error().code, Error::Code::Overrun);
      EXPECT_THAT(frame.error().message, HasSubstr("limits.lossless_mb"));
      break;
    }
    if (expected == 0) expected = frame->sequence;
    ASSERT_EQ(frame->sequence, expected++);
    ASSERT_EQ(frame->dropped_before, 0u);
  }
  EXPECT_GT(expected, 100u);
}

TEST_F(RunningDaemon, BytesThatAreNoMessageGetAFailureAndAClosedConnection) {
  start(kTriggered);
  RawClient stranger{daemon_->socketPath()};
  stranger.sendBytes(std::vector<std::byte>(200, std::byte{'G'}));
  const auto answer = stranger.message();
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(std::get<wire::Failure>(*answer).id, 0u);
  EXPECT_FALSE(stranger.message().has_value());
}

TEST_F(RunningDaemon, AFrameFromAClientIsTooLargeToBeARequest) {
  start(kTriggered);
  RawClient stranger{daemon_->socketPath()};
  stranger.send(wire::Hello{1, "stranger", {}});
  ASSERT_TRUE(stranger.message().has_value());
  Frame frame;
  frame.planes = {toPlane(PlaneKind::Range, Image<float>{8, 8})};
  stranger.send(wire::FrameMessage{1, frame});
  const auto answer = stranger.message();
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(std::get<wire::Failure>(*answer).error.code, Error::Code::TooLarge);
  EXPECT_FALSE(stranger.message().has_value());
}

TEST_F(RunningDaemon, AClientWithoutHelloIsCutOff) {
  configure("[limits]\nhandshake_s = 0.1\n" + kTriggered);
  start(options());
  RawClient silent{daemon_->socketPath()};
  const auto answer = silent.message();
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(std::get<wire::Failure>(*answer).error.code, Error::Code::Timeout);
  EXPECT_FALSE(silent.message().has_value());
}

TEST_F(RunningDaemon, OneClientTooManyIsTold) {
  configure("[limits]\nsessions = 2\n" + kTriggered);
  start(options());
  auto one = client(), two = client();
  const auto three = Client::connect("unix:" + daemon_->socketPath());
  ASSERT_FALSE(three.ok());
  EXPECT_THAT(three.error().message, HasSubstr("limits.sessions"));
  EXPECT_TRUE(one.health().ok());
}

TEST_F(RunningDaemon, RecordsIntoItsFolderEveryFrameAsItWas) {
  start(kTriggered);
  auto client = this->client();
  const auto path = client.startRecording("cam", "run");
  ASSERT_TRUE(path.ok()) << path.error().message;
  EXPECT_EQ(*path, (folder_ / "recordings" / "run.mcap").string());
  EXPECT_FALSE(client.startRecording("cam", "other").ok()) << "two recordings of one source";
  auto stream = client.subscribe("cam", {.policy = Policy::Queue, .queue = 8});
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(client.trigger("cam").ok());
    ASSERT_TRUE(stream->next(kSoon).ok());
  }
  const auto closed = client.stopRecording("cam");
  ASSERT_TRUE(closed.ok()) << closed.error().message;
  EXPECT_THAT(client.startRecording("cam", "run").error().message, HasSubstr("exists already"));
  EXPECT_FALSE(client.startRecording("cam", "../run").ok());

  auto reader = record::Reader::open(*path);
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  EXPECT_TRUE(reader->summary().indexed);
  for (std::uint64_t i = 0; i < 5; ++i) {
    const auto frame = reader->next("cam");
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    EXPECT_EQ(frame->sequence, i);
    EXPECT_EQ(frame->planes.size(), 5u);
  }
  EXPECT_EQ(reader->next("cam").error().code, Error::Code::EndOfStream);
}

TEST_F(RunningDaemon, StoppingClosesRecordingsAndTellsClients) {
  start(kTriggered);
  auto client = this->client();
  const auto path = client.startRecording("cam", "run");
  auto stream = client.subscribe("cam", {.policy = Policy::Queue, .queue = 8});
  ASSERT_TRUE(client.trigger("cam").ok());
  ASSERT_TRUE(stream->next(kSoon).ok());
  const std::string socket = daemon_->socketPath();
  stop();
  const auto end = stream->next(kSoon);
  ASSERT_FALSE(end.ok());
  EXPECT_EQ(end.error().code, Error::Code::Stopped) << end.error().message;
  EXPECT_FALSE(std::filesystem::exists(socket));
  const auto reader = record::Reader::open(*path);
  ASSERT_TRUE(reader.ok());
  EXPECT_TRUE(reader->summary().indexed);
  EXPECT_EQ(reader->summary().frames_per_source.at("cam"), 1u);
}

TEST_F(RunningDaemon, AReloadKeepsWhatIsAsBeforeAndChangesTheRest) {
  const std::string other = "[[source]]\nname = 'other'\ndriver = 'pattern'\npace = 'trigger'\nwidth = ";
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
  explicit FakeSystemd(const std::string& path) : fd_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
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
  EXPECT_THAT(systemd.next(), testing::AllOf(HasSubstr("RELOADING=1\n"), HasSubstr("MONOTONIC_USEC=")));
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
  configure("[limits]\nsource_stuck_s = 5\n[[source]]\nname = 'cam'\ndriver = 'stuck'\nstart = 'always'\n");
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
