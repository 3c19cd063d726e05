// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <stop_token>
#include <thread>

namespace toftwin::openni2 {

/// Signals go to the threads of the program whose process this is, not to those that start meanwhile.
class SignalsBlocked {
 public:
  SignalsBlocked();
  ~SignalsBlocked();
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;

 private:
  struct Mask;
  std::unique_ptr<Mask> before_;
};

/// A thread in somebody else's process.
class Worker {
 public:
  explicit Worker(std::function<void(std::stop_token)> run);
  ~Worker() { finish(); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Asks it to stop and waits. False: it is the caller itself (a program's callback, which ends what called it), or
  /// held up where it calls OpenNI2, which may hold the lock that it wants while it waits for us (Context::shutdown
  /// does, of 2.2.0.33). Then it is left behind, and this module stays in memory: what it uses must not be freed.
  bool finish();

 private:
  std::stop_source stop_;
  std::future<void> ended_;
  std::thread thread_;
};

}  // namespace toftwin::openni2
