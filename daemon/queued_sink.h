// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <spdlog/sinks/base_sink.h>

#include <memory>
#include <mutex>
#include <utility>

#include "daemon/line_queue.h"

namespace toftwin::daemon {

/// The log of a program: formats where it is logged, writes on a thread of its own, so that nobody who logs waits.
class QueuedSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit QueuedSink(LineQueue::Write write) : queue_(std::make_unique<LineQueue>(std::move(write))) {}
  /// Writes what waits, if it can be soon; what is logged later is lost.
  void finish() {
    std::unique_ptr<LineQueue> last;
    const std::scoped_lock lock{mutex_};
    last = std::move(queue_);
  }
  std::uint64_t lost() {
    const std::scoped_lock lock{mutex_};
    return queue_ ? queue_->lost() : 0;
  }

 private:
  static int priorityOf(spdlog::level::level_enum level) {
    if (level >= spdlog::level::err) return 3;
    if (level == spdlog::level::warn) return 4;
    return level == spdlog::level::info ? 6 : 7;
  }
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t text;
    formatter_->format(message, text);
    if (queue_) queue_->put({priorityOf(message.level), std::string{text.data(), text.size()}});
  }
  void flush_() override {}

  std::unique_ptr<LineQueue> queue_;
};

}  // namespace toftwin::daemon
