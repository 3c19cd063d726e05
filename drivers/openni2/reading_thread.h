// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>

namespace toftwin::drivers::openni2 {

/// The library's thread that reads a file. It goes through the device's streams without a lock, at the end of the file
/// without a pause, so that a stream which is destroyed meanwhile ends the process. Once its streams are stopped it
/// looks every hundredth of a second, and sleeps in between.
class ReadingThread {
 public:
  /// That which `open` starts; none if there is none, or more than one.
  static std::optional<ReadingThread> startedBy(const std::function<void()>& open);
  /// Whether it waits for something; true if it has ended.
  [[nodiscard]] bool isAsleep() const;
  /// Returns when it is asleep, or after two seconds: it does not get its turn on a machine with too much to do.
  void waitUntilAsleep() const;

 private:
  explicit ReadingThread(pid_t thread) : thread_(thread) {}
  pid_t thread_;
};

}  // namespace toftwin::drivers::openni2
