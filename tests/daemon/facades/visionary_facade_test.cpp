// SPDX-License-Identifier: Apache-2.0
// The Visionary facade in a running daemon, with bare sockets as its clients.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <cmath>
#include <optional>
#include <string>

#include "drivers/visionary/wire/blob.h"
#include "drivers/visionary/wire/cola2.h"
#include "drivers/visionary/wire/password.h"
#include "drivers/visionary/wire/timestamp.h"
#include "facade_testing.h"

namespace toftwin::daemon {
namespace {

using namespace test;
using boost::asio::ip::tcp;
using toftwin::visionary::Bytes;
using toftwin::visionary::ColaCommand;
using toftwin::visionary::ColaError;
using toftwin::visionary::Description;
using toftwin::visionary::Reader;
using toftwin::visionary::ReadImages;
using toftwin::visionary::Telegram;
using toftwin::visionary::UserLevel;
using toftwin::visionary::Writer;
using Kind = ColaCommand::Kind;
using Policy = SubscribeOptions::Policy;

/// Blocking; the test's time limit is its patience.
class Socket {
 public:
  explicit Socket(std::uint16_t port) { socket_.connect({boost::asio::ip::address_v4::loopback(), port}); }
  void send(const Bytes& bytes) { boost::asio::write(socket_, boost::asio::buffer(bytes)); }
  /// Empty: the other side closed.
  Bytes receive() {
    Bytes piece(65'536);
    boost::system::error_code end;
    piece.resize(socket_.read_some(boost::asio::buffer(piece), end));
    return piece;
  }

 private:
  boost::asio::io_context io_;
  tcp::socket socket_{io_};
};

class Control {
 public:
  explicit Control(std::uint16_t port) : socket_(port) {
    ask({.kind = Kind::Open, .name = {}, .params = Writer{}.number(std::uint8_t{5}).text("test").bytes()});
  }
  toftwin::visionary::ColaAnswer ask(const ColaCommand& command) {
    socket_.send(encode(Telegram{session_, ++request_, askedOf(command)}));
    while (true) {
      const auto reply = reader_.next();
      if (reply.ok() && *reply) {
        session_ = (*reply)->session;
        EXPECT_EQ((*reply)->request, request_);
        if (command.kind == Kind::Open) return {};
        const auto answer = toftwin::visionary::readAnswer((*reply)->command, command);
        EXPECT_TRUE(answer.ok());
        return answer ? *answer : toftwin::visionary::ColaAnswer{};
      }
      const Bytes piece = socket_.receive();
      if (piece.empty()) return {.error = ColaError::Unknown};
      reader_.feed(piece);
    }
  }
  toftwin::visionary::ColaAnswer call(std::string name, Bytes params = {}) {
    return ask({.kind = Kind::Call, .name = std::move(name), .params = std::move(params)});
  }
  toftwin::visionary::ColaAnswer write(std::string name, Bytes params) {
    return ask({.kind = Kind::Write, .name = std::move(name), .params = std::move(params)});
  }
  toftwin::visionary::ColaAnswer read(std::string name) {
    return ask({.kind = Kind::Read, .name = std::move(name)});
  }
  void logIn() {
    const auto told = call("GetChallenge").told;
    ASSERT_EQ(told.size(), 17u);
    std::array<std::uint8_t, 16> challenge{};
    for (std::size_t i = 0; i < challenge.size(); ++i)
      challenge[i] = std::to_integer<std::uint8_t>(told[i + 1]);
    Writer writer;
    for (const auto one :
         toftwin::visionary::responseTo(challenge, {}, UserLevel::AuthorizedClient, "CLIENT"))
      writer.number(one);
    EXPECT_EQ(call("SetUserLevel", writer.number(std::uint8_t{3}).bytes()).told, Bytes{std::byte{0}});
  }

 private:
  Socket socket_;
  toftwin::visionary::TelegramReader reader_{1 << 20};
  std::uint32_t session_ = 0;
  std::uint16_t request_ = 0;
};

struct Received {
  Description description;
  ReadImages images;
};
class Stream {
 public:
  explicit Stream(std::uint16_t port) : socket_(port) {}
  /// Nothing: the other side closed.
  std::optional<Received> next() {
    while (true) {
      const auto message = reader_.next();
      if (message.ok() && *message) return read(**message);
      const Bytes piece = socket_.receive();
      if (piece.empty()) return std::nullopt;
      reader_.feed(piece);
    }
  }

 private:
  static std::optional<Received> read(const Bytes& message) {
    const auto blob = toftwin::visionary::readBlob(message);
    EXPECT_TRUE(blob.ok()) << blob.error().message;
    auto description = toftwin::visionary::readDescription(toftwin::visionary::textOf(blob->xml));
    EXPECT_TRUE(description.ok()) << description.error().message;
    auto images = toftwin::visionary::readImages(blob->data, *description);
    EXPECT_TRUE(images.ok()) << images.error().message;
    return Received{*std::move(description), *std::move(images)};
  }
  Socket socket_;
  toftwin::visionary::BlobReader reader_{8 << 20};
};

class VisionaryFacade : public RunningFacade {
 protected:
  void startVisionary(const std::string& source_keys, const std::string& facade_keys = {}) {
    control_ = freePort();
    stream_ = freePort();
    start(fmt::format(
        "[[source]]\nname = 'cam'\n{}\n[[facade]]\nkind = 'visionary'\nsource = 'cam'\ncontrol_port = {}\n"
        "stream_port = {}\n{}\n",
        source_keys, control_, stream_, facade_keys));
    EXPECT_TRUE(eventually([&] {
      boost::asio::io_context io;
      tcp::socket socket{io};
      boost::system::error_code error;
      socket.connect({boost::asio::ip::address_v4::loopback(), control_}, error);
      return !error;
    }));
  }
  double exposure() {
    const auto described = client().describe("cam");
    for (const Parameter& one : described->parameters) {
      if (one.name == "exposure_us") return one.value.value_or(0.0);
    }
    return -1.0;
  }
  std::uint16_t control_ = 0, stream_ = 0;
};

TEST_F(VisionaryFacade, StreamsWhenItIsSwitchedOnAndStopsAndSteps) {
  startVisionary(kPattern);
  Control control{control_};
  Stream stream{stream_};
  const auto first = stream.next();
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->description.width, 64);
  EXPECT_FALSE(control.call("PLAYSTOP").error);
  Stream after{stream_};
  EXPECT_FALSE(control.call("PLAYBURST", Writer{}.number(std::uint16_t{2}).bytes()).error);
  const auto one = after.next(), two = after.next();
  ASSERT_TRUE(one && two);
  EXPECT_EQ(*two->images.frame_number, *one->images.frame_number + 1);
  EXPECT_FALSE(control.call("PLAYSTART").error);
  EXPECT_GT(*after.next()->images.frame_number, *two->images.frame_number);
}

TEST_F(VisionaryFacade, AClientThatIsLoggedInSetsTheSource) {
  startVisionary(kSmallSim);
  Control control{control_};
  const Bytes wanted = Writer{}.number(std::uint32_t{700}).bytes();
  EXPECT_EQ(control.write("integrationTimeUs", wanted).error, ColaError::WriteDenied);
  control.logIn();
  EXPECT_FALSE(control.write("integrationTimeUs", wanted).error);
  EXPECT_EQ(exposure(), 700.0);
  EXPECT_EQ(Reader{control.read("integrationTimeUs").told}.number<std::uint32_t>(), 700u);
}

TEST_F(VisionaryFacade, GarbageEndsItsConnectionAndNoOther) {
  startVisionary(kPattern);
  Control control{control_};
  Socket garbage{control_};
  garbage.send(Writer{}.number(0x0202'0202U).number(0xFFFF'FFFFU).bytes());
  EXPECT_TRUE(garbage.receive().empty());
  EXPECT_FALSE(control.read("DeviceIdent").error);
}

TEST_F(VisionaryFacade, ACutLineEndsTheStream) {
  startVisionary(kPattern, "[facade.line]\ndisconnect = 0.2\nseed = 2\n");
  Stream stream{stream_};
  int frames = 0;
  while (stream.next()) ++frames;
  EXPECT_LT(frames, 100);
}

// ---- one truth -----------------------------------------------------------------------------------

void expectSame(const Frame& native, const Received& through) {
  const auto range_m = native.find(PlaneKind::Range)->as<float>();
  const auto amplitude = native.find(PlaneKind::Amplitude)->as<float>();
  const auto flags = native.find(PlaneKind::Flags)->as<std::uint8_t>();
  ASSERT_EQ(through.images.distance.size(), range_m.size());
  std::size_t with_value = 0;
  for (std::size_t i = 0; i < range_m.size(); ++i) {
    const double counts = std::round(4000.0 * static_cast<double>(range_m[i]));
    const bool is_valid = (flags[i] & 1U) == 0 && counts >= 1.0 && counts < 65'535.0;
    ASSERT_EQ(through.images.distance[i], is_valid ? static_cast<std::uint16_t>(counts) : 0) << i;
    ASSERT_EQ(through.images.state[i], is_valid ? flags[i] : flags[i] | 1U) << i;
    ASSERT_EQ(through.images.intensity[i],
              static_cast<std::uint16_t>(std::min(65'535.0, std::round(static_cast<double>(amplitude[i])))))
        << i;
    with_value += is_valid ? 1 : 0;
  }
  EXPECT_GT(with_value, range_m.size() / 2);
}

TEST_F(VisionaryFacade, FramesAreTheNativeOnesAfterTheDocumentedConversion) {
  startVisionary(kPattern);
  auto native_client = client();
  auto subscribed = native_client.subscribe("cam", {.policy = Policy::Queue, .queue = 64});
  ASSERT_TRUE(subscribed.ok()) << subscribed.error().message;
  Natives natives{*std::move(subscribed),
                  [](const Frame& frame) { return static_cast<std::int64_t>(frame.sequence); }};
  Stream stream{stream_};
  int compared = 0;
  for (int i = 0; i < 60 && compared < 5; ++i) {
    const auto through = stream.next();
    ASSERT_TRUE(through.has_value());
    const auto native = natives.at(*through->images.frame_number);
    ASSERT_TRUE(native.ok()) << native.error().message;
    if (*native == nullptr) continue;
    ASSERT_NO_FATAL_FAILURE(expectSame(**native, *through));
    const auto& moment = (*native)->moment;
    const std::int64_t ns = moment.clock.uncertainty_ns >= 0
                                ? moment.exposures.at(0).start.ns + moment.clock.host_minus_device_ns
                                : moment.received.ns;
    EXPECT_EQ(toftwin::visionary::unixTime_ms(through->images.packed_time), ns / 1'000'000);
    ++compared;
  }
  EXPECT_EQ(compared, 5);
}

}  // namespace
}  // namespace toftwin::daemon
