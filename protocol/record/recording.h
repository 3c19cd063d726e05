// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/result.h>

/// Recordings are MCAP files (mcap.dev/spec); every message is a frame exactly as on the wire.
namespace toftwin::record {

struct WriterOptions {
  std::uint64_t chunk_bytes = 8ull
                              << 20;  ///< uncompressed; what a killed recorder can lose at most
  std::chrono::milliseconds chunk_time{1000};
  int zstd_level = 1;      ///< 0: not compressed
  /// The closed file has at most so many bytes; 0: no bound.
  std::uint64_t most_bytes = 0;
  /// What writing and closing leave free on the file's disk, as far as others leave it; 0: it may be
  /// filled.
  std::uint64_t keep_free_bytes = 0;
  bool overwrite = false;  ///< otherwise a file that is there already is an error
  /// Has every chunk brought to the disk, aside, so that a power cut loses what came while that took.
  bool sync_chunks = false;
  /// Tells the time, where a chunk is not to stay open for longer than `chunk_time` by that, either, however old the frames
  /// are that come; see closeDue. Without it a file of the same frames has the same bytes.
  std::function<std::chrono::steady_clock::time_point()> now{};
  /// The first frame is a chunk of its own, so that a file is without frames for no longer than that takes to write.
  bool first_frame_at_once = false;
};

/// Appends frames. One channel per source. Each finished chunk is written with one call and then
/// stays; `close` adds the index.
class Writer {
 public:
  static Result<Writer> create(const std::filesystem::path& file, WriterOptions options = {});
  Writer(Writer&&) noexcept;
  Writer& operator=(Writer&&) noexcept;
  /// Closes, if not closed yet; use `close` to learn whether it worked.
  ~Writer();

  /// Error StorageFull when the disk is full: everything up to the last whole chunk is kept, and
  /// the file still opens. The same when the frame would break a bound of the options: everything
  /// before it is kept.
  Result<> write(const Frame& frame);
  /// Whether frames wait longer than they should: chunks are packed less and more quickly then.
  void setHurried(bool is_hurried);
  /// By when closeDue is to be called if no frame comes; nothing if no chunk is open, or without `now`.
  [[nodiscard]] std::optional<std::chrono::steady_clock::time_point> dueAt() const;
  /// Finishes the open chunk if it has been open for `chunk_time`.
  Result<> closeDue();
  Result<> close();
  /// Frames that are in the file, or will be once their chunk is finished.
  [[nodiscard]] std::uint64_t frames() const;
  /// Frames that were given but are not in the file, because the chunk they were in could not be written.
  [[nodiscard]] std::uint64_t lost() const;

 private:
  struct State;
  explicit Writer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// What is known of a recording without reading its frames.
struct Summary {
  std::map<std::string, std::uint64_t> frames_per_source;
  std::int64_t first_ns = 0, last_ns = 0;  ///< log time: `Moment::received`
  bool indexed = false;  ///< false: no usable index (killed recorder), found by scanning
  std::string damage;    ///< what was wrong and how much was lost, or empty
};

/// What a reading of all of a file finds.
struct Whole {
  std::size_t chunks = 0, damaged = 0;  ///< that its index knows, or a scan; of them, that cannot be read
  std::string first_damage;             ///< of the first of them, or empty
};

/// Reads frames in file order. Damaged or truncated files give every frame up to the damage, then
/// one error Malformed, and after it the frames of the next chunk that is whole.
class Reader {
 public:
  static Result<Reader> open(const std::filesystem::path& file);
  Reader(Reader&&) noexcept;
  Reader& operator=(Reader&&) noexcept;
  ~Reader();

  [[nodiscard]] const Summary& summary() const;
  /// The next frame of `source` (or of any, if empty). Error EndOfStream after the last.
  Result<Frame> next(std::string_view source = {});
  /// Reads all chunks once, whose CRCs say which of them are damaged; does not move the reader. It takes as long
  /// as reading and unpacking the file.
  [[nodiscard]] Whole checkWhole() const;
  void rewind();
  /// Goes to the first frame at or after that log time.
  Result<> seek(std::int64_t log_time_ns);

 private:
  struct State;
  explicit Reader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace toftwin::record
