// SPDX-License-Identifier: Apache-2.0
// The daemon's io thread runs out of memory, at every allocation in turn, while it serves a client.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "running_daemon.h"

namespace {

thread_local bool is_watched = false;
std::atomic<int> left{-1};  ///< allocations of watched threads until one fails; negative: none does

void* allocate(std::size_t size) {
  if (is_watched && left >= 0 && left-- == 0) throw std::bad_alloc{};
  if (void* const memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc{};
}
void* allocate(std::size_t size, std::align_val_t alignment) {
  if (is_watched && left >= 0 && left-- == 0) throw std::bad_alloc{};
  const auto step = static_cast<std::size_t>(alignment);
  if (void* const memory = std::aligned_alloc(step, (size + step - 1) / step * step)) return memory;
  throw std::bad_alloc{};
}

}  // namespace

void* operator new(std::size_t size) { return allocate(size); }
void* operator new[](std::size_t size) { return allocate(size); }
void* operator new(std::size_t size, std::align_val_t alignment) { return allocate(size, alignment); }
void* operator new[](std::size_t size, std::align_val_t alignment) { return allocate(size, alignment); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace toftwin::daemon {
namespace {

using namespace std::chrono_literals;
using namespace test;
using Policy = SubscribeOptions::Policy;

/// What a client does. Nothing of it need work; all of it may be cut off anywhere.
void useIt(const std::string& address, int round) {
  constexpr auto kPatience = 500ms;  // for an answer that does not come; nothing depends on it
  auto client = Client::connect(address, {.timeout = kPatience});
  if (!client) return;
  static_cast<void>(client->describe("cam"));
  auto stream = client->subscribe("cam", {.policy = Policy::Queue, .queue = 4});
  if (!stream) return;
  static_cast<void>(client->startRecording("cam", "run" + std::to_string(round)));
  if (!client->trigger("cam")) return;
  if (!stream->next(kPatience)) return;
  static_cast<void>(client->stopRecording("cam"));
  static_cast<void>(client->health());
}

TEST_F(RunningDaemon, EndsNoMoreThanOneClientWhateverAllocationFails) {
  configure("recording_folder = 'recordings'\n" + kTriggered);
  auto started = Daemon::start(options());
  ASSERT_TRUE(started.ok()) << started.error().message;
  daemon_ = *std::move(started);
  thread_ = std::thread{[this] {
    is_watched = true;
    daemon_->run();
  }};
  const std::string address = "unix:" + daemon_->socketPath();
  bool was_reached = true;
  int failures = 0;
  for (int nth = 0; was_reached; ++nth) {
    left = nth;
    useIt(address, nth);
    was_reached = left.exchange(-1) < 0;
    if (was_reached) ++failures;
    auto other = Client::connect(address);
    ASSERT_TRUE(other.ok()) << "after allocation " << nth << ": " << other.error().message;
    auto stream = other->subscribe("cam", {.policy = Policy::Queue, .queue = 4});
    ASSERT_TRUE(stream.ok()) << "after allocation " << nth << ": " << stream.error().message;
    ASSERT_TRUE(other->trigger("cam").ok());
    const auto frame = stream->next(kSoon);
    ASSERT_TRUE(frame.ok()) << "after allocation " << nth << ": " << frame.error().message;
    static_cast<void>(other->stopRecording("cam"));
  }
  EXPECT_GT(failures, 50) << "the test reaches fewer places than it did";
  EXPECT_TRUE(eventually([&] { return daemon_->hub().sessions == 0; })) << "a client was left over";
}

}  // namespace
}  // namespace toftwin::daemon
