// SPDX-License-Identifier: Apache-2.0
#include "protocol/transport/framed_socket.h"

#include <gmock/gmock.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/connect_pair.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/write.hpp>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <iterator>

#include "example_messages.h"
#include "message_json.h"
#include "protocol/wire/crc32c.h"

namespace toftwin::transport {
namespace {

namespace asio = boost::asio;
using testing::HasSubstr;

class Connection : public testing::TestWithParam<bool> {
 protected:
  std::pair<Socket, Socket> connect() {
    if (GetParam()) return connectLocal();
    asio::ip::tcp::acceptor acceptor{io_, {asio::ip::address_v4::loopback(), 0}};
    asio::ip::tcp::socket client{io_};
    client.connect(acceptor.local_endpoint());
    return {Socket{std::move(client)}, Socket{acceptor.accept()}};
  }
  std::pair<Socket, Socket> connectLocal() {
    asio::local::stream_protocol::socket a{io_}, b{io_};
    asio::local::connect_pair(a, b);
    return {Socket{std::move(a)}, Socket{std::move(b)}};
  }
  Result<wire::Message> receive(FramedSocket& socket) {
    Result<wire::Message> received = Error{Error::Code::Internal, "the handler was not called"};
    socket.asyncRead([&](Result<wire::Message> message) { received = std::move(message); });
    io_.restart();
    io_.run();
    return received;
  }
  static void ignore(const Result<>&) {}

  asio::io_context io_;
};

INSTANTIATE_TEST_SUITE_P(TcpAndUnix, Connection, testing::Bool(),
                         [](const auto& test) { return test.param ? "Unix" : "Tcp"; });

TEST_P(Connection, EveryMessageArrivesInOrder) {
  auto ends = connect();
  FramedSocket here{std::move(ends.first)}, there{std::move(ends.second)};
  const auto examples = wire::exampleMessages();
  std::size_t next = 0;
  std::function<void(Result<>)> send_next = [&](Result<> result) {
    ASSERT_TRUE(result);
    if (next < examples.size()) here.asyncWrite(*wire::encode(examples[next++].message), send_next);
  };
  send_next({});
  for (const auto& [name, message] : examples) {
    const auto received = receive(there);
    ASSERT_TRUE(received) << name << ": " << received.error().message;
    EXPECT_EQ(wire::toJson(*received), wire::toJson(message)) << name;
  }
}

TEST_P(Connection, AMessageMayArriveByteByByte) {
  auto ends = connect();
  Socket here = std::move(ends.first);
  FramedSocket there{std::move(ends.second)};
  if (GetParam()) there.acceptSharedBodies();  // the other way of receiving
  const wire::Message message = wire::FrameMessage{1, wire::exampleFrame(5, 3)};
  const auto bytes = wire::toBytes(*wire::encode(message));
  std::optional<Result<wire::Message>> received;
  there.asyncRead([&](Result<wire::Message> read) { received = std::move(read); });
  for (const std::byte& byte : bytes) {
    ASSERT_FALSE(received);
    asio::write(here, asio::buffer(&byte, 1));
    io_.restart();
    while (io_.poll() > 0) io_.restart();
  }
  io_.restart();
  io_.run();
  ASSERT_TRUE(received && *received) << received->error().message;
  EXPECT_EQ(wire::toJson(**received), wire::toJson(message));
}

TEST_P(Connection, ALargeFrameCrosses) {
  auto ends = connect();
  FramedSocket here{std::move(ends.first)}, there{std::move(ends.second)};
  const wire::Message message = wire::FrameMessage{1, wire::exampleFrame(512, 424)};
  here.asyncWrite(*wire::encode(message), ignore);
  const auto received = receive(there);
  ASSERT_TRUE(received) << received.error().message;
  EXPECT_EQ(wire::toBytes(*wire::encode(*received)), wire::toBytes(*wire::encode(message)));
}

TEST_P(Connection, ASmallMessageBehindALargeFrameIsNotWaitedForLonger) {
  auto ends = connect();
  Socket here = std::move(ends.first);
  FramedSocket there{std::move(ends.second)};
  const auto frame = wire::toBytes(*wire::encode(wire::FrameMessage{1, wire::exampleFrame(512, 424)}));
  const auto small = wire::toBytes(*wire::encode(wire::Subscribed{2, 3}));
  // All but the last few bytes, which come when the receiver waits for them, and then the small message.
  const std::array<std::size_t, 3> parts{frame.size() - 1000, 999, 1};
  std::optional<Result<wire::Message>> received;
  there.asyncRead([&](Result<wire::Message> read) { received = std::move(read); });
  auto at = frame.data();
  for (const std::size_t part : parts) {
    ASSERT_FALSE(received);
    asio::async_write(here, asio::buffer(at, part), [](auto, auto) {});
    at += part;
    io_.restart();
    while (io_.run_one_for(std::chrono::milliseconds{50}) > 0) {
    }
  }
  ASSERT_TRUE(received && *received);
  received.reset();
  there.asyncRead([&](Result<wire::Message> read) { received = std::move(read); });
  io_.restart();
  while (io_.poll() > 0) io_.restart();  // now it waits
  asio::write(here, asio::buffer(small));
  io_.restart();
  io_.run_for(std::chrono::seconds{10});
  ASSERT_TRUE(received && *received) << "the socket still waits for as much as of a body";
  EXPECT_EQ(std::get<wire::Subscribed>(**received).subscription, 3u);
}

TEST_P(Connection, APeerThatEndsWithinABodyIsDisconnected) {
  auto ends = connect();
  Socket here = std::move(ends.first);
  FramedSocket there{std::move(ends.second)};
  const auto frame = wire::toBytes(*wire::encode(wire::FrameMessage{1, wire::exampleFrame(512, 424)}));
  asio::async_write(here, asio::buffer(frame.data(), frame.size() - 1000),
                    [&](auto, auto) { here.close(); });
  const auto received = receive(there);
  ASSERT_FALSE(received);
  EXPECT_EQ(received.error().code, Error::Code::Disconnected);
}

TEST_P(Connection, AClosedPeerIsDisconnected) {
  auto ends = connect();
  FramedSocket here{std::move(ends.first)}, there{std::move(ends.second)};
  here.close();
  const auto received = receive(there);
  ASSERT_FALSE(received);
  EXPECT_EQ(received.error().code, Error::Code::Disconnected);
}

TEST_P(Connection, AnAnnouncedSizeBeyondTheLimitIsRefusedBeforeItIsAllocated) {
  auto ends = connect();
  FramedSocket here{std::move(ends.first)};
  FramedSocket there{std::move(ends.second), {.header_bytes = 1 << 20, .body_bytes = 1 << 20}};
  wire::Preamble lie;
  lie.header_bytes = 64;
  lie.body_bytes = 1ull << 62;
  const auto preamble = wire::encodePreamble(lie);
  here.asyncWrite({{preamble.begin(), preamble.end()}, {}}, ignore);
  const auto received = receive(there);
  ASSERT_FALSE(received);
  EXPECT_EQ(received.error().code, Error::Code::TooLarge);
}

// ---- bodies in shared memory
// -----------------------------------------------------------------------

class SharedMemory : public Connection {};
INSTANTIATE_TEST_SUITE_P(Unix, SharedMemory, testing::Values(true));

TEST_P(SharedMemory, ABodyMadeOnceReachesSeveralPeers) {
  const Frame frame = wire::exampleFrame(512, 424);
  const wire::Body body = wire::encodeBody(frame.planes);
  const auto shared = SharedBody::create(body);
  ASSERT_TRUE(shared) << shared.error().message;
  for (const std::uint64_t subscription : {1u, 2u}) {
    auto ends = connect();
    FramedSocket here{std::move(ends.first)}, there{std::move(ends.second)};
    there.acceptSharedBodies();
    const wire::FrameMessage message{subscription, frame};
    here.asyncWrite(*wire::encode(message, body), *shared, ignore);
    const auto received = receive(there);
    ASSERT_TRUE(received) << received.error().message;
    EXPECT_EQ(wire::toBytes(*wire::encode(*received)), wire::toBytes(*wire::encode(message)));
  }
}

TEST_P(SharedMemory, InlineAndSharedBodiesMayFollowEachOther) {
  auto ends = connect();
  FramedSocket here{std::move(ends.first)}, there{std::move(ends.second)};
  there.acceptSharedBodies();
  for (std::uint64_t i = 0; i < 6; ++i) {
    const wire::FrameMessage message{i, wire::exampleFrame(20, 10)};
    const wire::Body body = wire::encodeBody(message.frame.planes);
    if (i % 2 == 0)
      here.asyncWrite(*wire::encode(message), ignore);
    else
      here.asyncWrite(*wire::encode(message, body), *SharedBody::create(body), ignore);
    io_.restart();
    io_.run();
  }
  for (std::uint64_t i = 0; i < 6; ++i) {
    const auto received = receive(there);
    ASSERT_TRUE(received) << received.error().message;
    EXPECT_EQ(std::get<wire::FrameMessage>(*received).subscription, i);
  }
}

TEST_P(SharedMemory, AFrameOutlivesTheConnection) {
  const wire::FrameMessage message{1, wire::exampleFrame(64, 64)};
  Frame frame;
  {
    auto ends = connect();
    FramedSocket here{std::move(ends.first)}, there{std::move(ends.second)};
    there.acceptSharedBodies();
    const wire::Body body = wire::encodeBody(message.frame.planes);
    here.asyncWrite(*wire::encode(message, body), *SharedBody::create(body), ignore);
    frame = std::get<wire::FrameMessage>(*receive(there)).frame;
  }
  EXPECT_EQ(frame.planes[1].as<float>()[999], 999.0f);
}

TEST_P(SharedMemory, IsRefusedUnlessAgreedOn) {
  auto ends = connect();
  FramedSocket here{std::move(ends.first)}, there{std::move(ends.second)};
  const wire::FrameMessage message{1, wire::exampleFrame(4, 4)};
  const wire::Body body = wire::encodeBody(message.frame.planes);
  here.asyncWrite(*wire::encode(message, body), *SharedBody::create(body), ignore);
  const auto received = receive(there);
  ASSERT_FALSE(received);
  EXPECT_EQ(received.error().code, Error::Code::Malformed);
  EXPECT_THAT(received.error().message, HasSubstr("not agreed on"));
}

TEST_P(SharedMemory, AMissingFileDescriptorIsMalformed) {
  auto ends = connect();
  FramedSocket here{std::move(ends.first)}, there{std::move(ends.second)};
  there.acceptSharedBodies();
  wire::Encoded message = *wire::encode(wire::FrameMessage{1, wire::exampleFrame(4, 4)});
  wire::setBodyPlace(message, wire::BodyPlace::Memfd);
  message.body.pieces.clear();
  here.asyncWrite(std::move(message), ignore);
  const auto received = receive(there);
  ASSERT_FALSE(received);
  EXPECT_THAT(received.error().message, HasSubstr("file descriptor is missing"));
}

/// Sends bytes with so many copies of a file descriptor; the result of sendmsg(2).
ssize_t trySendWithDescriptors(int socket, std::span<const std::byte> bytes, int fd, std::size_t count) {
  std::vector<int> fds(count, fd);
  std::vector<char> control(CMSG_SPACE(count * sizeof(int)));
  iovec part{const_cast<std::byte*>(bytes.data()), bytes.size()};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  cmsghdr* item = CMSG_FIRSTHDR(&message);
  item->cmsg_level = SOL_SOCKET;
  item->cmsg_type = SCM_RIGHTS;
  item->cmsg_len = CMSG_LEN(count * sizeof(int));
  std::memcpy(CMSG_DATA(item), fds.data(), count * sizeof(int));
  return ::sendmsg(socket, &message, 0);
}
void sendWithDescriptors(int socket, std::span<const std::byte> bytes, int fd, std::size_t count) {
  ASSERT_EQ(trySendWithDescriptors(socket, bytes, fd, count), static_cast<ssize_t>(bytes.size()));
}

std::ptrdiff_t openFiles() {
  const std::filesystem::directory_iterator all{"/proc/self/fd"};
  return std::distance(begin(all), end(all));
}

TEST_P(SharedMemory, SeveralFileDescriptorsWithAMessageAreRefusedAndNoneStaysOpen) {
  { const auto opens_what_asio_needs = connect(); }
  const auto before = openFiles();
  for (const std::size_t count : {2u, 3u, 10u}) {
    auto ends = connect();
    FramedSocket there{std::move(ends.second)};
    there.acceptSharedBodies();
    const auto bytes = wire::toBytes(*wire::encode(wire::ListSources{1}));
    sendWithDescriptors(ends.first.native_handle(), bytes, 0, count);
    const auto received = receive(there);
    ASSERT_FALSE(received);
    EXPECT_EQ(received.error().code, Error::Code::Malformed);
  }
  EXPECT_EQ(openFiles(), before);
}

TEST_P(SharedMemory, FileDescriptorsThatNoMessageNeedsAreRefused) {
  auto ends = connect();
  FramedSocket there{std::move(ends.second)};
  there.acceptSharedBodies();
  const auto bytes = wire::toBytes(*wire::encode(wire::ListSources{1}));
  for (const std::byte& byte : std::span{bytes}.first(8)) {
    sendWithDescriptors(ends.first.native_handle(), {&byte, 1}, 0, 1);
  }
  const auto received = receive(there);
  ASSERT_FALSE(received);
  EXPECT_THAT(received.error().message, HasSubstr("no message refers to"));
}

TEST_P(SharedMemory, ABodyComesInlineWhileTooManyDescriptorsAreOnTheirWay) {
  constexpr int kImpossibleHere = 77;
  auto ends = connect(), full = connect();
  const pid_t child = ::fork();  // what it gives up, this process keeps
  if (child == 0) {
    constexpr uid_t kNobody = 65534;  // root may have any number on their way
    const rlimit few{32, 32};
    const std::byte byte{};
    if ((::geteuid() == 0 && ::setresuid(kNobody, kNobody, kNobody) != 0) ||
        ::setrlimit(RLIMIT_NOFILE, &few) != 0 ||
        trySendWithDescriptors(full.first.native_handle(), {&byte, 1}, 0, 100) != 1 ||
        trySendWithDescriptors(full.first.native_handle(), {&byte, 1}, 0, 1) >= 0 ||
        errno != ETOOMANYREFS) {
      ::_exit(kImpossibleHere);
    }
    FramedSocket here{std::move(ends.first)}, there{std::move(ends.second)};
    there.acceptSharedBodies();
    const wire::FrameMessage message{1, wire::exampleFrame(20, 10)};
    const wire::Body body = wire::encodeBody(message.frame.planes);
    const auto shared = SharedBody::create(body);
    if (!shared) ::_exit(2);
    here.asyncWrite(*wire::encode(message, body), *shared, ignore);
    const auto received = receive(there);
    const bool is_same = received && wire::toBytes(*wire::encode(*received)) ==
                                         wire::toBytes(*wire::encode(message));
    ::_exit(is_same ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  if (WIFEXITED(status) && WEXITSTATUS(status) == kImpossibleHere) {
    GTEST_SKIP() << "this process cannot make the kernel say ETOOMANYREFS";
  }
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
}

TEST(SharedBodyTest, CannotBeChangedByAnyone) {
  const auto shared = SharedBody::create(wire::encodeBody(wire::exampleFrame(4, 4).planes));
  ASSERT_TRUE(shared) << shared.error().message;
  EXPECT_EQ(::pwrite((*shared)->fd(), "x", 1, 0), -1);
  EXPECT_EQ(::ftruncate((*shared)->fd(), 0), -1);
  EXPECT_EQ(::mmap(nullptr, 64, PROT_WRITE, MAP_SHARED, (*shared)->fd(), 0), MAP_FAILED);
}

wire::Body bodyOfWidth(int width) { return wire::encodeBody(wire::exampleFrame(width, 256).planes); }

/// Waits until so much is ready: a thread makes it so, some milliseconds later.
void expectReady(const SharedBodies& bodies, std::uint64_t bytes) {
  const auto soon = std::chrono::steady_clock::now() + std::chrono::seconds{10};
  while (bodies.ready() != bytes && std::chrono::steady_clock::now() < soon)
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
  EXPECT_EQ(bodies.ready(), bytes);
}

TEST(SharedBodies, AreMadeInMemoryThatIsReady) {
  SharedBodies bodies;
  const wire::Body body = bodyOfWidth(64);
  const auto first = bodies.make(body);
  expectReady(bodies, 2 * body.bytes);
  const auto second = bodies.make(body);
  expectReady(bodies, 2 * body.bytes);
  for (const auto* made : {&first, &second}) {  // ready or not, they are alike
    ASSERT_TRUE(*made);
    const auto mapped = mapSharedBody(FileDescriptor{::dup((**made)->fd())}, body.bytes);
    ASSERT_TRUE(mapped) << mapped.error().message;
    EXPECT_EQ(wire::crc32c(mapped->bytes(), 0), body.crc32c);
    EXPECT_EQ(::pwrite((**made)->fd(), "x", 1, 0), -1);
  }
}

TEST(SharedBodies, AreReadyForTheNewestSizes) {
  SharedBodies bodies;
  std::uint64_t ready = 0;
  for (int i = 1; i <= 6; ++i) {
    const wire::Body body = bodyOfWidth(32 * i);
    ASSERT_TRUE(bodies.make(body));
    ready += 2 * body.bytes;
    if (i > 4) ready -= 2 * bodyOfWidth(32 * (i - 4)).bytes;
    expectReady(bodies, ready);
  }
}

TEST(SharedBodies, AreNotReadyForWhatIsSentOtherwise) {
  SharedBodies bodies;
  ASSERT_TRUE(bodies.make(wire::encodeBody(wire::exampleFrame(4, 4).planes)));
  const wire::Body larger = bodyOfWidth(64);
  ASSERT_TRUE(bodies.make(larger));
  expectReady(bodies, 2 * larger.bytes);
}

TEST(SharedBodyTest, AnUnsealedMemfdIsRefused) {
  const FileDescriptor memfd{::memfd_create("test", MFD_CLOEXEC | MFD_ALLOW_SEALING)};
  ASSERT_EQ(::ftruncate(memfd.get(), 64), 0);
  const auto mapped = mapSharedBody(memfd, 64);
  ASSERT_FALSE(mapped);
  EXPECT_THAT(mapped.error().message, HasSubstr("not a sealed memfd"));
}

TEST(SharedBodyTest, AMemfdOfAnotherSizeThanAnnouncedIsRefused) {
  const auto shared = SharedBody::create(wire::encodeBody(wire::exampleFrame(4, 4).planes));
  const FileDescriptor copy{::dup((*shared)->fd())};
  const auto mapped = mapSharedBody(copy, (*shared)->size() + 64);
  ASSERT_FALSE(mapped);
  EXPECT_EQ(mapped.error().code, Error::Code::Malformed);
}

}  // namespace
}  // namespace toftwin::transport
