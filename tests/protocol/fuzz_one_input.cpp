// SPDX-License-Identifier: Apache-2.0
#include "fuzz_one_input.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "protocol/wire/codec.h"
#include "protocol/wire/crc32c.h"

namespace toftwin::wire {
namespace {

void demand(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "fuzzing: %s\n", what);
  std::abort();
}

/// Reads every byte, so that a sanitizer sees a plane that leaves its buffer.
void readPlanes(const Message& message) {
  const auto* frame = std::get_if<FrameMessage>(&message);
  if (!frame) return;
  for (const Plane& plane : frame->frame.planes) {
    demand(plane.data.size() == plane.byteSize(), "a plane's bytes are not its pixels");
    [[maybe_unused]] volatile std::uint32_t sum = crc32c(plane.data.bytes());
  }
}

void tryDecoding(std::vector<std::byte> bytes) {
  const auto message = decode(Buffer::adopt(std::move(bytes)));
  if (!message) {
    demand(!message.error().message.empty(), "an error without a text");
    return;
  }
  readPlanes(*message);
  const auto encoded = encode(*message);
  if (!encoded) {  // many entries that share one text in a small header are a large one written out
    demand(encoded.error().code == Error::Code::TooLarge, "what was decoded cannot be encoded");
    return;
  }
  const auto once = toBytes(*encoded);
  const auto again = decode(Buffer::adopt(once));
  demand(again.ok(), "what was decoded cannot be decoded after encoding");
  demand(toBytes(*encode(*again)) == once, "what was decoded changes when encoded again");
}

/// The same bytes as a message whose lengths and checksums fit; the header is as long as the
/// preamble says if that is possible, else all the rest.
std::vector<std::byte> mended(std::span<const std::byte> bytes) {
  const std::size_t rest = (bytes.size() - kPreambleSize) / kAlignment * kAlignment;
  std::uint32_t header = 0;
  std::memcpy(&header, bytes.data() + 12, sizeof header);
  if (header == 0 || header % kAlignment != 0 || header > rest)
    header = static_cast<std::uint32_t>(rest);
  std::vector<std::byte> result(bytes.begin(),
                                bytes.begin() + static_cast<std::ptrdiff_t>(kPreambleSize + rest));
  const auto behind = std::span{result}.subspan(kPreambleSize);
  Preamble preamble;
  preamble.header_bytes = header;
  preamble.body_bytes = rest - header;
  preamble.header_crc32c = crc32c(behind.first(header));
  preamble.body_crc32c = crc32c(behind.subspan(header));
  std::ranges::copy(encodePreamble(preamble), result.begin());
  return result;
}

}  // namespace

void fuzzOneInput(std::span<const std::byte> bytes) {
  tryDecoding({bytes.begin(), bytes.end()});
  if (bytes.size() < kPreambleSize + kAlignment) return;
  const std::vector<std::byte> fitting = mended(bytes);
  requestIdOf(std::span{fitting}.subspan(kPreambleSize));
  tryDecoding(fitting);
}

}  // namespace toftwin::wire
