// SPDX-License-Identifier: Apache-2.0
#include "daemon/line_queue.h"

#include <poll.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <systemd/sd-journal.h>
#include <unistd.h>

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <climits>
#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

namespace toftwin::daemon {
namespace {

constexpr std::chrono::milliseconds kLastWords{500};
constexpr int kLookUpMs = 50;  ///< how often a write that waits asks whether it is over

}  // namespace

struct LineQueue::State {
  explicit State(Write how) : write(std::move(how)) {}
  void run() noexcept;
  bool next(Line& line, bool& is_notice);
  [[nodiscard]] bool isOver() const {
    const std::scoped_lock lock{mutex};
    return is_over;
  }

  const Write write;
  mutable std::mutex mutex;  // guards all below
  std::condition_variable changed;
  std::deque<Line> lines;
  std::size_t bytes = 0;
  std::uint64_t lost = 0, told = 0;
  bool is_flowing = true;    ///< the last line was written
  bool is_stopping = false;  ///< writes what waits, and ends
  bool is_over = false;      ///< writes no more
  bool has_ended = false;
};

/// False at the end.
bool LineQueue::State::next(Line& line, bool& is_notice) {
  std::unique_lock lock{mutex};
  changed.wait(lock, [this] { return !lines.empty() || is_stopping; });
  if (lines.empty() || is_over) return false;
  is_notice = is_flowing && lost > told;
  if (is_notice) {
    line = {4, fmt::format("{} lines of this log were lost: nobody took them in time\n", lost - told)};
    told = lost;
    return true;
  }
  line = std::move(lines.front());
  lines.pop_front();
  bytes -= line.text.size();
  return true;
}

/// A line that cannot be made or written, for want of memory say, is lost.
void LineQueue::State::run() noexcept {
  for (bool goes_on = true; goes_on;) {
    bool is_written = false, is_notice = false;
    try {
      Line line;
      goes_on = next(line, is_notice);
      is_written = !goes_on || write(line, [this] { return isOver(); });
    } catch (...) {
      is_written = false;
    }
    const std::scoped_lock lock{mutex};
    is_flowing = is_written;
    if (!is_written && !is_notice) ++lost;
  }
  const std::scoped_lock lock{mutex};
  has_ended = true;
  changed.notify_all();
}

LineQueue::LineQueue(Write write) : state_(std::make_shared<State>(std::move(write))) {
  std::thread{[state = state_] { state->run(); }}.detach();
}

LineQueue::~LineQueue() {
  std::unique_lock lock{state_->mutex};
  state_->is_stopping = true;
  state_->changed.notify_all();
  const auto has_ended = [this] { return state_->has_ended; };
  if (state_->changed.wait_for(lock, kLastWords, has_ended)) return;
  state_->is_over = true;
  state_->changed.wait_for(lock, std::chrono::milliseconds{4 * kLookUpMs}, has_ended);
}

void LineQueue::put(Line line) noexcept {
  const std::scoped_lock lock{state_->mutex};
  const std::size_t size = line.text.size();
  if (state_->lines.size() >= kMostLines || state_->bytes + size > kMostBytes) {
    ++state_->lost;
    return;
  }
  try {
    state_->lines.push_back(std::move(line));
  } catch (...) {
    ++state_->lost;
    return;
  }
  state_->bytes += size;
  state_->changed.notify_all();
}

std::uint64_t LineQueue::lost() const noexcept {
  const std::scoped_lock lock{state_->mutex};
  return state_->lost;
}

LineQueue::Write toDescriptor(int descriptor) {
  return [descriptor](const LineQueue::Line& line, const std::function<bool()>& is_over) {
    std::size_t written = 0;
    if (descriptor < 0) return false;
    while (written < line.text.size()) {
      pollfd room{.fd = descriptor, .events = POLLOUT, .revents = 0};
      const int ready = ::poll(&room, 1, kLookUpMs);
      if (is_over()) return false;
      if (ready == 0 || (ready < 0 && errno == EINTR)) continue;
      // A pipe is ready when it has room for so many.
      const std::size_t part = std::min<std::size_t>(line.text.size() - written, PIPE_BUF);
      const ssize_t count = ::write(descriptor, line.text.data() + written, part);
      if (count < 0 && (errno == EINTR || errno == EAGAIN)) continue;
      if (count <= 0) return false;
      written += static_cast<std::size_t>(count);
    }
    return true;
  };
}

LineQueue::Write toJournal(int descriptor) {
  return [otherwise = toDescriptor(descriptor)](const LineQueue::Line& line, const std::function<bool()>& is_over) {
    std::string_view text = line.text;
    if (text.ends_with('\n')) text.remove_suffix(1);
    std::string message = fmt::format("MESSAGE={}", text), priority = fmt::format("PRIORITY={}", line.priority);
    std::string who = "SYSLOG_IDENTIFIER=toftwind";
    const iovec fields[]{{message.data(), message.size()}, {priority.data(), priority.size()}, {who.data(), who.size()}};
    return ::sd_journal_sendv(fields, 3) == 0 || otherwise(line, is_over);
  };
}

bool isJournal(int descriptor) {
  const char* stream = std::getenv("JOURNAL_STREAM");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  struct stat about {};
  if (stream == nullptr || ::fstat(descriptor, &about) != 0) return false;
  return fmt::format("{}:{}", about.st_dev, about.st_ino) == stream;
}

}  // namespace toftwin::daemon
