// SPDX-License-Identifier: Apache-2.0
#include <toftwin/client.h>

#include <gmock/gmock.h>
#include <stdlib.h>

#include <filesystem>
#include <future>
#include <limits>
#include <mutex>

#include "example_messages.h"
#include "fake_daemon.h"

namespace toftwin {
namespace {

using testing::HasSubstr;
using namespace std::chrono_literals;
using Session = FakeDaemon::Session;
using Policy = SubscribeOptions::Policy;

constexpr auto kSoon = 5s;       // for what must come; never waited out in a passing test
constexpr auto kNothing = 50ms;  // for what must not come

Frame numbered(std::uint64_t sequence) {
  Frame frame = wire::exampleFrame(8, 6);
  frame.sequence = sequence;
  return frame;
}

/// Sends frames 1 to `count` of subscription 7 as soon as it is subscribed to; its health comes
/// behind them.
FakeDaemon::Script sendsFrames(std::uint64_t count) {
  return FakeDaemon::polite([count](Session& session, const wire::Message& message) {
    if (const auto* ask = std::get_if<wire::AskHealth>(&message)) {
      session.send(wire::Health{ask->id, 1_s, 1, {}});
    }
    if (!std::holds_alternative<wire::Subscribe>(message)) return;
    for (std::uint64_t i = 1; i <= count; ++i) session.send(wire::FrameMessage{7, numbered(i)});
  });
}

class ClientOn : public testing::TestWithParam<FakeDaemon::On> {};
INSTANTIATE_TEST_SUITE_P(TcpAndUnix, ClientOn,
                         testing::Values(FakeDaemon::On::Unix, FakeDaemon::On::Tcp),
                         [](const auto& test) {
                           return test.param == FakeDaemon::On::Unix ? "Unix" : "Tcp";
                         });

TEST_P(ClientOn, EveryRequestGetsItsAnswer) {
  std::atomic<bool> is_set_to_far{false};
  FakeDaemon daemon{
      GetParam(), FakeDaemon::polite([&is_set_to_far](Session& session, const wire::Message& message) {
        const auto done = [&](std::uint64_t id, std::string detail) {
          session.send(wire::Done{id, detail});
        };
        if (auto* list = std::get_if<wire::ListSources>(&message)) {
          session.send(
              wire::SourceList{list->id, {{"kinect", "K", "1", FrameKind::Simulated, true}}});
        } else if (auto* describe = std::get_if<wire::DescribeSource>(&message)) {
          wire::SourceDescription answer;
          answer.id = describe->id;
          answer.driver = "sim";
          answer.summary.name = describe->source;
          answer.planes = {PlaneKind::Range};
          answer.frame_interval = 33_ms;
          answer.can_lockstep = true;
          session.send(answer);
        } else if (auto* pose = std::get_if<wire::SetPose>(&message)) {
          done(pose->id, "");
        } else if (auto* parameter = std::get_if<wire::SetParameter>(&message)) {
          is_set_to_far = parameter->text == "far";
          done(parameter->id, "");
        } else if (auto* trigger = std::get_if<wire::Trigger>(&message)) {
          done(trigger->id, "");
        } else if (auto* record = std::get_if<wire::Record>(&message)) {
          done(record->id, record->file.empty() ? "/rec/stopped" : "/rec/" + record->file);
        } else if (auto* health = std::get_if<wire::AskHealth>(&message)) {
          session.send(wire::Health{health->id, 12_s, 1, {{"kinect", true, 5, 0, 0, 0, ""}}});
        }
      })};
  auto client = Client::connect(daemon.address());
  ASSERT_TRUE(client) << client.error().message;
  EXPECT_EQ(client->sources()->at(0).name, "kinect");
  const auto details = client->describe("kinect");
  ASSERT_TRUE(details) << details.error().message;
  EXPECT_EQ(details->entry.name, "kinect");
  EXPECT_EQ(details->driver, "sim");
  EXPECT_EQ(details->frame_interval, 33_ms);
  EXPECT_TRUE(details->can_lockstep);
  EXPECT_TRUE(client->setPose("kinect", {}));
  EXPECT_TRUE(client->setParameter("kinect", "ambient_klx", 3.0));
  EXPECT_FALSE(is_set_to_far);
  EXPECT_TRUE(client->setParameter("kinect", "mode", "far"));
  EXPECT_TRUE(is_set_to_far);
  EXPECT_TRUE(client->trigger("kinect"));
  EXPECT_EQ(*client->startRecording("kinect", "a.mcap"), "/rec/a.mcap");
  EXPECT_EQ(*client->stopRecording("kinect"), "/rec/stopped");
  const auto health = client->health();
  ASSERT_TRUE(health) << health.error().message;
  EXPECT_EQ(health->software, "fake daemon 1.0");
  EXPECT_EQ(health->sources.at(0).frames, 5u);
}

TEST_P(ClientOn, AFrameArrivesAsItWasSent) {
  const wire::Message sent = wire::FrameMessage{7, wire::exampleFrame(512, 424)};
  FakeDaemon daemon{GetParam(),
                    FakeDaemon::polite([&](Session& session, const wire::Message& message) {
                      if (std::holds_alternative<wire::Subscribe>(message)) session.send(sent);
                    })};
  auto client = Client::connect(daemon.address());
  auto subscription = client->subscribe("kinect");
  ASSERT_TRUE(subscription) << subscription.error().message;
  auto frame = subscription->next(kSoon);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(wire::toBytes(*wire::encode(wire::FrameMessage{7, *frame})),
            wire::toBytes(*wire::encode(sent)));
}

TEST_P(ClientOn, SubscribeSaysAllThatTheOptionsSay) {
  std::promise<wire::Subscribe> received;
  FakeDaemon daemon{GetParam(), FakeDaemon::polite([&](Session&, const wire::Message& message) {
                      if (auto* m = std::get_if<wire::Subscribe>(&message)) received.set_value(*m);
                    })};
  auto client = Client::connect(daemon.address());
  auto subscription = client->subscribe("o3d", {.planes = {PlaneKind::Depth},
                                                .x = 1,
                                                .y = 2,
                                                .width = 3,
                                                .height = 4,
                                                .decimation = 5,
                                                .max_rate_hz = 6.0,
                                                .policy = Policy::Queue,
                                                .queue = 7});
  const wire::Subscribe request = received.get_future().get();
  EXPECT_EQ(request.source, "o3d");
  EXPECT_EQ(request.planes, std::vector{PlaneKind::Depth});
  EXPECT_EQ(request.region, (wire::Region{1, 2, 3, 4}));
  EXPECT_EQ(request.decimation, 5u);
  EXPECT_EQ(request.max_rate_hz, 6.0);
  EXPECT_EQ(request.policy, wire::Policy::Queue);
  EXPECT_EQ(request.queue, 7u);
  EXPECT_GT(request.window, 0u);
}

TEST_P(ClientOn, AFailureIsTheDaemonsError) {
  FakeDaemon daemon{
      GetParam(), FakeDaemon::polite([](Session& session, const wire::Message& message) {
        if (auto* m = std::get_if<wire::Trigger>(&message)) {
          session.send(wire::Failure{m->id, {Error::Code::Unsupported, "kinect has no trigger"}});
        }
      })};
  auto client = Client::connect(daemon.address());
  const auto result = client->trigger("kinect");
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, Error::Code::Unsupported);
  EXPECT_EQ(result.error().message, "kinect has no trigger");
}

TEST_P(ClientOn, AnAnswerThatDoesNotComeIsATimeoutAndTheConnectionGoesOn) {
  FakeDaemon daemon{GetParam(),
                    FakeDaemon::polite([](Session& session, const wire::Message& message) {
                      if (auto* m = std::get_if<wire::AskHealth>(&message))
                        session.send(wire::Health{m->id, 1_s, 1, {}});
                    })};
  auto client = Client::connect(daemon.address(), {.timeout = 1s});  // that a busy machine keeps for what does answer
  ASSERT_TRUE(client) << client.error().message;
  const auto result = client->trigger("kinect");
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, Error::Code::Timeout);
  EXPECT_THAT(result.error().message, HasSubstr("did not answer within 1000 ms"));
  EXPECT_TRUE(client->health());
}

TEST_P(ClientOn, LosingTheDaemonEndsRequestsAndSubscriptionsWithAReason) {
  FakeDaemon daemon{GetParam(),
                    FakeDaemon::polite([](Session& session, const wire::Message& message) {
                      if (std::holds_alternative<wire::Trigger>(message)) session.close();
                    })};
  auto client = Client::connect(daemon.address());
  auto subscription = client->subscribe("kinect");
  for (const auto& result : {client->trigger("kinect"), client->trigger("again")}) {
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, Error::Code::Disconnected);
    EXPECT_THAT(result.error().message, HasSubstr(daemon.address()));
  }
  const auto frame = subscription->next(kSoon);
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, Error::Code::Disconnected);
}

TEST_P(ClientOn, MalformedBytesEndTheConnectionWithAReason) {
  FakeDaemon daemon{GetParam(),
                    FakeDaemon::polite([](Session& session, const wire::Message& message) {
                      if (std::holds_alternative<wire::Trigger>(message)) {
                        session.sendBytes(std::vector<std::byte>(64, std::byte{'x'}));
                      }
                    })};
  auto client = Client::connect(daemon.address());
  const auto result = client->trigger("kinect");
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, Error::Code::Malformed);
}

TEST_P(ClientOn, AFrameLargerThanAllowedIsRefused) {
  FakeDaemon daemon{GetParam(),
                    FakeDaemon::polite([](Session& session, const wire::Message& message) {
                      if (std::holds_alternative<wire::Subscribe>(message)) {
                        session.send(wire::FrameMessage{7, wire::exampleFrame(512, 424)});
                      }
                    })};
  auto client = Client::connect(daemon.address(), {.max_message_bytes = 1 << 20});
  auto subscription = client->subscribe("kinect");
  const auto frame = subscription->next(kSoon);
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, Error::Code::TooLarge);
}

TEST_P(ClientOn, AnotherProtocolIsRecognised) {
  FakeDaemon daemon{GetParam(), [](Session& session, const wire::Message&) {
                      std::vector<std::byte> page(100, std::byte{' '});
                      const std::string_view text = "HTTP/1.1 400 Bad Request";
                      std::ranges::copy(std::as_bytes(std::span{text}), page.begin());
                      session.sendBytes(std::move(page));
                    }};
  const auto client = Client::connect(daemon.address());
  ASSERT_FALSE(client);
  EXPECT_THAT(client.error().message, HasSubstr("is the other side a toftwin program?"));
}

TEST_P(ClientOn, ASilentPeerIsATimeout) {
  FakeDaemon daemon{GetParam(), [](Session&, const wire::Message&) {}};
  const auto client = Client::connect(daemon.address(), {.timeout = 50ms});
  ASSERT_FALSE(client);
  EXPECT_EQ(client.error().code, Error::Code::Timeout);
}

// ---- policies
// --------------------------------------------------------------------------------------

TEST_P(ClientOn, LatestGivesTheNewestAndCountsTheOthersAsDropped) {
  FakeDaemon daemon{GetParam(),
                    FakeDaemon::polite([](Session& session, const wire::Message& message) {
                      if (std::holds_alternative<wire::Subscribe>(message)) {
                        for (std::uint64_t i = 1; i <= 3; ++i) {
                          Frame frame = numbered(2 * i);
                          frame.dropped_before = 1;  // the daemon left out every other
                          session.send(wire::FrameMessage{7, frame});
                        }
                      } else if (auto* m = std::get_if<wire::AskHealth>(&message)) {
                        session.send(wire::Health{m->id, 1_s, 1, {}});
                      }
                    })};
  auto client = Client::connect(daemon.address());
  auto subscription = client->subscribe("kinect");
  ASSERT_TRUE(client->health());  // behind the frames: now all three have arrived
  const auto frame = subscription->next(kSoon);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->sequence, 6u);
  EXPECT_EQ(frame->dropped_before, 5u);  // 1, 2, 3, 4, 5
  EXPECT_EQ(subscription->next(kNothing).error().code, Error::Code::Timeout);
}

/// Collects the sequences that the client acknowledges.
struct Acknowledged {
  std::mutex mutex;
  std::vector<std::uint64_t> sequences;
  void add(const wire::Message& message) {
    const auto* m = std::get_if<wire::Acknowledge>(&message);
    if (!m) return;
    const std::scoped_lock lock{mutex};
    sequences.push_back(m->sequence);
  }
  std::vector<std::uint64_t> get() {
    const std::scoped_lock lock{mutex};
    return sequences;
  }
};

class Acknowledging : public testing::TestWithParam<Policy> {};
INSTANTIATE_TEST_SUITE_P(Policies, Acknowledging, testing::Values(Policy::Queue, Policy::Lossless));

TEST_P(Acknowledging, HappensWhenTheApplicationTakesTheFrame) {
  Acknowledged acknowledged;
  FakeDaemon daemon{FakeDaemon::On::Unix,
                    FakeDaemon::polite([&](Session& session, const wire::Message& message) {
                      acknowledged.add(message);
                      if (std::holds_alternative<wire::Subscribe>(message))
                        session.send(wire::FrameMessage{7, numbered(1)});
                      if (auto* m = std::get_if<wire::AskHealth>(&message))
                        session.send(wire::Health{m->id, 1_s, 1, {}});
                    })};
  auto client = Client::connect(daemon.address());
  auto subscription = client->subscribe("kinect", {.policy = GetParam()});
  ASSERT_TRUE(client->health());  // comes behind the frame
  ASSERT_TRUE(client->health());  // goes behind an acknowledgement, if there were one
  EXPECT_TRUE(acknowledged.get().empty());
  ASSERT_TRUE(subscription->next(kSoon));
  ASSERT_TRUE(client->health());
  EXPECT_EQ(acknowledged.get(), std::vector<std::uint64_t>{1});
}

TEST(Client, AcknowledgesALockstepFrameWhenTheNextIsAskedFor) {
  Acknowledged acknowledged;
  FakeDaemon daemon{FakeDaemon::On::Unix,
                    FakeDaemon::polite([&](Session& session, const wire::Message& message) {
                      acknowledged.add(message);
                      if (std::holds_alternative<wire::Subscribe>(message))
                        session.send(wire::FrameMessage{7, numbered(1)});
                      if (auto* m = std::get_if<wire::AskHealth>(&message))
                        session.send(wire::Health{m->id, 1_s, 1, {}});
                    })};
  auto client = Client::connect(daemon.address());
  auto subscription = client->subscribe("kinect", {.policy = Policy::Lockstep});
  ASSERT_TRUE(subscription->next(kSoon));
  ASSERT_TRUE(client->health());
  EXPECT_TRUE(acknowledged.get().empty());  // so that a pose may still be set for the next frame
  EXPECT_FALSE(subscription->next(kNothing));
  EXPECT_FALSE(subscription->next(kNothing));
  ASSERT_TRUE(client->health());
  EXPECT_EQ(acknowledged.get(), std::vector<std::uint64_t>{1});
}

TEST(Client, AcknowledgesLatestFramesWhenTheyArrive) {
  Acknowledged acknowledged;
  FakeDaemon daemon{FakeDaemon::On::Unix,
                    FakeDaemon::polite([&](Session& session, const wire::Message& message) {
                      acknowledged.add(message);
                      if (std::holds_alternative<wire::Subscribe>(message)) {
                        for (std::uint64_t i = 1; i <= 2; ++i)
                          session.send(wire::FrameMessage{7, numbered(i)});
                      }
                      if (auto* m = std::get_if<wire::AskHealth>(&message))
                        session.send(wire::Health{m->id, 1_s, 1, {}});
                    })};
  auto client = Client::connect(daemon.address());
  auto subscription = client->subscribe("kinect");
  ASSERT_TRUE(client->health());  // comes behind the frames
  ASSERT_TRUE(client->health());  // goes behind their acknowledgements
  EXPECT_EQ(acknowledged.get(), (std::vector<std::uint64_t>{1, 2}));
}

TEST(Client, LosslessKeepsEveryFrameInOrder) {
  FakeDaemon daemon{FakeDaemon::On::Unix, sendsFrames(4)};
  auto client = Client::connect(daemon.address());
  auto subscription = client->subscribe("kinect", {.policy = Policy::Lossless});
  for (std::uint64_t i = 1; i <= 4; ++i) EXPECT_EQ(subscription->next(kSoon)->sequence, i);
}

TEST(Client, ADaemonThatIgnoresTheWindowEndsTheSubscription) {
  FakeDaemon daemon{FakeDaemon::On::Unix, sendsFrames(100)};
  auto client = Client::connect(daemon.address());
  auto subscription = client->subscribe("kinect", {.policy = Policy::Lossless});
  ASSERT_TRUE(client->health());  // all hundred have come, and none was taken
  for (std::uint64_t i = 1; i <= 4; ++i) EXPECT_EQ(subscription->next(kSoon)->sequence, i);
  EXPECT_EQ(subscription->next(kSoon).error().code, Error::Code::Overrun);
}

TEST(Client, AnswersComeWhileASubscriptionIsNotRead) {
  FakeDaemon daemon{FakeDaemon::On::Tcp,
                    FakeDaemon::polite([](Session& session, const wire::Message& message) {
                      if (std::holds_alternative<wire::Subscribe>(message)) {
                        for (std::uint64_t i = 1; i <= 4; ++i) {
                          session.send(wire::FrameMessage{7, wire::exampleFrame(512, 424)});
                        }
                      }
                      if (auto* m = std::get_if<wire::AskHealth>(&message))
                        session.send(wire::Health{m->id, 1_s, 1, {}});
                    })};
  auto client = Client::connect(daemon.address());
  auto subscription = client->subscribe("kinect", {.policy = Policy::Lossless});
  EXPECT_TRUE(client->health());
}

TEST(Client, TheEndOfASubscriptionComesAfterItsFrames) {
  FakeDaemon daemon{
      FakeDaemon::On::Unix, FakeDaemon::polite([](Session& session, const wire::Message& message) {
        if (!std::holds_alternative<wire::Subscribe>(message)) return;
        session.send(wire::FrameMessage{7, numbered(1)});
        session.send(wire::SubscriptionEnded{7, {Error::Code::EndOfStream, "the recording ended"}});
      })};
  auto client = Client::connect(daemon.address());
  auto subscription = client->subscribe("kinect", {.policy = Policy::Lossless});
  EXPECT_TRUE(subscription->next(kSoon));
  for (int twice = 0; twice < 2; ++twice) {
    EXPECT_EQ(subscription->next(kSoon).error().code, Error::Code::EndOfStream);
  }
}

TEST(Client, DroppingASubscriptionTellsTheDaemon) {
  std::promise<std::uint64_t> unsubscribed;
  FakeDaemon daemon{FakeDaemon::On::Unix,
                    FakeDaemon::polite([&](Session&, const wire::Message& message) {
                      if (auto* m = std::get_if<wire::Unsubscribe>(&message))
                        unsubscribed.set_value(m->subscription);
                    })};
  auto client = Client::connect(daemon.address());
  { auto subscription = client->subscribe("kinect"); }
  EXPECT_EQ(unsubscribed.get_future().get(), 7u);
}

// ---- shared memory
// ---------------------------------------------------------------------------------

TEST(Client, TakesBodiesFromSharedMemoryAndKeepsThemAfterItIsGone) {
  FakeDaemon daemon{FakeDaemon::On::Unix,
                    FakeDaemon::polite([](Session& session, const wire::Message& message) {
                      if (std::holds_alternative<wire::Subscribe>(message))
                        session.sendShared({7, wire::exampleFrame(512, 424)});
                    })};
  Result<Frame> frame = Error{};
  {
    auto client = Client::connect(daemon.address());
    auto subscription = client->subscribe("kinect");
    frame = subscription->next(kSoon);
  }
  ASSERT_TRUE(frame) << frame.error().message;
  const Frame expected = wire::exampleFrame(512, 424);
  for (std::size_t i = 0; i < expected.planes.size(); ++i) {
    EXPECT_TRUE(std::ranges::equal(frame->planes[i].data.bytes(), expected.planes[i].data.bytes()));
  }
}

TEST_P(ClientOn, OffersSharedMemoryOnlyOnTheSameMachine) {
  std::promise<std::vector<std::string>> features;
  FakeDaemon daemon{GetParam(), [&](Session& session, const wire::Message& message) {
                      if (auto* m = std::get_if<wire::Hello>(&message)) {
                        features.set_value(m->features);
                        session.send(wire::Hello{m->id, "fake", {}});
                      }
                    }};
  const auto client = Client::connect(daemon.address());
  const bool offered = !features.get_future().get().empty();
  EXPECT_EQ(offered, GetParam() == FakeDaemon::On::Unix);
}

TEST_P(ClientOn, AsksAnOlderDaemonForNoPlaneThatItDoesNotKnow) {
  FakeDaemon daemon{GetParam(), [&](Session& session, const wire::Message& message) {
                      if (auto* m = std::get_if<wire::Hello>(&message)) {
                        auto bytes = wire::toBytes(*wire::encode(wire::Hello{m->id, "old", {}}));
                        auto preamble =
                            *wire::decodePreamble(std::span{bytes}.first<wire::kPreambleSize>(), {});
                        preamble.minor = 1;
                        std::ranges::copy(wire::encodePreamble(preamble), bytes.begin());
                        session.sendBytes(std::move(bytes));
                      } else {
                        FakeDaemon::polite()(session, message);
                      }
                    }};
  auto client = Client::connect(daemon.address());
  ASSERT_TRUE(client) << client.error().message;
  const auto refused = client->subscribe("kinect", {.planes = {PlaneKind::Range, PlaneKind::LightSigma}});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Error::Code::Unsupported);
  EXPECT_THAT(refused.error().message,
              testing::HasSubstr("version 1.1 of the protocol, which has no plane light_sigma"));
  EXPECT_TRUE(client->subscribe("kinect", {.planes = {PlaneKind::Range, PlaneKind::Color}}));
  const auto text = client->setParameter("kinect", "mode", "far");
  ASSERT_FALSE(text) << "an older daemon would set the number beside it";
  EXPECT_EQ(text.error().code, Error::Code::Unsupported);
}

// ---- bad input of the application
// ------------------------------------------------------------------

TEST(Client, ArgumentsThatCannotBeRightAreRefusedAtOnce) {
  FakeDaemon daemon{FakeDaemon::On::Unix, FakeDaemon::polite()};
  auto client = Client::connect(daemon.address());
  const auto codeOf = [](const auto& result) { return result.error().code; };
  const auto invalid = Error::Code::InvalidArgument;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(codeOf(client->setPose("k", {{1, 1, 0, 0}, {}})), invalid);
  EXPECT_EQ(codeOf(client->setPose("k", {{nan, 0, 0, 0}, {}})), invalid);
  EXPECT_EQ(codeOf(client->setPose("k", {{1, 0, 0, 0}, {nan, 0, 0}})), invalid);
  EXPECT_EQ(codeOf(client->setParameter("k", "p", nan)), invalid);
  EXPECT_EQ(codeOf(client->setParameter("k", "p", std::string(5000, 'x'))), invalid);
  EXPECT_EQ(codeOf(client->describe(std::string(300, 'k'))), invalid);
  EXPECT_EQ(codeOf(client->startRecording("k", "")), invalid);
  EXPECT_EQ(codeOf(client->subscribe("k", {.decimation = 0})), invalid);
  EXPECT_EQ(codeOf(client->subscribe("k", {.max_rate_hz = nan})), invalid);
  EXPECT_EQ(codeOf(client->subscribe("k", {.policy = Policy::Queue, .queue = 0})), invalid);
}

TEST(Client, NobodyListeningSaysWhatToDo) {
  std::string address;
  {
    FakeDaemon gone{FakeDaemon::On::Tcp, FakeDaemon::polite()};
    address = gone.address();
  }
  for (const std::string& where : {address, std::string{"unix:/nowhere/toftwin.sock"}}) {
    const auto client = Client::connect(where);
    ASSERT_FALSE(client);
    EXPECT_THAT(client.error().message, HasSubstr(where));
    EXPECT_THAT(client.error().message, HasSubstr("Start it with \"toftwind\""));
  }
}

TEST(DefaultSocket, FollowsTheEnvironment) {
  ::setenv("RUNTIME_DIRECTORY", "/run/a:/run/b", 1);
  EXPECT_EQ(defaultSocketPath(), "/run/a/toftwin.sock");
  ::unsetenv("RUNTIME_DIRECTORY");
  if (std::filesystem::is_directory("/run/toftwin")) GTEST_SKIP() << "a toftwind is installed here";
  ::setenv("XDG_RUNTIME_DIR", "/run/user/5", 1);
  EXPECT_EQ(defaultSocketPath(), "/run/user/5/toftwin.sock");
  ::unsetenv("XDG_RUNTIME_DIR");
  EXPECT_EQ(defaultSocketPath(), "/run/toftwin/toftwin.sock");
}

}  // namespace
}  // namespace toftwin
