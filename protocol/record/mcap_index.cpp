// SPDX-License-Identifier: Apache-2.0
// How FileReader finds its chunks: through the summary at the end, or by scanning.
#include <fmt/format.h>

#include <algorithm>

#include "protocol/record/compression.h"
#include "protocol/record/mcap_reader.h"

namespace toftwin::record::mcap {
namespace {

/// A summary larger than this is not an index of something readable; then scanning decides.
constexpr std::uint64_t kMaxSummaryBytes = 256ull << 20;
/// Schemas and channels outside of chunks.
constexpr std::uint64_t kMaxSmallRecordBytes = 64ull << 20;
constexpr std::uint64_t kMinChunkBytes = kRecordHeadBytes + 40;
constexpr std::uint64_t kMinMessageBytes = kRecordHeadBytes + 22;

}  // namespace

/// False if there is no index, or none that agrees with itself and with the file.
bool FileReader::readIndex() {
  const std::uint64_t tail_bytes = kFooterBytes + kMagic.size();
  if (!file_.holds(kMagic.size(), tail_bytes)) return false;
  const std::uint64_t footer_at = file_.size() - tail_bytes;
  const auto tail = readRecord(footer_at, tail_bytes);
  if (!tail || std::memcmp(tail->data() + kFooterBytes, kMagic.data(), kMagic.size()) != 0)
    return false;
  std::span<const std::byte> run{*tail};
  const auto record = takeRecord(run);
  if (!record || record->opcode != Opcode::Footer) return false;
  const auto footer = parseFooter(record->content);
  if (!footer || footer->summary_start == 0 || footer->summary_start > footer_at ||
      footer_at - footer->summary_start > kMaxSummaryBytes) {
    has_end_ = footer && footer->summary_start == 0;  // of a writer that makes no index
    return false;
  }
  const auto summary = readRecord(footer->summary_start, footer_at - footer->summary_start);
  if (!summary) return false;
  const auto footer_but_crc = std::span{*tail}.first(kFooterBytes - sizeof footer->summary_crc);
  if (footer->summary_crc != 0 && crc32(footer_but_crc, crc32(*summary)) != footer->summary_crc)
    return false;
  indexed_ = readSummary(*summary, footer->summary_start);
  if (!indexed_) {
    schemas_.clear();
    channels_.clear();
    places_.clear();
    statistics_ = {};
  }
  return indexed_;
}

bool FileReader::readSummary(std::span<const std::byte> summary, std::uint64_t data_end) {
  std::optional<Statistics> statistics;
  while (!summary.empty()) {
    const auto record = takeRecord(summary);
    if (!record || !learn(*record)) return false;
    if (record->opcode == Opcode::Statistics) {
      statistics = parseStatistics(record->content);
    } else if (record->opcode == Opcode::ChunkIndex) {
      const auto index = parseChunkIndex(record->content);
      if (!index || index->offset > data_end || index->length > data_end - index->offset)
        return false;
      places_.push_back({index->offset, index->length, index->start_time_ns, index->end_time_ns});
    }
  }
  std::ranges::sort(places_, {}, &Place::offset);
  for (std::size_t i = 1; i < places_.size(); ++i) {
    if (places_[i].offset - places_[i - 1].offset < places_[i - 1].length) return false;
  }
  // A writer may leave out either; then nothing is damaged, but only scanning finds the messages.
  has_end_ = !statistics || (places_.empty() && statistics->messages != 0);
  if (has_end_ || statistics->chunks != places_.size()) return false;
  std::uint64_t counted = 0;
  for (const auto& [channel, messages] : statistics->messages_per_channel) {
    if (messages > statistics->messages || !channels_.contains(channel)) return false;
    counted += messages;
  }
  if (counted != statistics->messages) return false;
  statistics_ = *std::move(statistics);
  return true;
}

/// Reads the whole file once, record by record, and notes what it holds and where it is damaged.
void FileReader::scan() {
  std::uint64_t at = kMagic.size();
  bool closed = false;
  while (!closed && at != file_.size()) {
    std::array<std::byte, kRecordHeadBytes> head{};
    std::uint64_t content = 0;
    const bool has_head = file_.holds(at, head.size()) && file_.readAt(at, head);
    if (has_head) std::memcpy(&content, head.data() + 1, sizeof content);
    if (!has_head || !file_.holds(at + head.size(), content)) {
      note(fmt::format(
          "{}: the file ends in the middle of the record at byte {}: its last {} bytes are lost",
          path().string(), at, file_.size() - at));
      break;
    }
    const auto opcode = static_cast<Opcode>(head[0]);
    if (opcode == Opcode{}) {
      note(fmt::format("{}: damaged from byte {} on: what follows, {} bytes, is not a record",
                       path().string(), at, file_.size() - at));
      break;
    }
    const Place place{at, head.size() + content, 0, 0};
    closed = !scanRecord(opcode, place);
    at += place.length;
  }
  if (!closed) {
    note(fmt::format(
        "{}: the recording was not closed, so it has no index; scanning found {} messages",
        path().string(), statistics_.messages));
  } else if (!has_end_) {
    note(fmt::format("{}: the index at the end is damaged or cut off; scanning found {} messages",
                     path().string(), statistics_.messages));
  }
  if (!closed && statistics_.messages == 0)
    note(fmt::format(
        "{}: nothing of it can be read: it ends before its first chunk is whole, and a chunk is read "
        "whole or not at all",
        path().string()));
  if (unnoted_ > 0) damage_ += fmt::format("\nand {} more places", unnoted_);
  statistics_.channels = static_cast<std::uint32_t>(channels_.size());
  statistics_.schemas = static_cast<std::uint16_t>(schemas_.size());
}

/// False where the data section ends.
bool FileReader::scanRecord(Opcode opcode, const Place& place) {
  switch (opcode) {
    case Opcode::DataEnd:
    case Opcode::Footer:
      return false;
    case Opcode::Schema:
    case Opcode::Channel:
      if (place.length > kMaxSmallRecordBytes) {
        note(damaged(place.offset, "(a schema or channel) is too long").message);
        return true;
      }
      [[fallthrough]];
    case Opcode::Chunk:
    case Opcode::Message: {
      Place counted = place;
      if (opcode == Opcode::Chunk) ++statistics_.chunks;
      const auto records =
          opcode == Opcode::Chunk ? readPlace(place) : readRecord(place.offset, place.length);
      const Result<> surveyed = records ? survey(*records, counted) : Result<>{records.error()};
      if (!surveyed) note(surveyed.error().message);
      // Records too short to be one hold nothing to come back for.
      if (opcode == Opcode::Chunk && place.length >= kMinChunkBytes) places_.push_back(counted);
      if (opcode == Opcode::Message && place.length >= kMinMessageBytes) places_.push_back(counted);
      return true;
    }
    default:
      return true;  // attachments, metadata, message indexes, and what later versions may add
  }
}

Result<> FileReader::survey(std::span<const std::byte> records, Place& place) {
  while (!records.empty()) {
    const auto record = takeRecord(records);
    if (!record) return damaged(place.offset, "holds a damaged record");
    if (auto learned = learn(*record); !learned)
      return damaged(place.offset, learned.error().message);
    if (record->opcode != Opcode::Message) continue;
    const auto message = parseMessage(record->content);
    if (!message) return damaged(place.offset, "holds a damaged message");
    count(*message, place);
  }
  return {};
}

void FileReader::count(const Message& message, Place& place) {
  const auto time = message.log_time_ns;
  const bool first_here = place.end_time_ns == 0, first = statistics_.messages == 0;
  place.start_time_ns = first_here ? time : std::min(place.start_time_ns, time);
  place.end_time_ns = std::max(place.end_time_ns, time);
  statistics_.start_time_ns = first ? time : std::min(statistics_.start_time_ns, time);
  statistics_.end_time_ns = std::max(statistics_.end_time_ns, time);
  ++statistics_.messages;
  ++statistics_.messages_per_channel[message.channel_id];
}

}  // namespace toftwin::record::mcap
