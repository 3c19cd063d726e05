// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

namespace toftwin::daemon {

/// A facade's one thread, on which all its handlers run. Whatever they throw is logged, and the others run
/// on.
class EventThread {
 public:
  /// How other threads reach it; they may keep it longer than the thread lasts.
  class Door {
   public:
    explicit Door(boost::asio::io_context& io) : io_(&io) {}
    /// Runs `work` on the thread; drops it if the thread has been stopped.
    void post(std::function<void()> work);

   private:
    friend class EventThread;
    void close();
    std::mutex mutex_;
    boost::asio::io_context* io_;
  };

  explicit EventThread(std::string name);
  ~EventThread() { stop(); }
  EventThread(const EventThread&) = delete;
  EventThread& operator=(const EventThread&) = delete;

  /// For what is made before start(), and on the thread itself.
  [[nodiscard]] boost::asio::io_context& io() { return io_; }
  /// Shared with everyone who may still want to post when the thread is gone.
  [[nodiscard]] const std::shared_ptr<Door>& door() const { return door_; }
  void start();
  /// Before others of this computer that want its processors, if the process may have that (as root, or by
  /// RLIMIT_NICE): for what a camera's hardware would do in time however busy the computer is.
  void startUrgent();
  /// Waits for the handler that runs; none runs afterwards.
  void stop();

 private:
  void run();

  const std::string name_;
  boost::asio::io_context io_{1};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> stay_{io_.get_executor()};
  const std::shared_ptr<Door> door_ = std::make_shared<Door>(io_);
  std::jthread thread_;
};

/// Work that a facade's thread does again and again. It must not outlast what the work uses, and the thread
/// is stopped before it goes.
class Repeating {
 public:
  Repeating(boost::asio::io_context& io, std::chrono::milliseconds interval, std::function<void()> work)
      : timer_(io), interval_(interval), work_(std::move(work)) {}
  /// The first time now; what throws is done again all the same.
  void start() {
    timer_.expires_after(interval_);
    timer_.async_wait([this](boost::system::error_code cancelled) {
      if (!cancelled) start();
    });
    work_();
  }

 private:
  boost::asio::steady_timer timer_;
  const std::chrono::milliseconds interval_;
  const std::function<void()> work_;
};

}  // namespace toftwin::daemon
