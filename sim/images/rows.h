// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace toftwin::sim {

/// Calls `work(first, last)` for ranges of rows that together cover 0 … height−1, on all cores.
/// What a row becomes must not depend on the other rows of the same call.
template <class Work>
void forRows(int height, const Work& work) {
  constexpr int kRowsPerTask = 16;
  tbb::parallel_for(tbb::blocked_range<int>{0, height, kRowsPerTask},
                    [&](const tbb::blocked_range<int>& rows) { work(rows.begin(), rows.end()); });
}

}  // namespace toftwin::sim
