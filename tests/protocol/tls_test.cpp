// SPDX-License-Identifier: Apache-2.0
// Certificates of a small authority, and messages over TLS between two sockets on loopback.
#include "protocol/transport/tls.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "example_messages.h"
#include "message_json.h"
#include "protocol/transport/certificates.h"
#include "protocol/transport/framed_socket.h"

namespace toftwin::transport {
namespace {

namespace asio = boost::asio;
using testing::HasSubstr;

class Tls : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = testing::TempDir() + "tlsXXXXXX";
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    for (const char* authority : {"ours", "others"}) {
      ASSERT_TRUE(makeAuthority(folder_ / authority, authority, 30).ok());
      ASSERT_TRUE(makeCertificate(folder_ / authority, {.name = "dock", .hosts = {"localhost", "127.0.0.1"}}).ok());
      ASSERT_TRUE(makeCertificate(folder_ / authority, {.name = "plc"}).ok());
    }
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] TlsFiles files(const std::string& name, const std::string& of = "ours", const std::string& trusts = "ours") const {
    const auto own = folder_ / of;
    if (name.empty()) return {{}, {}, folder_ / trusts / "authority.pem"};
    return {own / (name + ".pem"), own / (name + ".key"), folder_ / trusts / "authority.pem"};
  }
  struct Ends {
    std::unique_ptr<FramedSocket> server, client;
    std::optional<Result<>> of_server, of_client;
    [[nodiscard]] bool agreed() const { return of_server->ok() && of_client->ok(); }
  };
  /// Until both ends know.
  std::unique_ptr<Ends> connect(const TlsFiles& server, const TlsFiles& client, const std::string& host = "localhost",
                                bool needs_certificate = false, std::shared_ptr<const TlsContext> shared = nullptr) {
    const auto for_server = shared ? Result<std::shared_ptr<const TlsContext>>{std::move(shared)}
                                   : TlsContext::forServer(server, needs_certificate);
    const auto for_client = TlsContext::forClient(client);
    EXPECT_TRUE(for_server.ok() && for_client.ok());
    asio::ip::tcp::acceptor acceptor{io_, {asio::ip::address_v4::loopback(), 0}};
    asio::ip::tcp::socket socket{io_};
    socket.connect(acceptor.local_endpoint());
    auto ends = std::make_unique<Ends>();
    ends->server = std::make_unique<FramedSocket>(Socket{acceptor.accept()});
    ends->client = std::make_unique<FramedSocket>(Socket{std::move(socket)});
    ends->server->asyncEncrypt(*for_server, {}, [&e = *ends](Result<> result) {
      e.of_server = std::move(result);
      if (!*e.of_server) e.server->close();
    });
    ends->client->asyncEncrypt(*for_client, host, [&e = *ends](Result<> result) {
      e.of_client = std::move(result);
      if (!*e.of_client) e.client->close();
    });
    runUntil([&] { return ends->of_server && ends->of_client; });
    return ends;
  }
  template <class Condition>
  void runUntil(Condition holds) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds{30};
    io_.restart();
    while (!holds() && io_.run_one_until(deadline) > 0) {
    }
    ASSERT_TRUE(holds());
  }
  /// What comes out at the other end.
  wire::Message sent(FramedSocket& from, FramedSocket& to, const wire::Message& message) {
    std::optional<Result<wire::Message>> received;
    bool is_written = false;
    to.asyncRead([&](Result<wire::Message> result) { received = std::move(result); });
    from.asyncWrite(*wire::encode(message), [&](const Result<>& result) { is_written = result.ok(); });
    runUntil([&] { return received && is_written; });
    EXPECT_TRUE(received->ok());
    return **std::move(received);
  }

  std::filesystem::path folder_;
  asio::io_context io_;
};

TEST_F(Tls, CarriesEveryKindOfMessageBothWays) {
  const auto ends = connect(files("dock"), files(""));
  ASSERT_TRUE(ends->agreed());
  for (const auto& [name, message] : wire::exampleMessages()) {
    EXPECT_EQ(toJson(sent(*ends->server, *ends->client, message)), toJson(message)) << name;
    EXPECT_EQ(toJson(sent(*ends->client, *ends->server, message)), toJson(message)) << name;
  }
  const wire::Message large = wire::FrameMessage{1, wire::exampleFrame(1024, 1024)};
  EXPECT_EQ(toJson(sent(*ends->server, *ends->client, large)), toJson(large));
}

TEST_F(Tls, BodiesOfEverySizeAroundRecordsAndPartsArriveWhole) {
  const auto ends = connect(files("dock"), files(""));
  ASSERT_TRUE(ends->agreed());
  constexpr int kRow = 64, kRecord = (16 << 10) / kRow, kPart = (256 << 10) / kRow;  // bytes, rows, rows
  for (const int rows : {1, kRecord - 1, kRecord, kRecord + 1, 3 * kRecord, kPart - 2, kPart - 1, kPart, kPart + 1, 2 * kPart, 5 * kPart + 7}) {
    wire::FrameMessage message{1, wire::exampleFrame(8, 8)};
    std::vector<std::uint8_t> numbers(static_cast<std::size_t>(rows) * kRow);
    for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = static_cast<std::uint8_t>(i * 2654435761u >> 24);
    message.frame.camera.width = kRow, message.frame.camera.height = rows;
    message.frame.planes = {{PlaneKind::Flags, ElementType::U8, kRow, rows, 1, Buffer::adopt(numbers)}};
    const wire::Message came = sent(*ends->server, *ends->client, message);
    const auto& frame = std::get<wire::FrameMessage>(came).frame;
    EXPECT_TRUE(std::ranges::equal(frame.planes.at(0).as<std::uint8_t>(), numbers)) << rows << " rows";
  }
}

TEST_F(Tls, BothDirectionsAreUsedAtOnce) {
  const auto ends = connect(files("dock"), files(""));
  ASSERT_TRUE(ends->agreed());
  const wire::Message large = wire::FrameMessage{1, wire::exampleFrame(1024, 768)};
  int arrived = 0, written = 0;
  for (auto* side : {ends->server.get(), ends->client.get()}) {
    side->asyncRead([&](const Result<wire::Message>& result) { arrived += result.ok() ? 1 : 0; });
    side->asyncWrite(*wire::encode(large), [&](const Result<>& result) { written += result.ok() ? 1 : 0; });
  }
  runUntil([&] { return arrived == 2 && written == 2; });
}

TEST_F(Tls, FramesOfOneDaemonToSeveralClientsArriveWholeWhileTheyAsk) {
  constexpr int kClients = 4, kRounds = 3;
  const auto shared = TlsContext::forServer(files("dock"), false);
  ASSERT_TRUE(shared);
  std::vector<std::unique_ptr<Ends>> all;
  for (int i = 0; i < kClients; ++i) all.push_back(connect(files("dock"), files(""), "localhost", false, *shared));
  const wire::Message large = wire::FrameMessage{1, wire::exampleFrame(1024, 768)};
  const std::string expected = toJson(large);
  const wire::Message question = wire::exampleMessages().front().message;
  for (int round = 0; round < kRounds; ++round) {
    int arrived = 0, asked = 0, written = 0;
    for (auto& ends : all) {
      ends->client->asyncRead([&](const Result<wire::Message>& result) { arrived += result && toJson(*result) == expected ? 1 : 0; });
      ends->server->asyncRead([&](const Result<wire::Message>& result) { asked += result ? 1 : 0; });
      ends->server->asyncWrite(*wire::encode(large), [&](const Result<>& result) { written += result ? 1 : 0; });
      ends->client->asyncWrite(*wire::encode(question), [&](const Result<>& result) { written += result ? 1 : 0; });
    }
    runUntil([&] { return arrived == kClients && asked == kClients && written == 2 * kClients; });
  }
}

TEST_F(Tls, AByteThatWasChangedOnTheWayEndsTheConnection) {
  const auto ends = connect(files("dock"), files(""));
  ASSERT_TRUE(ends->agreed());
  std::optional<Result<wire::Message>> received;
  ends->client->asyncRead([&](Result<wire::Message> result) { received = std::move(result); });
  const std::array<unsigned char, 40> forged{23, 3, 3, 0, 35};  // a record that the key did not make
  boost::system::error_code fault;
  ends->server->socket().send(asio::buffer(forged), 0, fault);
  runUntil([&] { return received.has_value(); });
  ASSERT_FALSE(*received);
  EXPECT_EQ(received->error().code, Error::Code::Disconnected);
}

TEST_F(Tls, APeerThatGoesAwayInTheMiddleIsGone) {
  const auto ends = connect(files("dock"), files(""));
  ASSERT_TRUE(ends->agreed());
  std::optional<Result<>> written;
  ends->server->asyncWrite(*wire::encode(wire::FrameMessage{1, wire::exampleFrame(2048, 2048)}), [&](Result<> result) { written = std::move(result); });
  ends->client->close();
  runUntil([&] { return written.has_value(); });
  EXPECT_FALSE(*written);
}

TEST_F(Tls, TellsTheNameOfAClientThatShowsACertificateOfTheAuthority) {
  EXPECT_EQ(connect(files("dock"), files("plc"))->server->certifiedName(), "plc");
  EXPECT_EQ(connect(files("dock"), files(""))->server->certifiedName(), "");
  EXPECT_EQ(connect(files("dock"), files("plc"))->client->certifiedName(), "dock");
}

TEST_F(Tls, AClientRefusesADaemonOfAnotherAuthorityOrName) {
  const auto stranger = connect(files("dock", "others"), files(""));
  ASSERT_FALSE(stranger->of_client->ok());
  EXPECT_EQ(stranger->of_client->error().code, Error::Code::PermissionDenied);
  EXPECT_FALSE(connect(files("dock"), files(""), "gate")->of_client->ok());
  EXPECT_FALSE(connect(files("plc"), files(""))->of_client->ok()) << "a client's certificate is no daemon's";
}

TEST_F(Tls, ADaemonRefusesAClientOfAnotherAuthority) {
  EXPECT_FALSE(connect(files("dock"), files("plc", "others"))->of_server->ok());
  EXPECT_FALSE(connect(files("dock"), files(""), "localhost", true)->of_server->ok()) << "which must have one";
}

TEST_F(Tls, WhatCannotBeUsedIsNamed) {
  const TlsFiles missing{folder_ / "none.pem", folder_ / "none.key", {}};
  EXPECT_THAT(TlsContext::forServer(missing, false).error().message, HasSubstr("none.pem: cannot be used as a certificate"));
  const TlsFiles mixed{folder_ / "ours/dock.pem", folder_ / "ours/plc.key", {}};
  EXPECT_THAT(TlsContext::forServer(mixed, false).error().message, HasSubstr("plc.key: cannot be used as the key"));
}

TEST_F(Tls, NoFileOfAnAuthorityIsOverwrittenAndKeysAreForTheirOwner) {
  EXPECT_THAT(makeAuthority(folder_ / "ours", "again", 30).error().message, HasSubstr("is there already"));
  EXPECT_THAT(makeCertificate(folder_ / "ours", {.name = "plc"}).error().message, HasSubstr("is there already"));
  EXPECT_EQ(makeCertificate(folder_ / "ours", {.name = "../plc"}).error().code, Error::Code::InvalidArgument);
  EXPECT_EQ(makeCertificate(folder_, {.name = "plc"}).error().code, Error::Code::NotFound);
  EXPECT_EQ(makeCertificate(folder_ / "ours", {.name = "x", .hosts = {"1.2.3"}}).error().code, Error::Code::InvalidArgument);
  struct stat about {};
  ASSERT_EQ(::stat((folder_ / "ours/authority.key").c_str(), &about), 0);
  EXPECT_EQ(about.st_mode & 0777, 0600u);
}

}  // namespace
}  // namespace toftwin::transport
