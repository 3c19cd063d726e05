// SPDX-License-Identifier: Apache-2.0
#include "drivers/openni2/reading_thread.h"

#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <charconv>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>
#include <vector>

namespace toftwin::drivers::openni2 {
namespace {

constexpr const char* kThreads = "/proc/self/task";

std::vector<pid_t> threadsNamed(const std::string& name) {
  std::vector<pid_t> found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator{kThreads, error}) {
    std::string its_name;
    std::getline(std::ifstream{entry.path() / "comm"}, its_name);
    if (its_name != name) continue;
    const std::string number = entry.path().filename();
    pid_t thread = 0;
    std::from_chars(number.data(), number.data() + number.size(), thread);
    if (thread != ::gettid()) found.push_back(thread);
  }
  return found;
}

}  // namespace

/// A thread has the name of the one that starts it until it is given another, which the library does not.
std::optional<ReadingThread> ReadingThread::startedBy(const std::function<void()>& open) {
  static std::atomic<unsigned> count = 0;
  const std::string name = fmt::format("oni {}", ++count % 100'000'000U);
  std::array<char, 16> own{};
  if (pthread_getname_np(pthread_self(), own.data(), own.size()) != 0) own = {};
  pthread_setname_np(pthread_self(), name.c_str());
  open();
  const auto started = threadsNamed(name);
  pthread_setname_np(pthread_self(), own.data());
  if (started.size() != 1) return std::nullopt;
  return ReadingThread{started.front()};
}

bool ReadingThread::isAsleep() const {
  std::string stat;
  std::getline(std::ifstream{fmt::format("{}/{}/stat", kThreads, thread_)}, stat);
  const std::size_t end_of_name = stat.rfind(')');
  // "(name) S"; R is running or waiting for a processor.
  return end_of_name == std::string::npos || end_of_name + 2 >= stat.size() || stat[end_of_name + 2] != 'R';
}

void ReadingThread::waitUntilAsleep() const {
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds{2};
  while (!isAsleep() && std::chrono::steady_clock::now() < until)
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
}

}  // namespace toftwin::drivers::openni2
