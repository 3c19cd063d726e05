// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/crc32c.h"

#include <array>
#include <bit>
#include <cstring>

namespace toftwin::wire {
namespace {

static_assert(std::endian::native == std::endian::little,
              "planes travel as they lie in memory: the protocol needs a little-endian host");

constexpr std::uint32_t kPolynomial = 0x82F63B78u;  // 0x1EDC6F41 with its bits reversed

/// The remainder after one more zero bit.
constexpr std::uint32_t shiftedByOneBit(std::uint32_t remainder) {
  return (remainder >> 1) ^ ((remainder & 1u) ? kPolynomial : 0u);
}

std::uint64_t loadWord(const std::byte* at) {
  std::uint64_t word;
  std::memcpy(&word, at, sizeof word);
  return word;
}

// ---- eight bytes per step by table ("slicing by eight")
// --------------------------------------------

using Table = std::array<std::uint32_t, 256>;

/// tables[k][b]: what byte b adds to the remainder when k more bytes follow it.
constexpr std::array<Table, 8> makeSlices() {
  std::array<Table, 8> tables{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t remainder = byte;
    for (int bit = 0; bit < 8; ++bit) remainder = shiftedByOneBit(remainder);
    tables[0][byte] = remainder;
  }
  for (std::size_t k = 1; k < 8; ++k) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint32_t before = tables[k - 1][byte];
      tables[k][byte] = (before >> 8) ^ tables[0][before & 0xFFu];
    }
  }
  return tables;
}
constexpr std::array<Table, 8> kSlices = makeSlices();

std::uint32_t updatePortable(std::uint32_t remainder, const std::byte* at, std::size_t size) {
  for (; size >= 8; at += 8, size -= 8) {
    const std::uint64_t word = loadWord(at) ^ remainder;
    remainder = 0;
    for (std::size_t i = 0; i < 8; ++i) remainder ^= kSlices[7 - i][(word >> (8 * i)) & 0xFFu];
  }
  for (; size > 0; ++at, --size) {
    const auto index = (remainder ^ static_cast<std::uint32_t>(*at)) & 0xFFu;
    remainder = (remainder >> 8) ^ kSlices[0][index];
  }
  return remainder;
}

#if defined(__x86_64__)
// ---- SSE4.2
// ---------------------------------------------------------------------------------------- The
// instruction takes 3 cycles but one can start every cycle, so three neighbouring blocks are summed
// at once. The remainders are joined by linearity: crc(a b) = advance(crc(a), |b|) ^ crc0(b), where
// advance(r, n) is the remainder r after n zero bytes, a linear map over GF(2).

using Columns = std::array<std::uint32_t, 32>;  // of a 32 × 32 matrix over GF(2)

constexpr std::uint32_t product(const Columns& matrix, std::uint32_t vector) {
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < 32; ++i) {
    if ((vector >> i) & 1u) sum ^= matrix[i];
  }
  return sum;
}

/// The map advance(·, Bytes) as four tables, one per byte of the remainder. Bytes is a power of
/// two, so the map is the one-bit shift squared log2(8 Bytes) times.
template <std::size_t Bytes>
constexpr std::array<Table, 4> makeAdvance() {
  static_assert(std::has_single_bit(Bytes));
  Columns matrix{};
  for (std::size_t i = 0; i < 32; ++i) matrix[i] = shiftedByOneBit(1u << i);
  for (std::size_t bits = 1; bits < 8 * Bytes; bits *= 2) {
    Columns square{};
    for (std::size_t i = 0; i < 32; ++i) square[i] = product(matrix, matrix[i]);
    matrix = square;
  }
  std::array<Table, 4> tables{};
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::uint32_t byte = 0; byte < 256; ++byte) {
      tables[k][byte] = product(matrix, byte << (8 * k));
    }
  }
  return tables;
}

template <std::size_t Bytes>
std::uint32_t advance(std::uint32_t r) {
  static constexpr std::array<Table, 4> kTables = makeAdvance<Bytes>();
  return kTables[0][r & 0xFFu] ^ kTables[1][(r >> 8) & 0xFFu] ^ kTables[2][(r >> 16) & 0xFFu] ^
         kTables[3][r >> 24];
}

/// Eats as many runs of three blocks of `Block` bytes as there are.
template <std::size_t Block>
__attribute__((target("sse4.2"))) std::uint64_t updateThreefold(std::uint64_t a,
                                                                const std::byte*& at,
                                                                std::size_t& size) {
  for (; size >= 3 * Block; at += 3 * Block, size -= 3 * Block) {
    std::uint64_t b = 0, c = 0;
    for (std::size_t i = 0; i < Block; i += 8) {
      a = __builtin_ia32_crc32di(a, loadWord(at + i));
      b = __builtin_ia32_crc32di(b, loadWord(at + Block + i));
      c = __builtin_ia32_crc32di(c, loadWord(at + 2 * Block + i));
    }
    a = advance<Block>(static_cast<std::uint32_t>(a)) ^ b;
    a = advance<Block>(static_cast<std::uint32_t>(a)) ^ c;
  }
  return a;
}

__attribute__((target("sse4.2"))) std::uint32_t updateSse42(std::uint32_t remainder,
                                                            const std::byte* at, std::size_t size) {
  std::uint64_t wide = remainder;
  wide = updateThreefold<4096>(wide, at, size);
  wide = updateThreefold<256>(wide, at, size);
  for (; size >= 8; at += 8, size -= 8) wide = __builtin_ia32_crc32di(wide, loadWord(at));
  remainder = static_cast<std::uint32_t>(wide);
  for (; size > 0; ++at, --size) {
    remainder = __builtin_ia32_crc32qi(remainder, static_cast<unsigned char>(*at));
  }
  return remainder;
}
#endif

using Update = std::uint32_t (*)(std::uint32_t, const std::byte*, std::size_t);

Update fastest() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("sse4.2")) return updateSse42;
#endif
  return updatePortable;
}

}  // namespace

std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t previous) {
  static const Update update = fastest();
  return ~update(~previous, bytes.data(), bytes.size());
}

std::uint32_t crc32cPortable(std::span<const std::byte> bytes, std::uint32_t previous) {
  return ~updatePortable(~previous, bytes.data(), bytes.size());
}

}  // namespace toftwin::wire
