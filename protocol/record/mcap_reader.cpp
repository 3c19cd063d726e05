// SPDX-License-Identifier: Apache-2.0
#include "protocol/record/mcap_reader.h"

#include <fmt/format.h>

#include <algorithm>

#include "protocol/record/compression.h"

namespace toftwin::record::mcap {

Error FileReader::damaged(std::uint64_t offset, std::string_view what) const {
  return {Error::Code::Malformed,
          fmt::format("{}: the record at byte {} {}", path().string(), offset, what)};
}

void FileReader::note(std::string what) {
  constexpr int kMostNotes = 16;  // a hostile file could hold millions of them
  if (++notes_ > kMostNotes) {
    ++unnoted_;
  } else {
    damage_ += (damage_.empty() ? "" : "\n") + std::move(what);
  }
}

Result<FileReader> FileReader::open(const std::filesystem::path& path) {
  auto file = InputFile::open(path);
  if (!file) return file.error();
  FileReader reader{std::move(file).value()};
  std::array<std::byte, kMagic.size()> magic{};
  const bool long_enough = reader.file_.holds(0, magic.size());
  if (long_enough) {
    if (auto read = reader.file_.readAt(0, magic); !read) return read.error();
  }
  if (!long_enough || std::memcmp(magic.data(), kMagic.data(), 5) != 0) {
    return Error{
        Error::Code::Malformed,
        fmt::format("{}: this is not an MCAP recording: it does not begin as one", path.string())};
  }
  if (std::memcmp(magic.data(), kMagic.data(), magic.size()) != 0) {
    return Error{Error::Code::Incompatible,
                 fmt::format("{}: this MCAP file has another major version than 0", path.string())};
  }
  if (!reader.readIndex()) reader.scan();
  return reader;
}

Result<Bytes> FileReader::readRecord(std::uint64_t offset, std::uint64_t length) const {
  if (!file_.holds(offset, length)) return damaged(offset, "goes on beyond the end of the file");
  // The compressed records and the chunk's own fields; the file really has that many bytes.
  if (length > kMaxChunkBytes + (1u << 20)) {
    return Error{Error::Code::TooLarge,
                 fmt::format("{}: the record at byte {} has {} bytes, but {} is the most",
                             path().string(), offset, length, kMaxChunkBytes)};
  }
  Bytes bytes(static_cast<std::size_t>(length));
  if (auto read = file_.readAt(offset, bytes); !read) return read.error();
  return bytes;
}

/// The records of a chunk, decompressed and checked, or the message record itself.
Result<Bytes> FileReader::readPlace(const Place& place) const {
  auto bytes = readRecord(place.offset, place.length);
  if (!bytes) return bytes.error();
  std::span<const std::byte> run = *bytes;
  const auto record = takeRecord(run);
  if (!record || !run.empty())
    return damaged(place.offset, "does not have the length that the index says");
  if (record->opcode == Opcode::Message) return bytes;
  const auto chunk = record->opcode == Opcode::Chunk ? parseChunk(record->content) : std::nullopt;
  if (!chunk) return damaged(place.offset, "is not a whole chunk");
  auto records = decompress(chunk->head.compression, chunk->records, chunk->head.uncompressed_size);
  if (!records) {
    return Error{records.error().code,
                 damaged(place.offset, "(a chunk) " + records.error().message).message};
  }
  if (chunk->head.uncompressed_crc != 0 && crc32(*records) != chunk->head.uncompressed_crc) {
    return damaged(place.offset, "(a chunk) does not have the CRC that it should have");
  }
  return records;
}

Result<> FileReader::learn(const Record& record) {
  if (record.opcode == Opcode::Schema) {
    auto schema = parseSchema(record.content);
    if (!schema) return Error{Error::Code::Malformed, "holds a damaged schema"};
    if (schema->id != 0) schemas_.try_emplace(schema->id, *std::move(schema));
  } else if (record.opcode == Opcode::Channel) {
    auto channel = parseChannel(record.content);
    if (!channel) return Error{Error::Code::Malformed, "holds a damaged channel"};
    const auto [known, is_new] = channels_.try_emplace(channel->id, *channel);
    if (!is_new && known->second != *channel) {
      return Error{Error::Code::Malformed,
                   fmt::format("says otherwise what channel {} is", channel->id)};
    }
  }
  return {};
}

std::vector<Error> FileReader::checkChunks() const {
  std::vector<Error> errors;
  for (const Place& place : places_) {
    if (const auto read = readPlace(place); !read) errors.push_back(read.error());
  }
  return errors;
}

void FileReader::rewind() {
  at_ = 0;
  rest_ = {};
  skip_before_ns_ = 0;
}

void FileReader::seek(std::uint64_t log_time_ns) {
  rewind();
  // Every place before this one ends too early; this one may still begin too early.
  while (at_ < places_.size() && places_[at_].end_time_ns < log_time_ns) ++at_;
  skip_before_ns_ = log_time_ns;
}

Result<Message> FileReader::next() {
  while (true) {
    while (!rest_.empty()) {
      const auto record = takeRecord(rest_);
      const auto message = record && record->opcode == Opcode::Message
                               ? parseMessage(record->content)
                               : std::nullopt;
      if (!record || (record->opcode == Opcode::Message && !message)) {
        rest_ = {};
        return damaged(places_[at_ - 1].offset, "(a chunk) holds a damaged record");
      }
      if (!message) {
        if (auto learned = learn(*record); !learned) {
          rest_ = {};
          return damaged(places_[at_ - 1].offset, learned.error().message);
        }
        continue;
      }
      if (message->log_time_ns < skip_before_ns_) continue;
      if (!channels_.contains(message->channel_id)) {
        return damaged(places_[at_ - 1].offset,
                       fmt::format("holds a message of channel {}, which nothing defines",
                                   message->channel_id));
      }
      skip_before_ns_ = 0;
      return *message;
    }
    if (at_ == places_.size())
      return Error{Error::Code::EndOfStream, path().string() + ": no more frames"};
    auto loaded = readPlace(places_[at_++]);
    if (!loaded) return loaded.error();
    loaded_ = std::move(loaded).value();
    rest_ = loaded_;
  }
}

}  // namespace toftwin::record::mcap
