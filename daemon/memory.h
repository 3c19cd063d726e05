// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <malloc.h>

namespace toftwin::daemon {

/// Frames' memory comes and goes. Left to itself, glibc hands it back to the kernel each time, and the kernel clears it again.
/// What is large is not glibc's (sim/memory), but that of Embree, OpenCV and other C libraries is. One arena, or each thread would
/// keep its own.
inline void keepFreedMemory() {
#if defined(__GLIBC__)
  ::mallopt(M_ARENA_MAX, 1);
  ::mallopt(M_MMAP_THRESHOLD, 32 << 20);
  ::mallopt(M_TRIM_THRESHOLD, 256 << 20);
#endif
}

}  // namespace toftwin::daemon
