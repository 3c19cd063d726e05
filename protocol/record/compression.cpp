// SPDX-License-Identifier: Apache-2.0
#include "protocol/record/compression.h"

#include <fmt/format.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <memory>
#include <optional>

namespace toftwin::record {
namespace {

Error malformedChunk(std::string what) { return {Error::Code::Malformed, std::move(what)}; }

/// What one step of a decoder did.
struct Step {
  std::size_t consumed = 0;
  std::size_t produced = 0;
  bool done = false;
};

/// Runs `step(in, out) -> Result<Step>` until the input ends, into a buffer that doubles as it
/// fills up to `size`.
template <class Decode>
Result<std::vector<std::byte>> decodeStepwise(std::span<const std::byte> bytes, std::uint64_t size,
                                              Decode step) {
  std::vector<std::byte> out(static_cast<std::size_t>(
      std::min<std::uint64_t>(size, 64 * 1024 + 4 * std::uint64_t{bytes.size()})));
  std::size_t filled = 0;
  bool done = false;
  while (!done) {
    if (filled == out.size() && filled < size) {
      out.resize(
          static_cast<std::size_t>(std::min<std::uint64_t>(size, 2 * std::uint64_t{filled})));
    }
    const Result<Step> did = step(bytes, std::span{out}.subspan(filled));
    if (!did) return did.error();
    bytes = bytes.subspan(did->consumed);
    filled += did->produced;
    done = did->done;
    const bool can_grow = filled == out.size() && filled < size;
    if (!done && did->consumed == 0 && did->produced == 0 && !can_grow) {
      return malformedChunk(bytes.empty() ? "ends early" : "holds more than it says");
    }
  }
  if (filled != size || !bytes.empty()) {
    return malformedChunk(fmt::format("holds {} bytes, but says {}", filled, size));
  }
  return out;
}

Result<std::vector<std::byte>> decompressZstd(std::span<const std::byte> bytes,
                                              std::uint64_t size) {
  const std::unique_ptr<ZSTD_DCtx, std::size_t (*)(ZSTD_DCtx*)> context{ZSTD_createDCtx(),
                                                                        &ZSTD_freeDCtx};
  if (context == nullptr) return Error{Error::Code::Internal, "out of memory for zstd"};
  return decodeStepwise(
      bytes, size, [&](std::span<const std::byte> in, std::span<std::byte> out) -> Result<Step> {
        ZSTD_inBuffer from{in.data(), in.size(), 0};
        ZSTD_outBuffer to{out.data(), out.size(), 0};
        const std::size_t hint = ZSTD_decompressStream(context.get(), &to, &from);
        if (ZSTD_isError(hint) != 0) return malformedChunk(fmt::format("zstd: {}", ZSTD_getErrorName(hint)));
        // More frames may follow in one chunk; the end is where the input ends.
        return Step{from.pos, to.pos, hint == 0 && from.pos == in.size()};
      });
}

Result<std::vector<std::byte>> decompressLz4(std::span<const std::byte> bytes, std::uint64_t size) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) != 0) {
    return Error{Error::Code::Internal, "out of memory for lz4"};
  }
  const std::unique_ptr<LZ4F_dctx, LZ4F_errorCode_t (*)(LZ4F_dctx*)> context{
      made, &LZ4F_freeDecompressionContext};
  return decodeStepwise(
      bytes, size, [&](std::span<const std::byte> in, std::span<std::byte> out) -> Result<Step> {
        std::size_t consumed = in.size(), produced = out.size();
        const std::size_t hint =
            LZ4F_decompress(context.get(), out.data(), &produced, in.data(), &consumed, nullptr);
        if (LZ4F_isError(hint) != 0) return malformedChunk(fmt::format("lz4: {}", LZ4F_getErrorName(hint)));
        return Step{consumed, produced, hint == 0 && consumed == in.size()};
      });
}

}  // namespace

std::uint64_t mostZstdBytes(std::uint64_t bytes) { return ZSTD_compressBound(bytes); }

std::vector<std::byte> compressZstd(std::span<const std::byte> bytes, int level) {
  std::vector<std::byte> out(ZSTD_compressBound(bytes.size()));
  const std::size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), level);
  out.resize(ZSTD_isError(size) != 0 ? 0 : size);  // cannot fail with room for the bound
  return out;
}

Result<std::vector<std::byte>> decompress(std::string_view compression,
                                          std::span<const std::byte> bytes, std::uint64_t size) {
  const std::uint64_t most = compression.empty() ? kMaxChunkBytes : kMaxUnpackedBytes;
  if (size > most)
    return Error{Error::Code::TooLarge, fmt::format("says that it holds {} bytes, but {} is the most", size, most)};
  if (compression == "zstd") return decompressZstd(bytes, size);
  if (compression == "lz4") return decompressLz4(bytes, size);
  if (!compression.empty()) {
    return Error{Error::Code::Unsupported,
                 fmt::format("is compressed with \"{}\"; only zstd, lz4 and none are known",
                             compression.substr(0, 32))};
  }
  if (bytes.size() != size) {
    return malformedChunk(fmt::format("holds {} bytes, but says {}", bytes.size(), size));
  }
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

}  // namespace toftwin::record
