// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace toftwin::daemon {

/// Lines on their way to a place that may be full, slow or gone: a pipe that nobody reads, a disk, the journal. Whoever
/// puts a line never waits for that place: a thread of its own writes. What is too much is lost and counted, and the first
/// line after that says how many were. May be used from any thread.
class LineQueue {
 public:
  struct Line {
    int priority = 6;  ///< of syslog(3)
    std::string text;
  };
  /// Writes a line, on the queue's thread; gives up, as false, where there is no place any more, or when `is_over`.
  using Write = std::function<bool(const Line& line, const std::function<bool()>& is_over)>;

  static constexpr std::size_t kMostBytes = 1U << 20U;  ///< that wait
  static constexpr std::size_t kMostLines = 4096;

  explicit LineQueue(Write write);
  /// Gives what waits half a second to be written; a write that is stuck then is left to the end of the process.
  ~LineQueue();
  LineQueue(const LineQueue&) = delete;
  LineQueue& operator=(const LineQueue&) = delete;

  void put(Line line) noexcept;
  /// Lines so far that were not written.
  [[nodiscard]] std::uint64_t lost() const noexcept;

 private:
  struct State;
  std::shared_ptr<State> state_;  // shared with its thread
};

/// Writes lines to a file descriptor, which stays the caller's: never more at once than a pipe with any room takes.
LineQueue::Write toDescriptor(int descriptor);
/// Into the journal with their priority, each as one entry; to `descriptor` where there is no journal.
LineQueue::Write toJournal(int descriptor);
/// Whether standard error is a stream of the journal's.
bool isJournal(int descriptor);

}  // namespace toftwin::daemon
