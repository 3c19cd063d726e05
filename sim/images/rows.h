// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstddef>
#include <exception>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace toftwin::sim {

/// Calls work(first, last) for parts of [0, count), of at least `grain` where that can be, on all threads.
/// ThreadSanitizer cannot see how the TBB library hands work over and would report each hand-over as a
/// race: under it, one after the other.
template <class Work>
void inParallel(int count, int grain, const Work& work) {
#if defined(__SANITIZE_THREAD__)
  static_cast<void>(grain);
  work(0, count);
#else
  tbb::parallel_for(tbb::blocked_range<int>{0, count, static_cast<std::size_t>(grain)},
                    [&](const tbb::blocked_range<int>& part) { work(part.begin(), part.end()); });
#endif
}

/// The same in only a few parts for each thread: for work that is alike everywhere and begins anew with each part.
template <class Work>
void inFewParts(int count, int least, const Work& work) {
  constexpr int kPartsOfThread = 4;
  inParallel(count, std::max(least, count / (kPartsOfThread * tbb::this_task_arena::max_concurrency())), work);
}

/// Does both, at the same time as far as there are threads. Both come to their end, whether the other throws or not (the TBB
/// library would have the other's parallel work return early, as if it was done); then the first one's problem is thrown.
template <class First, class Second>
void together(const First& first, const Second& second) {
  std::exception_ptr problem_of_first, problem_of_second;
  const auto doFirst = [&] {
    try {
      first();
    } catch (...) {
      problem_of_first = std::current_exception();
    }
  };
  const auto doSecond = [&] {
    try {
      second();
    } catch (...) {
      problem_of_second = std::current_exception();
    }
  };
#if defined(__SANITIZE_THREAD__)
  doFirst();
  doSecond();
#else
  tbb::parallel_invoke(doFirst, doSecond);
#endif
  if (problem_of_first) std::rethrow_exception(problem_of_first);
  if (problem_of_second) std::rethrow_exception(problem_of_second);
}

/// What parts of parallel work write into, taken up by another part when one has ended: no more of them are made than
/// parts are at work at a time. (Not one for each thread: a thread that waits in one part may begin another.)
template <class Room>
class Rooms {
 public:
  template <class Make, class Work>
  void use(const Make& make, const Work& work) {
    std::unique_ptr<Room> room = take();
    if (!room) room = std::make_unique<Room>(make());
    work(*room);
    const std::scoped_lock lock{mutex_};
    free_.push_back(std::move(room));
  }

 private:
  std::unique_ptr<Room> take() {
    const std::scoped_lock lock{mutex_};
    if (free_.empty()) return nullptr;
    std::unique_ptr<Room> room = std::move(free_.back());
    free_.pop_back();
    return room;
  }

  std::mutex mutex_;
  std::vector<std::unique_ptr<Room>> free_;
};

/// Calls `work(first, last)` for ranges of rows that together cover 0 … height−1, on all cores.
/// What a row becomes must not depend on the other rows of the same call.
template <class Work>
void forRows(int height, const Work& work) {
  constexpr int kLeastRows = 16;
  inFewParts(height, kLeastRows, work);
}

}  // namespace toftwin::sim
