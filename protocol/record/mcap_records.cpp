// SPDX-License-Identifier: Apache-2.0
#include "protocol/record/mcap_records.h"

#include <zlib.h>

#include <algorithm>

namespace toftwin::record::mcap {
namespace {

template <class Map>
void appendNumbers(Appender& to, const Map& map) {
  constexpr auto kEntryBytes = sizeof(typename Map::key_type) + sizeof(typename Map::mapped_type);
  to.number(static_cast<std::uint32_t>(map.size() * kEntryBytes));
  for (const auto& [key, value] : map) {
    to.number(key);
    to.number(value);
  }
}

/// Reads numbers and texts off the front of bytes. After the first that does not fit, all are
/// zero or empty and `ok` is false.
class Taker {
 public:
  explicit Taker(std::span<const std::byte> bytes) : bytes_(bytes) {}
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] bool empty() const { return bytes_.empty(); }

  std::span<const std::byte> raw(std::uint64_t length) {
    if (!ok_ || length > bytes_.size()) {
      ok_ = false;
      bytes_ = {};
      return {};
    }
    const auto taken = bytes_.first(static_cast<std::size_t>(length));
    bytes_ = bytes_.subspan(taken.size());
    return taken;
  }
  std::span<const std::byte> rest() { return raw(bytes_.size()); }
  template <class Number>
  Number number() {
    Number value{};
    if (const auto bytes = raw(sizeof value); ok_) std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }
  std::string text() {
    const auto bytes = raw(number<std::uint32_t>());
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  Taker part() { return Taker{raw(number<std::uint32_t>())}; }

  std::map<std::uint16_t, std::uint64_t> numbers() {
    std::map<std::uint16_t, std::uint64_t> map;
    Taker inside = part();
    while (!inside.empty()) {
      const auto key = inside.number<std::uint16_t>();
      map[key] = inside.number<std::uint64_t>();
    }
    ok_ = ok_ && inside.ok();
    return map;
  }
  std::map<std::string, std::string> texts() {
    std::map<std::string, std::string> map;
    Taker inside = part();
    while (!inside.empty()) {
      std::string key = inside.text();
      map[std::move(key)] = inside.text();
    }
    ok_ = ok_ && inside.ok();
    return map;
  }

 private:
  std::span<const std::byte> bytes_;
  bool ok_ = true;
};

template <class Value>
std::optional<Value> whole(const Taker& from, Value value) {
  if (!from.ok()) return std::nullopt;
  return value;
}

}  // namespace

void Appender::text(std::string_view text) {
  number(static_cast<std::uint32_t>(text.size()));
  raw(std::as_bytes(std::span{text}));
}

std::size_t Appender::begin(Opcode opcode) {
  number(static_cast<std::uint8_t>(opcode));
  number(std::uint64_t{0});
  return out_.size();
}

void Appender::end(std::size_t begun) {
  const std::uint64_t length = out_.size() - begun;
  std::memcpy(out_.data() + begun - sizeof length, &length, sizeof length);
}

void append(Bytes& out, const Schema& schema) {
  Appender to{out};
  const auto record = to.begin(Opcode::Schema);
  to.number(schema.id);
  to.text(schema.name);
  to.text(schema.encoding);
  to.number(static_cast<std::uint32_t>(schema.data.size()));
  to.raw(schema.data);
  to.end(record);
}

void append(Bytes& out, const Channel& channel) {
  Appender to{out};
  const auto record = to.begin(Opcode::Channel);
  to.number(channel.id);
  to.number(channel.schema_id);
  to.text(channel.topic);
  to.text(channel.message_encoding);
  std::uint32_t length = 0;
  for (const auto& [key, value] : channel.metadata) {
    length += static_cast<std::uint32_t>(8 + key.size() + value.size());
  }
  to.number(length);
  for (const auto& [key, value] : channel.metadata) {
    to.text(key);
    to.text(value);
  }
  to.end(record);
}

void append(Bytes& out, const Message& head, std::span<const std::span<const std::byte>> pieces) {
  Appender to{out};
  const auto record = to.begin(Opcode::Message);
  to.number(head.channel_id);
  to.number(head.sequence);
  to.number(head.log_time_ns);
  to.number(head.publish_time_ns);
  for (const auto& piece : pieces) to.raw(piece);
  to.end(record);
}

void append(Bytes& out, const ChunkHead& head, std::span<const std::byte> compressed) {
  Appender to{out};
  const auto record = to.begin(Opcode::Chunk);
  to.number(head.start_time_ns);
  to.number(head.end_time_ns);
  to.number(head.uncompressed_size);
  to.number(head.uncompressed_crc);
  to.text(head.compression);
  to.number(std::uint64_t{compressed.size()});
  to.raw(compressed);
  to.end(record);
}

void append(Bytes& out, const MessageIndex& index) {
  Appender to{out};
  const auto record = to.begin(Opcode::MessageIndex);
  to.number(index.channel_id);
  to.number(static_cast<std::uint32_t>(index.entries.size() * 16));
  for (const auto& entry : index.entries) {
    to.number(entry.log_time_ns);
    to.number(entry.offset);
  }
  to.end(record);
}

void append(Bytes& out, const ChunkIndex& index) {
  Appender to{out};
  const auto record = to.begin(Opcode::ChunkIndex);
  to.number(index.start_time_ns);
  to.number(index.end_time_ns);
  to.number(index.offset);
  to.number(index.length);
  appendNumbers(to, index.message_index_offsets);
  to.number(index.message_index_length);
  to.text(index.compression);
  to.number(index.compressed_size);
  to.number(index.uncompressed_size);
  to.end(record);
}

void append(Bytes& out, const Statistics& statistics) {
  Appender to{out};
  const auto record = to.begin(Opcode::Statistics);
  to.number(statistics.messages);
  to.number(statistics.schemas);
  to.number(statistics.channels);
  to.number(statistics.attachments);
  to.number(statistics.metadata);
  to.number(statistics.chunks);
  to.number(statistics.start_time_ns);
  to.number(statistics.end_time_ns);
  appendNumbers(to, statistics.messages_per_channel);
  to.end(record);
}

void append(Bytes& out, const SummaryOffset& offset) {
  Appender to{out};
  const auto record = to.begin(Opcode::SummaryOffset);
  to.number(static_cast<std::uint8_t>(offset.group));
  to.number(offset.start);
  to.number(offset.length);
  to.end(record);
}

void appendStart(Bytes& out, std::string_view library, std::string_view profile) {
  Appender to{out};
  to.raw(std::as_bytes(std::span{kMagic}));
  const auto record = to.begin(Opcode::Header);
  to.text(profile);
  to.text(library);
  to.end(record);
}

void appendDataEnd(Bytes& out, std::uint32_t data_crc) {
  Appender to{out};
  const auto record = to.begin(Opcode::DataEnd);
  to.number(data_crc);
  to.end(record);
}

void appendEnd(Bytes& out, Footer footer, std::span<const std::byte> summary) {
  Appender to{out};
  const std::size_t start = out.size();
  const auto record = to.begin(Opcode::Footer);
  to.number(footer.summary_start);
  to.number(footer.summary_offset_start);
  // The footer's length stands before its CRC is known, because the CRC covers it.
  const std::uint64_t length = kFooterBytes - kRecordHeadBytes;
  std::memcpy(out.data() + record - sizeof length, &length, sizeof length);
  to.number(crc32(std::span{out}.subspan(start), crc32(summary)));
  to.raw(std::as_bytes(std::span{kMagic}));
}

std::optional<Record> takeRecord(std::span<const std::byte>& bytes) {
  Taker from{bytes};
  const auto opcode = from.number<std::uint8_t>();
  const auto content = from.raw(from.number<std::uint64_t>());
  if (!from.ok() || opcode == 0) return std::nullopt;
  bytes = from.rest();
  return Record{static_cast<Opcode>(opcode), content};
}

std::optional<Schema> parseSchema(std::span<const std::byte> content) {
  Taker from{content};
  Schema schema;
  schema.id = from.number<std::uint16_t>();
  schema.name = from.text();
  schema.encoding = from.text();
  const auto data = from.raw(from.number<std::uint32_t>());
  schema.data.assign(data.begin(), data.end());
  return whole(from, std::move(schema));
}

std::optional<Channel> parseChannel(std::span<const std::byte> content) {
  Taker from{content};
  Channel channel;
  channel.id = from.number<std::uint16_t>();
  channel.schema_id = from.number<std::uint16_t>();
  channel.topic = from.text();
  channel.message_encoding = from.text();
  channel.metadata = from.texts();
  return whole(from, std::move(channel));
}

std::optional<Message> parseMessage(std::span<const std::byte> content) {
  Taker from{content};
  Message message;
  message.channel_id = from.number<std::uint16_t>();
  message.sequence = from.number<std::uint32_t>();
  message.log_time_ns = from.number<std::uint64_t>();
  message.publish_time_ns = from.number<std::uint64_t>();
  message.data = from.rest();
  return whole(from, message);
}

std::optional<Chunk> parseChunk(std::span<const std::byte> content) {
  Taker from{content};
  Chunk chunk;
  chunk.head.start_time_ns = from.number<std::uint64_t>();
  chunk.head.end_time_ns = from.number<std::uint64_t>();
  chunk.head.uncompressed_size = from.number<std::uint64_t>();
  chunk.head.uncompressed_crc = from.number<std::uint32_t>();
  chunk.head.compression = from.text();
  chunk.records = from.raw(from.number<std::uint64_t>());
  return whole(from, std::move(chunk));
}

std::optional<MessageIndex> parseMessageIndex(std::span<const std::byte> content) {
  Taker from{content};
  MessageIndex index;
  index.channel_id = from.number<std::uint16_t>();
  Taker entries{from.raw(from.number<std::uint32_t>())};
  while (!entries.empty()) {
    const auto log_time_ns = entries.number<std::uint64_t>();
    index.entries.push_back({log_time_ns, entries.number<std::uint64_t>()});
  }
  if (!entries.ok()) return std::nullopt;
  return whole(from, std::move(index));
}

std::optional<ChunkIndex> parseChunkIndex(std::span<const std::byte> content) {
  Taker from{content};
  ChunkIndex index;
  index.start_time_ns = from.number<std::uint64_t>();
  index.end_time_ns = from.number<std::uint64_t>();
  index.offset = from.number<std::uint64_t>();
  index.length = from.number<std::uint64_t>();
  index.message_index_offsets = from.numbers();
  index.message_index_length = from.number<std::uint64_t>();
  index.compression = from.text();
  index.compressed_size = from.number<std::uint64_t>();
  index.uncompressed_size = from.number<std::uint64_t>();
  return whole(from, std::move(index));
}

std::optional<Statistics> parseStatistics(std::span<const std::byte> content) {
  Taker from{content};
  Statistics statistics;
  statistics.messages = from.number<std::uint64_t>();
  statistics.schemas = from.number<std::uint16_t>();
  statistics.channels = from.number<std::uint32_t>();
  statistics.attachments = from.number<std::uint32_t>();
  statistics.metadata = from.number<std::uint32_t>();
  statistics.chunks = from.number<std::uint32_t>();
  statistics.start_time_ns = from.number<std::uint64_t>();
  statistics.end_time_ns = from.number<std::uint64_t>();
  statistics.messages_per_channel = from.numbers();
  return whole(from, std::move(statistics));
}

std::optional<Footer> parseFooter(std::span<const std::byte> content) {
  Taker from{content};
  Footer footer;
  footer.summary_start = from.number<std::uint64_t>();
  footer.summary_offset_start = from.number<std::uint64_t>();
  footer.summary_crc = from.number<std::uint32_t>();
  return whole(from, footer);
}

std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t before) {
  return static_cast<std::uint32_t>(
      ::crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace toftwin::record::mcap
