// SPDX-License-Identifier: Apache-2.0
#include "protocol/record/mcap_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "protocol/record/compression.h"

namespace toftwin::record::mcap {
namespace {

/// Two to three times as quick as level 1. Not to pack at all is quicker still, until the disk is what is waited for: then a
/// killed daemon lost up to 1.2 s, in place of 0.2 s.
constexpr int kHurriedLevel = -7;

}  // namespace

Result<FileWriter> FileWriter::create(const std::filesystem::path& path,
                                      const WriterOptions& options, std::string_view profile) {
  auto file = OutputFile::create(path, options.overwrite);
  if (!file) return file.error();
  FileWriter writer{std::move(file).value(), options};
  Bytes start;
  appendStart(start, "toftwin " TOFTWIN_VERSION, profile);
  if (auto wrote = writer.append(start); !wrote) return wrote.error();
  return writer;
}

Result<> FileWriter::append(std::span<const std::byte> bytes) {
  if (auto wrote = file_.append(bytes); !wrote) {
    failed_ =
        Error{wrote.error().code, fmt::format("{}. The recording is whole up to there: {} messages",
                                              wrote.error().message, statistics_.messages)};
    return *failed_;
  }
  data_crc_ = crc32(bytes, data_crc_);
  return {};
}

Result<std::uint16_t> FileWriter::addSchema(Schema schema) {
  if (schemas_.size() >= std::numeric_limits<std::uint16_t>::max()) {
    return Error{Error::Code::TooLarge,
                 path().string() + ": more than 65535 schemas in one recording"};
  }
  schema.id = static_cast<std::uint16_t>(schemas_.size() + 1);  // 0 means none
  const std::size_t before = open_.size();
  mcap::append(open_, schema);
  repeated_bytes_ += open_.size() - before;
  schemas_.push_back(std::move(schema));
  return schemas_.back().id;
}

Result<std::uint16_t> FileWriter::addChannel(Channel channel) {
  if (channels_.size() >= std::numeric_limits<std::uint16_t>::max()) {
    return Error{Error::Code::TooLarge,
                 path().string() + ": more than 65535 channels in one recording"};
  }
  channel.id = static_cast<std::uint16_t>(channels_.size());
  const std::size_t before = open_.size();
  mcap::append(open_, channel);
  repeated_bytes_ += open_.size() - before;
  channels_.push_back(std::move(channel));
  return channels_.back().id;
}

Result<> FileWriter::write(const Message& head,
                           std::span<const std::span<const std::byte>> pieces) {
  if (failed_) return *failed_;
  const bool first = open_messages_ == 0;
  if (first && options_.now) opened_at_ = options_.now();
  open_start_ns_ = first ? head.log_time_ns : std::min(open_start_ns_, head.log_time_ns);
  open_end_ns_ = first ? head.log_time_ns : std::max(open_end_ns_, head.log_time_ns);
  MessageIndex& index = open_index_[head.channel_id];
  index.channel_id = head.channel_id;
  index.entries.push_back({head.log_time_ns, open_.size()});
  mcap::append(open_, head, pieces);
  ++open_messages_;
  const bool due = openChunkIsDue(head.log_time_ns);
  previous_ns_ = head.log_time_ns;
  return due ? finishChunk() : Result<>{};
}

bool FileWriter::openChunkIsDue(std::uint64_t log_time_ns) const {
  const auto most =
      static_cast<std::uint64_t>(std::chrono::nanoseconds{options_.chunk_time}.count());
  // From a source slower than the chunk time every message is written at once: nobody knows when
  // the next one comes.
  const bool slow =
      messages() > 1 && log_time_ns > previous_ns_ && log_time_ns - previous_ns_ >= most;
  const bool is_first = options_.first_frame_at_once && messages() == 1;
  return is_first || open_.size() >= options_.chunk_bytes || open_end_ns_ - open_start_ns_ >= most || slow ||
         hasBeenOpenFor(options_.chunk_time);
}

bool FileWriter::hasBeenOpenFor(std::chrono::milliseconds time) const {
  return open_messages_ > 0 && options_.now && options_.now() - opened_at_ >= time;
}

std::optional<std::chrono::steady_clock::time_point> FileWriter::dueAt() const {
  if (open_messages_ == 0 || !options_.now || failed_) return std::nullopt;
  return opened_at_ + options_.chunk_time;
}

Result<> FileWriter::closeDue() { return hasBeenOpenFor(options_.chunk_time) ? finishChunk() : Result<>{}; }

/// Upper bounds of the records' sizes (opcode and length included), by mcap.dev/spec.
std::uint64_t FileWriter::closedSize(std::uint64_t message_bytes, std::uint64_t channel_bytes) const {
  constexpr std::uint64_t kMessageHead = 31, kChunkHead = 64, kMessageIndexHead = 15;
  constexpr std::uint64_t kIndexEntry = 16, kChunkIndex = 96, kMapEntry = 10;
  constexpr std::uint64_t kEnds = 512;  // data end, statistics, summary offsets, footer, magic
  const std::uint64_t channels = channels_.size() + 1;
  const std::uint64_t open = open_.size() + channel_bytes + kMessageHead + message_bytes;
  const std::uint64_t chunk = kChunkHead + (options_.zstd_level > 0 ? mostZstdBytes(open) : open) +
                              kMessageIndexHead * channels + kIndexEntry * (open_messages_ + 1);
  const std::uint64_t summary = repeated_bytes_ + channel_bytes +
                                (chunks_.size() + 1) * (kChunkIndex + kMapEntry * channels) +
                                kMapEntry * channels + kEnds;
  return file_.size() + chunk + summary;
}

Result<> FileWriter::finishChunk() {
  if (failed_) return *failed_;
  if (open_.empty()) return {};
  const bool is_packed = options_.zstd_level > 0 && open_.size() <= kMaxUnpackedBytes;
  ChunkHead head{.start_time_ns = open_start_ns_,
                 .end_time_ns = open_end_ns_,
                 .uncompressed_size = open_.size(),
                 .uncompressed_crc = crc32(open_),
                 .compression = is_packed ? "zstd" : ""};
  Bytes compressed;
  if (is_packed) compressed = compressZstd(open_, is_hurried_ ? kHurriedLevel : options_.zstd_level);
  const std::span<const std::byte> stored = is_packed ? compressed : open_;

  ChunkIndex index{.start_time_ns = head.start_time_ns,
                   .end_time_ns = head.end_time_ns,
                   .offset = file_.size(),
                   .length = 0,
                   .message_index_offsets = {},
                   .message_index_length = 0,
                   .compression = head.compression,
                   .compressed_size = stored.size(),
                   .uncompressed_size = head.uncompressed_size};
  Bytes records;
  records.reserve(stored.size() + 4096);
  mcap::append(records, head, stored);
  index.length = records.size();
  for (const auto& [channel, messages] : open_index_) {
    index.message_index_offsets[channel] = index.offset + records.size();
    mcap::append(records, messages);
  }
  index.message_index_length = records.size() - index.length;

  Result<> wrote = append(records);
  if (wrote && options_.sync_chunks) {
    wrote = file_.sync();
    if (!wrote) failed_ = wrote.error();
  }
  if (wrote) {
    count(head);
    chunks_.push_back(std::move(index));
  } else {
    lost_ += open_messages_;
  }
  open_.clear();
  open_index_.clear();
  open_messages_ = 0;
  return wrote;
}

void FileWriter::count(const ChunkHead& chunk) {
  ++statistics_.chunks;
  if (open_messages_ == 0) return;
  const bool first = statistics_.messages == 0;
  statistics_.start_time_ns =
      first ? chunk.start_time_ns : std::min(statistics_.start_time_ns, chunk.start_time_ns);
  statistics_.end_time_ns = std::max(statistics_.end_time_ns, chunk.end_time_ns);
  statistics_.messages += open_messages_;
  for (const auto& [channel, index] : open_index_) {
    statistics_.messages_per_channel[channel] += index.entries.size();
  }
}

Result<> FileWriter::close() {
  if (closed_) return failed_ ? Result<>{*failed_} : Result<>{};
  closed_ = true;
  const Result<> finished = finishChunk();

  Bytes end;
  appendDataEnd(end, data_crc_);
  const std::uint64_t before = file_.size();
  const std::size_t summary_at = end.size();
  statistics_.schemas = static_cast<std::uint16_t>(schemas_.size());
  statistics_.channels = static_cast<std::uint32_t>(channels_.size());
  Bytes offsets;
  const auto addGroup = [&](Opcode group, const auto& records) {
    const std::size_t start = end.size();
    for (const auto& record : records) mcap::append(end, record);
    if (end.size() > start) {
      mcap::append(offsets, SummaryOffset{group, before + start, end.size() - start});
    }
  };
  addGroup(Opcode::Schema, schemas_);
  addGroup(Opcode::Channel, channels_);
  addGroup(Opcode::Statistics, std::span{&statistics_, 1});
  addGroup(Opcode::ChunkIndex, chunks_);
  const Footer footer{.summary_start = before + summary_at,
                      .summary_offset_start = before + end.size(),
                      .summary_crc = 0};
  end.insert(end.end(), offsets.begin(), offsets.end());
  const Bytes summary{end.begin() + static_cast<std::ptrdiff_t>(summary_at), end.end()};
  appendEnd(end, footer, summary);

  const Result<> appended = append(end);
  const Result<> closed = file_.close();
  if (!finished) return finished;
  return appended ? closed : appended;
}

}  // namespace toftwin::record::mcap
