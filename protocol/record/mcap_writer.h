// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "protocol/record/file.h"
#include "protocol/record/mcap_records.h"
#include "protocol/record/recording.h"

namespace toftwin::record::mcap {

/// Writes an MCAP file of chunks, each appended with one call, and their index at the end. Knows
/// nothing of frames. After an error every call gives that error again, but `close` still adds the
/// index of what was written, where there is room for it.
class FileWriter {
 public:
  /// `profile`: one of MCAP's registry, as "ros2"; none of them is that of toftwin's frames.
  static Result<FileWriter> create(const std::filesystem::path& path, const WriterOptions& options, std::string_view profile = {});

  /// Adds a schema or a channel; `id` is set here. Error TooLarge after 65535 of them.
  Result<std::uint16_t> addSchema(Schema schema);
  Result<std::uint16_t> addChannel(Channel channel);
  /// Adds a message of a channel that was added; `head.data` is not looked at, `pieces` are.
  Result<> write(const Message& head, std::span<const std::span<const std::byte>> pieces);
  /// See Writer.
  void setHurried(bool is_hurried) { is_hurried_ = is_hurried; }
  [[nodiscard]] std::optional<std::chrono::steady_clock::time_point> dueAt() const;
  Result<> closeDue();
  Result<> close();
  /// Messages in finished chunks, which are in the file, and in the open one.
  [[nodiscard]] std::uint64_t messages() const { return statistics_.messages + open_messages_; }
  /// Messages that were taken but did not come into the file, with their chunk.
  [[nodiscard]] std::uint64_t lost() const { return lost_; }
  /// What the file would have at most if it were closed after another message of that size, on one
  /// more channel whose record has at most `channel_bytes`.
  [[nodiscard]] std::uint64_t closedSize(std::uint64_t message_bytes,
                                         std::uint64_t channel_bytes) const;
  [[nodiscard]] const OutputFile& file() const { return file_; }
  [[nodiscard]] const std::filesystem::path& path() const { return file_.path(); }

 private:
  FileWriter(OutputFile file, const WriterOptions& options)
      : file_(std::move(file)), options_(options) {}
  [[nodiscard]] bool openChunkIsDue(std::uint64_t log_time_ns) const;
  [[nodiscard]] bool hasBeenOpenFor(std::chrono::milliseconds time) const;
  Result<> append(std::span<const std::byte> bytes);
  Result<> finishChunk();
  void count(const ChunkHead& chunk);

  OutputFile file_;
  WriterOptions options_;
  std::optional<Error> failed_;
  bool closed_ = false;
  bool is_hurried_ = false;
  std::uint32_t data_crc_ = 0;

  Bytes open_;  // records of the open chunk
  std::uint64_t open_messages_ = 0, lost_ = 0;
  std::uint64_t open_start_ns_ = 0, open_end_ns_ = 0;
  std::uint64_t previous_ns_ = 0;
  std::chrono::steady_clock::time_point opened_at_;  ///< when its first message came, where `now` tells
  std::map<std::uint16_t, MessageIndex> open_index_;

  std::vector<Schema> schemas_;
  std::vector<Channel> channels_;
  std::uint64_t repeated_bytes_ = 0;  ///< of their records, which the index repeats
  std::vector<ChunkIndex> chunks_;
  Statistics statistics_;
};

}  // namespace toftwin::record::mcap
