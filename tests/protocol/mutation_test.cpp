// SPDX-License-Identifier: Apache-2.0
// The poor man's fuzzer: always runs, with any compiler, the same way each time. Worth most under
// the sanitizers.
#include <gtest/gtest.h>

#include <array>
#include <random>
#include <vector>

#include <utility>

#include <boost/asio/io_context.hpp>
#include <boost/asio/local/connect_pair.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/write.hpp>

#include "bad_messages.h"
#include "example_messages.h"
#include "fuzz_one_input.h"
#include "protocol/transport/framed_socket.h"
#include "protocol/wire/codec.h"

namespace toftwin::wire {
namespace {

using Bytes = std::vector<std::byte>;
constexpr std::uint64_t kSeed = 20'261;

std::vector<Bytes> seeds() {
  std::vector<Bytes> all;
  for (const auto& example : exampleMessages()) all.push_back(toBytes(*encode(example.message)));
  for (const auto& bad : badMessages()) all.push_back(bad.bytes);
  return all;
}

class Mutator {
 public:
  explicit Mutator(std::uint64_t seed) : random_(seed) {}

  Bytes next(const std::vector<Bytes>& from) {
    Bytes bytes = from[below(from.size())];
    for (std::size_t left = 1 + below(4); left > 0; --left) mutate(bytes, from);
    return bytes;
  }
  std::size_t below(std::size_t limit) {
    return std::uniform_int_distribution<std::size_t>{0, limit - 1}(random_);
  }

 private:
  void mutate(Bytes& bytes, const std::vector<Bytes>& from) {
    if (bytes.empty()) return;
    const std::size_t at = below(bytes.size());
    switch (below(6)) {
      case 0:
        bytes[at] ^= std::byte{1} << below(8);
        break;
      case 1:
        bytes[at] = static_cast<std::byte>(random_());
        break;
      case 2:
        overwrite(bytes, at);
        break;
      case 3:
        bytes.resize(at);
        break;
      case 4:
        bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), below(130), std::byte{});
        break;
      default:
        splice(bytes, at, from[below(from.size())]);
    }
  }
  /// A number that lengths and offsets have trouble with.
  void overwrite(Bytes& bytes, std::size_t at) {
    constexpr std::array<std::uint32_t, 8> values{0u,          1u,  0x7FFFFFFFu, 0x80000000u,
                                                  0xFFFFFFFFu, 64u, 0xFFFFFFC0u, 0x10000u};
    std::uint32_t value = values[below(values.size())];
    for (std::size_t i = at & ~std::size_t{3}; i < bytes.size() && i < (at & ~std::size_t{3}) + 4;
         ++i) {
      bytes[i] = static_cast<std::byte>(value);
      value >>= 8;
    }
  }
  void splice(Bytes& bytes, std::size_t at, const Bytes& other) {
    for (std::size_t i = at; i < std::min(bytes.size(), other.size()); ++i) bytes[i] = other[i];
  }
  std::mt19937_64 random_;
};

TEST(Mutation, NoBytesBreakTheDecoder) {
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  const auto from = seeds();
  Mutator mutator{kSeed};
  for (int i = 0; i < 400'000; ++i) fuzzOneInput(mutator.next(from));
}

/// Whatever comes, the socket says either a message or why there is none, and ends with the stream.
TEST(Mutation, NoBytesBreakTheSocket) {
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  namespace asio = boost::asio;
  const auto from = seeds();
  Mutator mutator{kSeed};
  for (int i = 0; i < 2'000; ++i) {
    asio::io_context io;
    asio::local::stream_protocol::socket here{io}, there{io};
    asio::local::connect_pair(here, there);
    transport::FramedSocket framed{transport::Socket{std::move(there)}, {1 << 16, 1 << 20}};
    if (i % 2 == 0) framed.acceptSharedBodies();
    for (int k = 0; k < 3; ++k) asio::write(here, asio::buffer(mutator.next(from)));
    here.shutdown(asio::socket_base::shutdown_send);
    bool ended = false;
    transport::FramedSocket::ReadHandler take = [&](const Result<Message>& message) {
      ended = !message && message.error().code != Error::Code::Unsupported;
      if (!ended) framed.asyncRead(take);
    };
    framed.asyncRead(take);
    io.run();
    ASSERT_TRUE(ended) << i;
  }
}

}  // namespace
}  // namespace toftwin::wire
