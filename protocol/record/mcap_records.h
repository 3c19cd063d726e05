// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

/// The records of an MCAP file (mcap.dev/spec, major version 0) as values, and their bytes: an
/// opcode, the content's length as 64 bit, the content. All numbers are little-endian.
namespace toftwin::record::mcap {

static_assert(std::endian::native == std::endian::little,
              "numbers are copied as they lie in memory");

using Bytes = std::vector<std::byte>;

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};

enum class Opcode : std::uint8_t {
  Header = 0x01,
  Footer = 0x02,
  Schema = 0x03,
  Channel = 0x04,
  Message = 0x05,
  Chunk = 0x06,
  MessageIndex = 0x07,
  ChunkIndex = 0x08,
  Statistics = 0x0B,
  SummaryOffset = 0x0E,
  DataEnd = 0x0F,
};

inline constexpr std::uint64_t kRecordHeadBytes = 9;  ///< opcode and length
inline constexpr std::uint64_t kFooterBytes = kRecordHeadBytes + 8 + 8 + 4;

struct Schema {
  std::uint16_t id = 0;
  std::string name;
  std::string encoding;
  Bytes data;
  bool operator==(const Schema&) const = default;
};

struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;
  std::string topic;
  std::string message_encoding;
  std::map<std::string, std::string> metadata;
  bool operator==(const Channel&) const = default;
};

/// `data` points into whatever the message was parsed from.
struct Message {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  std::span<const std::byte> data;
};

/// All of a chunk but its records.
struct ChunkHead {
  std::uint64_t start_time_ns = 0;
  std::uint64_t end_time_ns = 0;
  std::uint64_t uncompressed_size = 0;
  std::uint32_t uncompressed_crc = 0;  ///< 0: not known
  std::string compression;             ///< "", "zstd", "lz4"
};

struct MessageIndex {
  struct Entry {
    std::uint64_t log_time_ns;
    std::uint64_t offset;  ///< of the message record in the uncompressed chunk
  };
  std::uint16_t channel_id = 0;
  std::vector<Entry> entries;
};

struct ChunkIndex {
  std::uint64_t start_time_ns = 0;
  std::uint64_t end_time_ns = 0;
  std::uint64_t offset = 0;  ///< of the chunk record in the file
  std::uint64_t length = 0;  ///< of the chunk record, opcode and length included
  std::map<std::uint16_t, std::uint64_t> message_index_offsets;
  std::uint64_t message_index_length = 0;
  std::string compression;
  std::uint64_t compressed_size = 0;
  std::uint64_t uncompressed_size = 0;
};

struct Statistics {
  std::uint64_t messages = 0;
  std::uint16_t schemas = 0;
  std::uint32_t channels = 0;
  std::uint32_t attachments = 0;
  std::uint32_t metadata = 0;
  std::uint32_t chunks = 0;
  std::uint64_t start_time_ns = 0;
  std::uint64_t end_time_ns = 0;
  std::map<std::uint16_t, std::uint64_t> messages_per_channel;
};

struct SummaryOffset {
  Opcode group{};
  std::uint64_t start = 0;
  std::uint64_t length = 0;
};

struct Footer {
  std::uint64_t summary_start = 0;         ///< 0: no summary
  std::uint64_t summary_offset_start = 0;  ///< 0: none
  std::uint32_t summary_crc = 0;           ///< 0: not known
};

/// Appends numbers, texts and records to bytes.
class Appender {
 public:
  explicit Appender(Bytes& out) : out_(out) {}
  template <class Number>
  requires std::is_integral_v<Number>
  void number(Number value) { raw(std::as_bytes(std::span{&value, 1})); }
  void raw(std::span<const std::byte> bytes) {
    out_.insert(out_.end(), bytes.begin(), bytes.end());
  }
  void text(std::string_view text);
  /// Starts a record or a part with a length before it; the end sets the length.
  std::size_t begin(Opcode opcode);
  void end(std::size_t begun);

 private:
  Bytes& out_;
};

void append(Bytes& out, const Schema& schema);
void append(Bytes& out, const Channel& channel);
/// The head of a message; its `data` follows from `pieces`, in order.
void append(Bytes& out, const Message& head, std::span<const std::span<const std::byte>> pieces);
void append(Bytes& out, const ChunkHead& head, std::span<const std::byte> compressed);
void append(Bytes& out, const MessageIndex& index);
void append(Bytes& out, const ChunkIndex& index);
void append(Bytes& out, const Statistics& statistics);
void append(Bytes& out, const SummaryOffset& offset);
/// A Header record with that library name, after the magic. `profile`: one of the registry, as "ros2", or none.
void appendStart(Bytes& out, std::string_view library, std::string_view profile = {});
void appendDataEnd(Bytes& out, std::uint32_t data_crc);
/// Footer and magic; `summary` is what `footer.summary_start` points to, for its CRC.
void appendEnd(Bytes& out, Footer footer, std::span<const std::byte> summary);

/// One record of a run of records. `content` points into the run.
struct Record {
  Opcode opcode{};
  std::span<const std::byte> content;
};
/// Cuts the first record off `bytes`; nothing if its length is beyond them.
std::optional<Record> takeRecord(std::span<const std::byte>& bytes);

// Parsers of a record's content; nothing if it is too short or a length in it lies. Bytes beyond
// the known fields are ignored, as the specification wants it.
std::optional<Schema> parseSchema(std::span<const std::byte> content);
std::optional<Channel> parseChannel(std::span<const std::byte> content);
std::optional<Message> parseMessage(std::span<const std::byte> content);
/// The chunk's head, and its compressed records as a part of `content`.
struct Chunk {
  ChunkHead head;
  std::span<const std::byte> records;
};
std::optional<Chunk> parseChunk(std::span<const std::byte> content);
std::optional<MessageIndex> parseMessageIndex(std::span<const std::byte> content);
std::optional<ChunkIndex> parseChunkIndex(std::span<const std::byte> content);
std::optional<Statistics> parseStatistics(std::span<const std::byte> content);
std::optional<Footer> parseFooter(std::span<const std::byte> content);

/// CRC-32 as in zlib and PNG, which MCAP uses everywhere; `before` continues one.
std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t before = 0);

}  // namespace toftwin::record::mcap
