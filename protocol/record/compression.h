// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

namespace toftwin::record {

/// The most that a chunk may hold, compressed or not; a longer one is an error, not an allocation.
inline constexpr std::uint64_t kMaxChunkBytes = 1ull << 30;
/// The most that a compressed chunk may grow to: few bytes can say many.
inline constexpr std::uint64_t kMaxUnpackedBytes = 256ull << 20;

/// The most that compressZstd can make of so many bytes.
std::uint64_t mostZstdBytes(std::uint64_t bytes);
/// One zstd frame.
std::vector<std::byte> compressZstd(std::span<const std::byte> bytes, int level);

/// Undoes `compression` ("", "zstd", "lz4"). The result must have `size` bytes; memory grows with
/// what really comes out, never by what `size` claims.
Result<std::vector<std::byte>> decompress(std::string_view compression,
                                          std::span<const std::byte> bytes, std::uint64_t size);

}  // namespace toftwin::record
