// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace toftwin::test {

/// Keeps what is logged.
class KeptLog final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  /// Of the lines with that part.
  int count(const std::string& part) {
    const std::scoped_lock lock{mutex_};
    return countOf(part);
  }
  /// Waits until so many lines with that part were logged; half a minute at most.
  bool waitFor(const std::string& part, int wanted) {
    std::unique_lock lock{mutex_};
    return logged_.wait_for(lock, std::chrono::seconds{30}, [&] { return countOf(part) >= wanted; });
  }

 private:
  [[nodiscard]] int countOf(const std::string& part) const {
    return static_cast<int>(std::ranges::count_if(
        texts_, [&](const std::string& text) { return text.find(part) != std::string::npos; }));
  }
  void sink_it_(const spdlog::details::log_msg& message) override {
    texts_.emplace_back(message.payload.begin(), message.payload.end());
    logged_.notify_all();
  }
  void flush_() override {}
  std::condition_variable logged_;
  std::vector<std::string> texts_;
};

/// Whatever is logged goes there while this lives.
class LoggingTo {
 public:
  explicit LoggingTo(std::shared_ptr<KeptLog> log) : before_(spdlog::default_logger()) {
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("test", std::move(log)));
  }
  ~LoggingTo() { spdlog::set_default_logger(before_); }
  LoggingTo(const LoggingTo&) = delete;
  LoggingTo& operator=(const LoggingTo&) = delete;

 private:
  std::shared_ptr<spdlog::logger> before_;  // shared with spdlog
};

}  // namespace toftwin::test
