// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/packet_filter.h"

#include <fmt/format.h>
#include <linux/filter.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>
#include <initializer_list>
#include <vector>

namespace toftwin::drivers::aravis {
namespace {

// A stream packet follows eight bytes of UDP header. In its first eight bytes: status 2, frame 2,
// kind 1 (with kExtended), number 3; with extended ids 20: status 2, flags 2, kind 1, … parts 1 (of
// a leader), frame 8, number 4.                                             [GigE Vision 2, GVSP]
constexpr std::uint32_t kUdp = 8, kShort = 8, kLong = 20;
constexpr std::uint32_t kKind = kUdp + 4, kParts = kUdp + 7;
constexpr std::uint32_t kExtended = 0x80, kKindMask = 0x7F, kNumberMask = 0x00FFFFFF;
constexpr std::uint32_t kLeader = 1, kTrailer = 2, kPayload = 3, kMultipart = 7;
constexpr std::uint32_t kImage = 1, kChunks = 4, kExtendedChunks = 5, kMultipartType = 10;
constexpr std::uint32_t kTypeMask = 0x3FFF;  // of a leader's payload type: without "has chunks"
constexpr std::uint32_t kImageLeader = 36, kPartsLeader = 12, kPart = 48, kMostParts = 8;
constexpr std::uint32_t kIpAndUdp = 28, kOffset = 8;  // a multipart packet says where it belongs

/// A program of the kernel's classic packet filter, made of demands: what breaks one is thrown
/// away.
class Program {
 public:
  void byteAt(std::uint32_t at) { add(BPF_LD | BPF_B | BPF_ABS, at); }
  void halfAt(std::uint32_t at) { add(BPF_LD | BPF_H | BPF_ABS, at); }
  void wordAt(std::uint32_t at) { add(BPF_LD | BPF_W | BPF_ABS, at); }
  void length() { add(BPF_LD | BPF_W | BPF_LEN, 0); }
  void mask(std::uint32_t bits) { add(BPF_ALU | BPF_AND | BPF_K, bits); }
  void times(std::uint32_t number) { add(BPF_ALU | BPF_MUL | BPF_K, number); }
  void plus(std::uint32_t number) { add(BPF_ALU | BPF_ADD | BPF_K, number); }
  void keepForComparison() { add(BPF_MISC | BPF_TAX, 0); }

  void demandAtLeast(std::uint32_t number) { demand(BPF_JGE | BPF_K, number); }
  void demandAtLeastKept() { demand(BPF_JGE | BPF_X, 0); }
  void demandAtMost(std::uint32_t number) {
    jump(BPF_JGT | BPF_K, number, 0, 1);
    drop();
  }
  void demandEqual(std::uint32_t number) { demand(BPF_JEQ | BPF_K, number); }
  void demandOneOf(std::initializer_list<std::uint32_t> numbers) {
    auto left = static_cast<std::uint8_t>(numbers.size());
    for (const std::uint32_t number : numbers) jump(BPF_JEQ | BPF_K, number, left--, 0);
    drop();
  }
  void drop() { add(BPF_RET | BPF_K, 0); }
  void accept() { add(BPF_RET | BPF_K, 0xFFFFFFFF); }

  /// What `body` adds is for packets with these bits, or with this number, or with more than it.
  template <class Body>
  void ifBits(std::uint32_t bits, Body body) {
    onlyIf(BPF_JSET | BPF_K, bits, body);
  }
  template <class Body>
  void ifEqual(std::uint32_t number, Body body) {
    onlyIf(BPF_JEQ | BPF_K, number, body);
  }
  template <class Body>
  void ifMoreThan(std::uint32_t number, Body body) {
    onlyIf(BPF_JGT | BPF_K, number, body);
  }

  std::vector<sock_filter> code;

 private:
  void add(unsigned what, std::uint32_t number) {
    code.push_back({static_cast<std::uint16_t>(what), 0, 0, number});
  }
  void jump(unsigned how, std::uint32_t number, std::uint8_t if_true, std::uint8_t if_false) {
    code.push_back({static_cast<std::uint16_t>(BPF_JMP | how), if_true, if_false, number});
  }
  void demand(unsigned how, std::uint32_t number) {
    jump(how, number, 1, 0);
    drop();
  }
  template <class Body>
  void onlyIf(unsigned how, std::uint32_t number, Body body) {
    const std::size_t at = code.size() + 1;
    jump(how, number, 1, 0);
    add(BPF_JMP | BPF_JA, 0);  // a jump that can be long
    body();
    code[at].k = static_cast<std::uint32_t>(code.size() - at - 1);
  }
};

std::uint32_t packetsOf(const StreamShape& shape, std::uint32_t overhead) {
  const std::uint32_t block = shape.packet_bytes > overhead ? shape.packet_bytes - overhead : 1;
  return static_cast<std::uint32_t>((std::uint64_t{shape.frame_bytes} + block - 1) / block);
}

/// The rest of a packet with one image, after its header.
void demandOneImage(Program& program, const StreamShape& shape, std::uint32_t header) {
  // Leader 0, payload 1 to n, trailer n + 1: a larger number writes beyond the buffer.
  const std::uint32_t most = packetsOf(shape, kIpAndUdp + header) + 1;
  program.wordAt(header == kLong ? kUdp + 16 : kKind);
  if (header == kShort) program.mask(kNumberMask);
  program.demandAtMost(most);
  program.byteAt(kKind);
  program.mask(kKindMask);
  program.demandOneOf({kLeader, kTrailer, kPayload});
  program.ifEqual(kLeader, [&] {
    program.length();
    program.demandAtLeast(kUdp + header + kImageLeader);
    program.halfAt(kUdp + header + 2);
    program.mask(kTypeMask);
    program.demandOneOf({kImage, kChunks, kExtendedChunks});
  });
  program.accept();
}

void demandParts(Program& program, const StreamShape& shape) {
  const std::uint32_t most = packetsOf(shape, kIpAndUdp + kLong + kOffset) + 1 + kMostParts;
  program.wordAt(kUdp + 16);
  program.demandAtMost(most);
  program.byteAt(kKind);
  program.mask(kKindMask);
  program.demandOneOf({kLeader, kTrailer, kMultipart});
  program.ifEqual(kMultipart, [&] {
    program.length();
    program.demandAtLeast(kUdp + kLong + kOffset);
    program.accept();
  });
  program.ifEqual(kTrailer, [&] { program.accept(); });
  program.byteAt(kParts);
  program.demandAtLeast(1);
  program.demandAtMost(kMostParts);
  program.times(kPart);
  program.plus(kUdp + kLong + kPartsLeader);
  program.keepForComparison();
  program.length();
  program.demandAtLeastKept();
  program.halfAt(kUdp + kLong + 2);
  program.mask(kTypeMask);
  program.demandEqual(kMultipartType);
  for (std::uint32_t i = 0; i < kMostParts; ++i) {
    program.byteAt(kParts);
    program.ifMoreThan(i, [&] {
      const std::uint32_t part = kUdp + kLong + kPartsLeader + kPart * i;
      program.halfAt(part + 2);  // the length's high 16 bits
      program.demandEqual(0);
      program.wordAt(part + 4);
      program.demandAtMost(shape.frame_bytes);
    });
  }
  program.accept();
}

}  // namespace

Result<> filterPackets(int socket, const StreamShape& shape) {
  Program program;
  program.length();
  program.demandAtLeast(kUdp + kShort);
  program.byteAt(kKind);
  program.ifBits(kExtended, [&] {
    program.length();
    program.demandAtLeast(kUdp + kLong);
    if (shape.is_multipart) {
      demandParts(program, shape);
    } else {
      demandOneImage(program, shape, kLong);
    }
  });
  if (shape.is_multipart) {
    program.drop();  // multipart needs extended ids
  } else {
    demandOneImage(program, shape, kShort);
  }
  const sock_fprog whole{static_cast<unsigned short>(program.code.size()), program.code.data()};
  if (::setsockopt(socket, SOL_SOCKET, SO_ATTACH_FILTER, &whole, sizeof whole) == 0) return {};
  return Error{Error::Code::Internal,
               fmt::format("aravis: the kernel takes no packet filter: {}", std::strerror(errno))};
}

}  // namespace toftwin::drivers::aravis
