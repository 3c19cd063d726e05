// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/event_thread.h"

#include <sys/resource.h>
#include <unistd.h>

#include <boost/asio/post.hpp>

#include <chrono>
#include <utility>

#include "daemon/thrown.h"

namespace toftwin::daemon {

void EventThread::Door::post(std::function<void()> work) {
  const std::scoped_lock lock{mutex_};
  if (io_ != nullptr) boost::asio::post(*io_, std::move(work));
}

void EventThread::Door::close() {
  const std::scoped_lock lock{mutex_};
  io_ = nullptr;
}

EventThread::EventThread(std::string name) : name_(std::move(name)) {}

void EventThread::start() {
  thread_ = std::jthread{[this] { run(); }};
}

void EventThread::startUrgent() {
  thread_ = std::jthread{[this] {
    constexpr int kUrgent = -10;
    static_cast<void>(
        ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kUrgent));  // this thread alone
    run();
  }};
}

void EventThread::stop() {
  door_->close();
  io_.stop();
  if (thread_.joinable()) thread_.join();
}

void EventThread::run() {
  constexpr std::chrono::milliseconds kBreath{20};
  while (!io_.stopped()) {
    try {
      io_.run();
    } catch (...) {
      logThrown(name_);
      std::this_thread::sleep_for(kBreath);  // memory may come back; and no loop at full speed
    }
  }
}

}  // namespace toftwin::daemon
