// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cstddef>

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

/// Calls `work(first, last)` for ranges of rows that together cover 0 … height−1, on all cores.
/// What a row becomes must not depend on the other rows of the same call.
template <class Work>
void forRows(int height, const Work& work) {
  constexpr int kRowsPerTask = 16;
  inParallel(height, kRowsPerTask, work);
}

}  // namespace toftwin::sim
