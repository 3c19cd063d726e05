// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

#include "protocol/record/file.h"
#include "protocol/record/mcap_records.h"

namespace toftwin::record::mcap {

/// Reads the messages of any MCAP file in file order, through its index, or by scanning where it
/// has none that fits. Knows nothing of frames. No length in the file is believed before it is
/// checked.
class FileReader {
 public:
  /// Error Malformed only if this is no MCAP file at all.
  static Result<FileReader> open(const std::filesystem::path& path);

  [[nodiscard]] const std::map<std::uint16_t, Channel>& channels() const { return channels_; }
  [[nodiscard]] const std::map<std::uint16_t, Schema>& schemas() const { return schemas_; }
  /// Counts and times, from the index or from scanning.
  [[nodiscard]] const Statistics& statistics() const { return statistics_; }
  [[nodiscard]] bool indexed() const { return indexed_; }
  [[nodiscard]] const std::string& damage() const { return damage_; }
  [[nodiscard]] const std::filesystem::path& path() const { return file_.path(); }

  /// The next message; its data is good until the next call. Error EndOfStream after the last.
  /// A damaged chunk is one error; the call after it goes on with the chunk behind.
  Result<Message> next();
  /// Reads all chunks once: what is wrong with those that cannot be read.
  [[nodiscard]] std::vector<Error> checkChunks() const;
  [[nodiscard]] std::size_t chunks() const { return places_.size(); }
  void rewind();
  /// The next message is the first in the file with that log time or a later one.
  void seek(std::uint64_t log_time_ns);

 private:
  /// A chunk, or a message outside of chunks.
  struct Place {
    std::uint64_t offset = 0;
    std::uint64_t length = 0;  ///< of the record with its head
    std::uint64_t start_time_ns = 0, end_time_ns = 0;
  };

  explicit FileReader(InputFile file) : file_(std::move(file)) {}
  bool readIndex();
  bool readSummary(std::span<const std::byte> summary, std::uint64_t data_end);
  void scan();
  bool scanRecord(Opcode opcode, const Place& place);
  Result<Bytes> readRecord(std::uint64_t offset, std::uint64_t length) const;
  Result<Bytes> readPlace(const Place& place) const;
  /// Notes what a chunk holds; the error if one of its records is damaged.
  Result<> survey(std::span<const std::byte> records, Place& place);
  Result<> learn(const Record& record);
  void count(const Message& message, Place& place);
  [[nodiscard]] Error damaged(std::uint64_t offset, std::string_view what) const;
  void note(std::string what);

  InputFile file_;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  Statistics statistics_;
  std::vector<Place> places_;
  bool indexed_ = false;
  bool has_end_ = false;  // ends as a closed file that has no index on purpose
  std::string damage_;
  int notes_ = 0;
  std::uint64_t unnoted_ = 0;

  std::size_t at_ = 0;  // place to load next
  Bytes loaded_;
  std::span<const std::byte> rest_;  // of loaded_, not yet given
  std::uint64_t skip_before_ns_ = 0;
};

}  // namespace toftwin::record::mcap
