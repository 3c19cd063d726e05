// SPDX-License-Identifier: Apache-2.0
#include "daemon/session.h"

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <limits>
#include <thread>

#include "fakes.h"
#include "protocol/wire/message_id.h"

namespace toftwin::daemon {
namespace {

using test::Counter;
using test::FakeClock;
using test::Remote;
using wire::Message;

/// A session without a socket on a hub with one fake camera, "cam".
struct Conversation {
  FakeClock clock;
  std::shared_ptr<Remote> remote = std::make_shared<Remote>();
  Counter woken;  // outlives the hub's threads, which count
  Hub hub;
  std::unique_ptr<Session> session;

  explicit Conversation(Session::Options options = {}, Hub::Options of_hub = {},
                        const std::function<void(Remote&)>& change = [](Remote&) {})
      : hub(std::move(of_hub), clock) {
    change(*remote);
    const auto open = test::opener(remote);
    hub.add(std::make_shared<SourceHost>("cam", open, open(), SourceHost::Options{}, clock));
    session = std::make_unique<Session>(hub, options, [this] { woken.add(); });
  }
  Message ask(const Message& request) {
    const auto answers = session->handle(request);
    EXPECT_EQ(answers.size(), 1u);
    return answers.empty() ? Message{} : answers.front();
  }
  void hello() { ask(wire::Hello{1, "test", {}}); }
  /// The next thing that the session sends by itself.
  Session::Outgoing later() {
    for (int seen = woken.count();; seen = woken.count()) {
      if (auto next = session->next()) return *std::move(next);
      if (!woken.reaches(seen + 1)) return Message{};
    }
  }
  Session::FrameOut frame() { return std::get<Session::FrameOut>(later()); }
  std::uint64_t subscribe(wire::Subscribe request = {.id = 7}) {
    request.source = "cam";
    return std::get<wire::Subscribed>(ask(request)).subscription;
  }
};

wire::Subscribe wish(wire::Policy policy, std::uint32_t queue = 0) {
  wire::Subscribe request{.id = 7};
  request.policy = policy;
  request.queue = queue;
  return request;
}

Error errorIn(const Message& message) {
  const auto* failure = std::get_if<wire::Failure>(&message);
  return failure == nullptr ? Error{Error::Code::Internal, "no failure"} : failure->error;
}

/// Waits until the source's thread has let go of its subscribers, too.
bool eventuallyUnused(const Budget& budget) {
  for (int i = 0; i < 30'000 && budget.used() > 0; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
  }
  return budget.used() == 0;
}

TEST(Session, MustBeginWithHello) {
  Conversation talk;
  EXPECT_EQ(errorIn(talk.ask(wire::ListSources{7})).code, Error::Code::Malformed);
  EXPECT_TRUE(talk.session->isOver());
  EXPECT_TRUE(talk.session->handle(wire::Hello{1, "late", {}}).empty());
}

TEST(Session, AnswersHelloWithItsFeatures) {
  Conversation talk{{.subscriptions = 16, .features = {"memfd"}}};
  const auto hello = std::get<wire::Hello>(talk.ask(wire::Hello{5, "test", {"other"}}));
  EXPECT_EQ(hello.id, 5u);
  EXPECT_EQ(hello.features, std::vector<std::string>{"memfd"});
  EXPECT_EQ(talk.session->client()->features, std::vector<std::string>{"other"});
  EXPECT_EQ(errorIn(talk.ask(wire::Hello{6, "again", {}})).code, Error::Code::Malformed);
  EXPECT_TRUE(talk.session->isOver());
}

TEST(Session, ListsAndDescribes) {
  Conversation talk;
  talk.hello();
  const auto list = std::get<wire::SourceList>(talk.ask(wire::ListSources{2}));
  ASSERT_EQ(list.sources.size(), 1u);
  EXPECT_EQ(list.sources[0].name, "cam");
  const auto description =
      std::get<wire::SourceDescription>(talk.ask(wire::DescribeSource{3, "cam"}));
  EXPECT_EQ(description.id, 3u);
  EXPECT_EQ(description.camera, talk.remote->info.camera);
  EXPECT_TRUE(description.can_lockstep);
}

/// A version of the protocol before 1.2 takes a plane of a later kind for damage, and closes.
TEST(Session, SendsAClientNoPlaneThatItsVersionDoesNotKnow) {
  for (std::uint16_t minor = 0; minor < 4; ++minor) {
    Conversation talk{{}, {}, [](Remote& remote) { remote.info.planes.push_back(PlaneKind::LightSigma); }};
    talk.ask(wire::Hello{1, "test", {}, minor});
    const auto description = std::get<wire::SourceDescription>(talk.ask(wire::DescribeSource{2, "cam"}));
    const std::ptrdiff_t expected = minor < 2 ? 0 : 1;
    EXPECT_EQ(std::ranges::count(description.planes, PlaneKind::LightSigma), expected) << minor;
    talk.subscribe();
    talk.remote->give();
    const auto out = talk.frame();
    EXPECT_NE(out.delivery.frame->frame.find(PlaneKind::Range), nullptr);
    EXPECT_NE(out.delivery.frame->frame.find(PlaneKind::Flags), nullptr);
    EXPECT_EQ(out.delivery.frame->frame.find(PlaneKind::LightSigma) != nullptr, minor >= 2) << minor;
  }
}

TEST(Session, AnUnknownSourceIsNamedWithThoseThatThereAre) {
  Conversation talk;
  talk.hello();
  const Error error = errorIn(talk.ask(wire::DescribeSource{3, "cma"}));
  EXPECT_EQ(error.code, Error::Code::NotFound);
  EXPECT_EQ(error.message, "there is no source \"cma\"; there are: cam");
  EXPECT_FALSE(talk.session->isOver());
}

TEST(Session, RefusesAFrameThatIsTooLargeToSendOrToHold) {
  const Hub::Options of_hub{.recording_folder = {}, .recording = {}, .backlog_bytes = 100ull << 20};
  Conversation talk{{}, of_hub, [](Remote& remote) {
                      remote.info.camera.width = remote.info.camera.height = 8192;  // 5 bytes a pixel
                    }};
  talk.hello();
  wire::Subscribe request = wish(wire::Policy::Latest);
  request.source = "cam";
  const Error too_large = errorIn(talk.ask(request));
  EXPECT_EQ(too_large.code, Error::Code::TooLarge);
  EXPECT_EQ(too_large.message.find("one frame has 320 MiB"), 0u) << too_large.message;
  request.region = {0, 0, 8192, 4096};  // 160 MiB
  EXPECT_TRUE(std::holds_alternative<wire::Subscribed>(talk.ask(request)));
  request.policy = wire::Policy::Lossless;
  const Error too_much = errorIn(talk.ask(request));
  EXPECT_EQ(too_much.code, Error::Code::TooLarge);
  EXPECT_NE(too_much.message.find("limits.subscription_backlog_mb"), std::string::npos) << too_much.message;
  request.decimation = 2;
  EXPECT_TRUE(std::holds_alternative<wire::Subscribed>(talk.ask(request)));
}

TEST(Session, WhatIsOnItsWayCountsAgainstTheDaemonsBudget) {
  // A frame of the fake camera has 40 bytes, and every frame 4096 beside: six fit.
  Conversation talk{{}, {.recording_folder = {}, .recording = {}, .total_bytes = 6 * 4200}};
  talk.hello();
  wire::Subscribe request = wish(wire::Policy::Queue, 100);
  request.window = 64;
  const auto id = talk.subscribe(request);
  talk.remote->give(20);
  ASSERT_TRUE(talk.remote->asked.reaches(21));
  int sent = 0;
  while (talk.session->next()) ++sent;
  EXPECT_GE(sent, 1);
  EXPECT_LT(sent, 6);
  EXPECT_LE(talk.hub.budget().used(), talk.hub.budget().limit());
  request.source = "cam";
  const Error full = errorIn(talk.ask(request));
  EXPECT_EQ(full.code, Error::Code::Busy);
  EXPECT_NE(full.message.find("limits.backlog_mb"), std::string::npos) << full.message;
  talk.ask(wire::Unsubscribe{9, id});
  EXPECT_TRUE(eventuallyUnused(talk.hub.budget()));
}

TEST(Session, SendsFramesOfItsSubscriptions) {
  Conversation talk;
  talk.hello();
  const auto id = talk.subscribe(wish(wire::Policy::Queue, 8));
  talk.remote->give(2);
  for (std::uint64_t i = 0; i < 2; ++i) {
    const auto out = talk.frame();
    EXPECT_EQ(out.subscription, id);
    EXPECT_EQ(out.delivery.frame->frame.sequence, i);
  }
}

TEST(Session, ServesItsSubscriptionsInTurn) {
  Conversation talk;
  talk.hello();
  const auto a = talk.subscribe(wish(wire::Policy::Queue, 8));
  const auto b = talk.subscribe(wish(wire::Policy::Queue, 8));
  talk.remote->give(4);
  ASSERT_TRUE(talk.remote->asked.reaches(5));  // all four are in the queues
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(talk.frame().subscription, a);
    EXPECT_EQ(talk.frame().subscription, b);
  }
}

TEST(Session, AcknowledgingLetsALockstepSourceGoOn) {
  Conversation talk;
  talk.hello();
  const auto id = talk.subscribe(wish(wire::Policy::Lockstep));
  talk.remote->give(2);
  EXPECT_EQ(talk.frame().delivery.frame->frame.sequence, 0u);
  EXPECT_TRUE(talk.session->handle(wire::Acknowledge{id, 0}).empty());
  EXPECT_EQ(talk.frame().delivery.frame->frame.sequence, 1u);
}

TEST(Session, AcknowledgingWhatWasNotSentDoesNotMakeALockstepSourceGoOn) {
  Conversation talk;
  talk.hello();
  const auto id = talk.subscribe(wish(wire::Policy::Lockstep));
  talk.remote->give(3);
  constexpr auto kLast = std::numeric_limits<std::uint64_t>::max();
  ASSERT_TRUE(talk.remote->asked.reaches(1));
  EXPECT_TRUE(talk.session->handle(wire::Acknowledge{id, 0}).empty());  // made, perhaps; not sent
  EXPECT_EQ(talk.frame().delivery.frame->frame.sequence, 0u);
  EXPECT_TRUE(talk.session->handle(wire::Acknowledge{id, 1}).empty());
  EXPECT_TRUE(talk.session->handle(wire::Acknowledge{id, kLast}).empty());
  // A command is done between frames: after it, a frame that was due would have been made.
  for (std::uint64_t i = 1; i <= 3; ++i) {
    talk.session->handle(wire::SetPose{i, "cam", {}});
    EXPECT_EQ(std::get<wire::Done>(std::get<Message>(talk.later())).id, i);
  }
  EXPECT_EQ(talk.hub.health().sources.at(0).frames, 1u);
  EXPECT_TRUE(talk.session->handle(wire::Acknowledge{id, 0}).empty());
  EXPECT_EQ(talk.frame().delivery.frame->frame.sequence, 1u);
}

TEST(Session, CommandsAreAnsweredWhenTheSourceHasDoneThem) {
  Conversation talk;
  talk.hello();
  EXPECT_TRUE(talk.session->handle(wire::SetPose{11, "cam", {}}).empty());
  EXPECT_EQ(std::get<wire::Done>(std::get<Message>(talk.later())).id, 11u);
  EXPECT_TRUE(talk.session->handle(wire::SetParameter{12, "cam", "gain", 2.0}).empty());
  const auto failure = std::get<wire::Failure>(std::get<Message>(talk.later()));
  EXPECT_EQ(failure.id, 12u);
  EXPECT_EQ(failure.error.code, Error::Code::Unsupported);
  talk.session->handle(wire::SetParameter{13, "cam", "amplitude", 2.0, "far"});
  EXPECT_EQ(std::get<wire::Failure>(std::get<Message>(talk.later())).error.code, Error::Code::Unsupported)
      << "the number beside a text is not set";
}

TEST(Session, UnsubscribingStopsTheSource) {
  Conversation talk;
  talk.hello();
  const auto id = talk.subscribe();
  ASSERT_TRUE(talk.remote->started.reaches(1));
  EXPECT_EQ(std::get<wire::Done>(talk.ask(wire::Unsubscribe{4, id})).id, 4u);
  ASSERT_TRUE(talk.remote->stopped.reaches(1));
  EXPECT_EQ(errorIn(talk.ask(wire::Unsubscribe{5, id})).code, Error::Code::NotFound);
}

TEST(Session, ThatEndsLeavesNothingBehind) {
  Conversation talk;
  talk.hello();
  talk.subscribe();
  ASSERT_TRUE(talk.remote->started.reaches(1));
  EXPECT_EQ(talk.hub.health().sessions, 1u);
  EXPECT_EQ(talk.hub.health().sources.at(0).subscribers, 1u);
  talk.session.reset();
  ASSERT_TRUE(talk.remote->stopped.reaches(1));
  EXPECT_EQ(talk.hub.health().sessions, 0u);
  EXPECT_EQ(talk.hub.health().sources.at(0).subscribers, 0u);
}

TEST(Session, ASourceThatWasTakenOutIsClosedByWhoeverTookItOut) {
  Conversation talk;
  const auto held = *talk.hub.find("cam");  // as a session's subscription does
  std::atomic<bool> is_over = false;
  Counter in_driver;
  held->post(
      [&](auto&) {
        in_driver.add();
        std::this_thread::sleep_for(std::chrono::milliseconds{50});
        is_over = true;
        return Result<>{};
      },
      [](const Result<>&) {});
  ASSERT_TRUE(in_driver.reaches(1));
  talk.hub.remove("cam").clear();
  EXPECT_TRUE(is_over) << "the last to let go would have to wait for the driver";
}

TEST(Session, TellsWhyASubscriptionEnded) {
  Conversation talk;
  talk.hello();
  const auto id = talk.subscribe();
  talk.remote->give({Error::Code::EndOfStream, "no more"});
  const auto ended = std::get<wire::SubscriptionEnded>(std::get<Message>(talk.later()));
  EXPECT_EQ(ended.subscription, id);
  EXPECT_EQ(ended.reason.code, Error::Code::EndOfStream);
}

TEST(Session, HasABoundOnSubscriptions) {
  Conversation talk{{.subscriptions = 2, .features = {}}};
  talk.hello();
  talk.subscribe();
  talk.subscribe();
  wire::Subscribe third{.id = 7};
  third.source = "cam";
  EXPECT_EQ(errorIn(talk.ask(third)).code, Error::Code::Busy);
}

TEST(Session, RefusesWishesThatMakeNoSense) {
  Conversation talk;
  talk.hello();
  const auto refuses = [&](auto change) {
    wire::Subscribe request{.id = 7};
    request.source = "cam";
    change(request);
    return errorIn(talk.ask(request)).code == Error::Code::InvalidArgument;
  };
  EXPECT_TRUE(refuses([](auto& r) { r = wish(wire::Policy::Queue, 0), r.source = "cam"; }));
  EXPECT_TRUE(refuses([](auto& r) { r = wish(wire::Policy::Queue, 1025), r.source = "cam"; }));
  EXPECT_TRUE(refuses([](auto& r) { r.window = 65; }));
  EXPECT_FALSE(refuses([](auto& r) { r.window = 64; }));
  EXPECT_TRUE(refuses([](auto& r) { r.max_rate_hz = -1; }));
  EXPECT_TRUE(refuses([](auto& r) { r.max_rate_hz = std::numeric_limits<double>::quiet_NaN(); }));
  EXPECT_TRUE(refuses([](auto& r) { r.max_rate_hz = 5, r.policy = wire::Policy::Lockstep; }));
  EXPECT_TRUE(refuses([](auto& r) { r.region = {3, 0, 2, 2}; }));
  EXPECT_TRUE(refuses([](auto& r) { r.decimation = 0; }));
  EXPECT_TRUE(refuses([](auto& r) { r.planes = {PlaneKind::Depth}; }));
}

TEST(Session, ADaemonsMessageFromAClientBreaksTheProtocol) {
  Conversation talk;
  talk.hello();
  EXPECT_EQ(errorIn(talk.ask(wire::FrameMessage{})).code, Error::Code::Malformed);
  EXPECT_TRUE(talk.session->isOver());
}

TEST(Session, ARequestHasAnId) {
  Conversation talk;
  talk.hello();
  const Message answer = talk.ask(wire::ListSources{0});
  EXPECT_EQ(errorIn(answer).message, "the id of a request must not be 0");
  EXPECT_EQ(wire::idOf(answer), 0u);
  EXPECT_TRUE(talk.session->isOver());
}

TEST(Session, TheIdOfARequestIsFreeWhenItIsAnswered) {
  Conversation talk;
  talk.hello();
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(talk.session->handle(wire::SetPose{11, "cam", {}}).empty());
    EXPECT_EQ(wire::idOf(std::get<Message>(talk.later())), 11u);
  }
  EXPECT_EQ(talk.session->owed(), 0u);
  EXPECT_TRUE(talk.session->handle(wire::SetPose{12, "cam", {}}).empty());
  EXPECT_EQ(errorIn(talk.ask(wire::ListSources{12})).message, "the id 12 is that of a request that is not answered yet");
  EXPECT_TRUE(talk.session->isOver());
}

TEST(Session, ARecordingIsStoppedByWhoeverBeganItOrAnAdministrator) {
  const std::filesystem::path folder = testing::TempDir() + "toftwin_owned_recording";
  std::filesystem::remove_all(folder);
  const auto of = [](const char* name, bool is_admin) {
    return Session::Options{.features = {},
                            .who = {.name = name, .text = name},
                            .identify = [=](const wire::Hello&) -> Result<Identity> {
                              return Identity{name, {.view = true, .control = true, .record = true, .admin = is_admin}};
                            }};
  };
  Conversation owner{of("user 1", false), {.recording_folder = folder, .recording = {}}};
  owner.hello();
  const auto stopBy = [&](Session::Options options) {
    Session session{owner.hub, std::move(options), [&] { owner.woken.add(); }};
    session.handle(wire::Hello{1, "test", {}});
    session.handle(wire::Record{2, "cam", ""});
    for (int seen = owner.woken.count();; seen = owner.woken.count()) {
      if (auto answer = session.next()) return std::get<Message>(*std::move(answer));
      if (!owner.woken.reaches(seen + 1)) return Message{};
    }
  };
  const auto begin = [&](const char* file) {
    owner.session->handle(wire::Record{3, "cam", file});
    return std::holds_alternative<wire::Done>(std::get<Message>(owner.later()));
  };
  ASSERT_TRUE(begin("a"));
  EXPECT_EQ(owner.hub.health().sources.at(0).recording_by, "user 1");
  const Error refused = errorIn(stopBy(of("user 2", false)));
  EXPECT_EQ(refused.code, Error::Code::PermissionDenied);
  EXPECT_NE(refused.message.find("belongs to user 1"), std::string::npos) << refused.message;
  EXPECT_TRUE(std::holds_alternative<wire::Done>(stopBy(of("user 1", false)))) << "another client of the same user";
  ASSERT_TRUE(begin("b"));
  EXPECT_TRUE(std::holds_alternative<wire::Done>(stopBy(of("user 3", true))));
  std::filesystem::remove_all(folder);
}

TEST(Session, RecordingWithoutAFolderIsRefusedWithTheKeyToSet) {
  Conversation talk;
  talk.hello();
  EXPECT_TRUE(talk.session->handle(wire::Record{3, "cam", "a"}).empty());
  const auto failure = std::get<wire::Failure>(std::get<Message>(talk.later()));
  EXPECT_NE(failure.error.message.find("recording_folder"), std::string::npos);
}

}  // namespace
}  // namespace toftwin::daemon
