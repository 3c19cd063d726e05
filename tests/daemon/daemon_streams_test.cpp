// SPDX-License-Identifier: Apache-2.0
// What clients of the whole daemon get.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>

#include <cmath>
#include <optional>
#include <thread>

#include "drivers/pattern/pattern.h"
#include "protocol/record/recording.h"
#include "running_daemon.h"

namespace toftwin::daemon {
namespace {

using namespace std::chrono_literals;
using namespace test;
using testing::HasSubstr;
using Policy = SubscribeOptions::Policy;

class OnEachTransport : public RunningDaemon, public testing::WithParamInterface<bool> {};
INSTANTIATE_TEST_SUITE_P(Transports, OnEachTransport, testing::Bool(),
                         [](const auto& test) { return test.param ? "Tcp" : "Unix"; });

TEST_P(OnEachTransport, FramesArriveAsTheSourceMadeThem) {
  // Large enough for shared memory on the Unix socket.
  start(
      "[[source]]\nname = 'cam'\ndriver = 'pattern'\npace = 'trigger'\nwidth = 160\nheight = "
      "120\n");
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
        ASSERT_TRUE(std::isnan(expected.range_m) ? std::isnan(range[i])
                                                 : range[i] == expected.range_m);
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

/// Bodies in shared memory that this process has open, or could not tell.
int openSharedBodies() {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator{"/proc/self/fd"}) {
    std::error_code gone;  // the iterator's own
    const auto target = std::filesystem::read_symlink(entry.path(), gone).string();
    if (target.find("memfd:toftwin-body") != std::string::npos) ++count;
  }
  return count;
}

TEST_F(RunningDaemon, FramesThatWaitForAStalledClientHoldNoFileDescriptors) {
  start("[[source]]\nname = 'cam'\ndriver = 'pattern'\npace = 'trigger'\nwidth = 160\n"
        "height = 120\n");
  RawClient stalled{daemon_->socketPath()};
  stalled.send(wire::Hello{1, "stalled", {"memfd"}});
  ASSERT_TRUE(stalled.message().has_value());
  wire::Subscribe request{.id = 2, .source = "cam"};
  request.policy = wire::Policy::Queue;
  request.queue = 1024;
  request.window = 2;
  stalled.send(request);
  ASSERT_TRUE(stalled.message().has_value());
  auto lively = client();
  auto stream = lively.subscribe("cam", {.policy = Policy::Queue, .queue = 4});
  ASSERT_TRUE(stream.ok());
  for (std::uint64_t i = 0; i < 50; ++i) {
    ASSERT_TRUE(lively.trigger("cam").ok());
    const auto frame = stream->next(kSoon);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    ASSERT_EQ(frame->sequence, i);
    ASSERT_EQ(frame->dropped_before, 0u);
  }
  // At most one frame is being written to each, four are kept for who comes late, and two are ready for the next.
  EXPECT_LE(openSharedBodies(), 8);
}

TEST_F(RunningDaemon, WithTheLastSubscriptionInSharedMemoryItsMemoryGoes) {
  // Triggered: while frames flow, their memory moves from one descriptor to another, and a listing that it
  // moves past shows none.
  start("[[source]]\nname = 'cam'\ndriver = 'pattern'\npace = 'trigger'\nwidth = 160\nheight = 120\n");
  const auto comesTo = [](auto is_so) {
    const auto soon = std::chrono::steady_clock::now() + kSoon;
    while (!is_so(openSharedBodies()) && std::chrono::steady_clock::now() < soon)
      std::this_thread::sleep_for(std::chrono::milliseconds{10});
    return is_so(openSharedBodies());
  };
  {
    auto one = client();
    auto stream = one.subscribe("cam", {.policy = Policy::Queue, .queue = 4});
    ASSERT_TRUE(stream.ok());
    ASSERT_TRUE(one.trigger("cam").ok());
    ASSERT_TRUE(stream->next(kSoon).ok());
    EXPECT_TRUE(comesTo([](int open) { return open == 3; })) << "the last, two ready for the next, and no more";
  }
  EXPECT_TRUE(comesTo([](int open) { return open == 0; }));
}

/// The patience of the kernel with silent peers, one entry for each TCP socket of this process that has one.
std::vector<unsigned> patienceOfSockets() {
  std::vector<unsigned> all;
  for (int fd = 0; fd < 256; ++fd) {
    unsigned milliseconds = 0;
    int is_asked = 0;
    socklen_t size = sizeof milliseconds, other = sizeof is_asked;
    const int asked = ::getsockopt(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, &milliseconds, &size);
    if (asked != 0 || milliseconds == 0) continue;
    if (::getsockopt(fd, SOL_SOCKET, SO_KEEPALIVE, &is_asked, &other) == 0 && is_asked != 0) {
      all.push_back(milliseconds);
    }
  }
  return all;
}

// That vanished peers are noticed is tested in vanished_client_test.cpp.
TEST_F(RunningDaemon, SilentPeersOverTcpHaveAMinuteAndTenSecondsInLockstep) {
  start(kFast);
  EXPECT_THAT(patienceOfSockets(), testing::IsEmpty());
  auto client = this->client(true);
  ASSERT_TRUE(client.subscribe("cam", {.policy = Policy::Latest}).ok());
  EXPECT_THAT(patienceOfSockets(), testing::ElementsAre(60'000u));
  auto stream = client.subscribe("cam", {.policy = Policy::Lockstep});
  ASSERT_TRUE(stream.ok());
  EXPECT_THAT(patienceOfSockets(), testing::ElementsAre(10'000u));
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

TEST_F(RunningDaemon, AClientKilledInTheMiddleOfAFrameHarmsNobody) {
  // Two megabytes a frame: more than the socket's buffers, so that it is cut in the middle.
  start("[[source]]\nname = 'cam'\ndriver = 'pattern'\npace = 'trigger'\n");
  auto client = this->client();
  auto stream = client.subscribe("cam", {.policy = Policy::Queue, .queue = 4});
  for (std::uint64_t i = 0; i < 5; ++i) {
    RawClient victim{daemon_->socketPath()};
    victim.send(wire::Hello{1, "victim", {}});
    wire::Subscribe subscribe{.id = 2};
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
  wire::Subscribe subscribe{.id = 2};
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
  configure("[limits]\nsubscription_backlog_mb = 1\n" + kFast);  // 1 MB are about a hundred of these frames
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
      EXPECT_THAT(frame.error().message, HasSubstr("limits.subscription_backlog_mb"));
      break;
    }
    if (expected == 0) expected = frame->sequence;
    ASSERT_EQ(frame->sequence, expected++);
    ASSERT_EQ(frame->dropped_before, 0u);
  }
  // How many came is a matter of who was faster: what waits at the overrun is lost.
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
  // Served before the recorder: what it has seen must be in the recording all the same.
  auto stream = client.subscribe("cam", {.policy = Policy::Queue, .queue = 8});
  const auto path = client.startRecording("cam", "run");
  ASSERT_TRUE(path.ok()) << path.error().message;
  EXPECT_EQ(*path, (folder_ / "recordings" / "run.mcap").string());
  EXPECT_FALSE(client.startRecording("cam", "other").ok()) << "two recordings of one source";
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(client.trigger("cam").ok());
    ASSERT_TRUE(stream->next(kSoon).ok());
  }
  const auto closed = client.stopRecording("cam");
  ASSERT_TRUE(closed.ok()) << closed.error().message;
  EXPECT_THAT(client.startRecording("cam", "run").error().message, HasSubstr("there is such a file already"));
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

TEST_F(RunningDaemon, AFrameThatIsTooLargeIsRefusedBeforeItIsMadeAndHarmsNoOther) {
  configure("recording_folder = 'recordings'\n[limits]\nsubscription_backlog_mb = 2000\n" + kTriggered +
            "[[source]]\nname = 'large'\ndriver = 'pattern'\nwidth = 4096\nheight = 4096\n");
  start(options());
  auto client = this->client();
  auto stream = client.subscribe("cam", {.policy = Policy::Queue, .queue = 8});
  ASSERT_TRUE(stream.ok());
  const auto refused = client.subscribe("large", {});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, Error::Code::TooLarge);
  EXPECT_THAT(refused.error().message, HasSubstr("one frame has 272 MiB"));
  const auto recording = client.startRecording("large", "run");
  ASSERT_FALSE(recording.ok());
  EXPECT_THAT(recording.error().message, HasSubstr("one frame has 272 MiB"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "recordings" / "run.mcap"));
  ASSERT_TRUE(client.trigger("cam").ok());
  EXPECT_TRUE(stream->next(kSoon).ok()) << "the connection was broken";
}

TEST_F(RunningDaemon, ARecordingEndsAtItsBoundsAndSaysWhich) {
  for (const std::string bound : {"max_mb = 1", "keep_free_mb = 100000000"}) {
    configure("recording_folder = 'recordings'\n[recording]\n" + bound + "\n" +
              "[[source]]\nname = 'cam'\ndriver = 'pattern'\npace = 'trigger'\n"
              "width = 160\nheight = 120\n");
    start(options());
    auto client = this->client();
    const auto path = client.startRecording("cam", bound.substr(0, 3));
    ASSERT_TRUE(path.ok()) << path.error().message;
    const auto isOver = [&] { return !client.health()->sources.at(0).last_error.empty(); };
    for (int i = 0; i < 100 && !isOver(); ++i) static_cast<void>(client.trigger("cam"));
    ASSERT_TRUE(eventually(isOver));
    EXPECT_THAT(client.health()->sources[0].last_error, HasSubstr("recording." + bound));
    const auto stopped = client.stopRecording("cam");
    ASSERT_FALSE(stopped.ok());
    EXPECT_EQ(stopped.error().code, Error::Code::StorageFull);
    const auto reader = record::Reader::open(*path);
    ASSERT_TRUE(reader.ok()) << reader.error().message;
    EXPECT_TRUE(reader->summary().indexed);
    EXPECT_LE(std::filesystem::file_size(*path), 1u << 20);
    if (bound == "max_mb = 1") {
      EXPECT_GE(reader->summary().frames_per_source.at("cam"), 1u);
    }
    stop();
  }
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

}  // namespace
}  // namespace toftwin::daemon
