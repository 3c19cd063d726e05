// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/wire/chunk.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace toftwin::o3d303 {
namespace {

// Places of the header's numbers, all 32 bit, little endian.
constexpr std::size_t kType = 0, kChunkSize = 4, kHeaderSize = 8, kVersion = 12, kWidth = 16,
                      kHeight = 20, kFormat = 24, kTime = 28, kFrameCount = 32, kStatus = 36,
                      kSeconds = 40, kNanoseconds = 44;
constexpr std::size_t kHeaderSizeV1 = 40, kHeaderSizeV2 = 48;
constexpr std::uint32_t kMostPixelsPerSide = 8192;
constexpr std::size_t kMostHeader = 65'536;

Error malformedChunk(std::string what) { return {Error::Code::Malformed, "chunk: " + std::move(what)}; }

ChunkHeader readHeader(std::span<const std::byte> bytes, std::size_t header_size) {
  const auto at = [&](std::size_t place) { return numberAt<std::uint32_t>(bytes, place); };
  ChunkHeader header{.type = static_cast<ChunkType>(at(kType)),
                     .width = at(kWidth),
                     .height = at(kHeight),
                     .format = static_cast<ElementFormat>(at(kFormat)),
                     .time_us = at(kTime),
                     .frame_count = at(kFrameCount),
                     .status = at(kStatus)};
  if (at(kVersion) >= 2) header.time = ChunkHeader::Time{at(kSeconds), at(kNanoseconds)};
  if (at(kVersion) >= 3) {
    const std::string_view text = textOf(bytes.subspan(kHeaderSizeV2, header_size - kHeaderSizeV2));
    header.attributes = text.substr(0, text.find('\0'));
  }
  return header;
}

}  // namespace

std::size_t sizeOf(ElementFormat format) {
  constexpr std::size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8, 8, 4, 12};
  const auto index = static_cast<std::uint32_t>(format);
  return index < std::size(sizes) ? sizes[index] : 0;
}

Result<ChunkInBytes> readChunk(std::span<const std::byte> bytes) {
  if (bytes.size() < kHeaderSizeV1) return malformedChunk("its header is cut off");
  const auto chunk_size = numberAt<std::uint32_t>(bytes, kChunkSize);
  const auto header_size = numberAt<std::uint32_t>(bytes, kHeaderSize);
  const auto version = numberAt<std::uint32_t>(bytes, kVersion);
  const std::size_t least = version >= 2 ? kHeaderSizeV2 : kHeaderSizeV1;
  if (version < 1 || header_size < least || header_size > kMostHeader || header_size > chunk_size ||
      chunk_size > bytes.size()) {
    return malformedChunk(
        fmt::format("a header of version {} and {} bytes in a chunk of {}, of which {} are there", version,
                    header_size, chunk_size, bytes.size()));
  }
  Chunk chunk{.header = readHeader(bytes, header_size),
              .data = bytes.subspan(header_size, chunk_size - header_size)};
  const ChunkHeader& header = chunk.header;
  const std::size_t element = sizeOf(header.format);
  if (element == 0) {
    return malformedChunk(
        fmt::format("elements of the unknown format {}", static_cast<std::uint32_t>(header.format)));
  }
  if (header.width > kMostPixelsPerSide || header.height > kMostPixelsPerSide) {
    return malformedChunk(fmt::format("an image of {} x {}", header.width, header.height));
  }
  // The newest firmware gives its info chunk the image's width and height although it is no image;
  // so whether the data holds as many elements is checked where it is read as an image
  // (frame_content.cpp).
  return ChunkInBytes{std::move(chunk), chunk_size};
}

void appendChunk(Bytes& bytes, const ChunkHeader& header, std::span<const std::byte> data) {
  // The attributes end with a zero, and the header with them at a multiple of 4.
  const std::size_t text =
      header.attributes.empty() ? 0 : (header.attributes.size() + 1 + 3) / 4 * 4;
  const std::size_t header_size = kHeaderSizeV2 + text;
  const ChunkHeader::Time time = header.time.value_or(ChunkHeader::Time{});
  for (const auto number :
       {static_cast<std::uint32_t>(header.type),
        static_cast<std::uint32_t>(header_size + data.size()),
        static_cast<std::uint32_t>(header_size), std::uint32_t{text > 0 ? 3U : 2U}, header.width,
        header.height, static_cast<std::uint32_t>(header.format), header.time_us,
        header.frame_count, header.status, time.seconds, time.nanoseconds}) {
    appendNumber(bytes, number);
  }
  appendText(bytes, header.attributes);
  bytes.resize(bytes.size() + text - header.attributes.size());
  bytes.insert(bytes.end(), data.begin(), data.end());
}

std::optional<double> distanceResolution(const ChunkHeader& header) {
  // One number of a flat object of numbers: found by its key, without a JSON reader.
  constexpr std::string_view key = "\"DistanceResolution\":";
  const std::size_t at = header.attributes.find(key);
  if (at == std::string::npos) return std::nullopt;
  const char* begin = header.attributes.data() + at + key.size();
  const char* end = header.attributes.data() + header.attributes.size();
  while (begin < end && *begin == ' ') ++begin;
  double value = 0.0;
  const auto read = std::from_chars(begin, end, value);
  if (read.ec != std::errc{} || !(value > 0.0 && value < 1.0)) return std::nullopt;
  return value;
}

}  // namespace toftwin::o3d303
