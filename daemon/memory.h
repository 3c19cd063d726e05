// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <malloc.h>

namespace toftwin::daemon {

/// Images come and go with every frame. Left to itself, glibc hands their memory back to the kernel each time,
/// and the kernel clears it again: a seventh of a simulated frame. One arena, or each thread would keep its own.
inline void keepFreedMemory() {
#if defined(__GLIBC__)
  ::mallopt(M_ARENA_MAX, 1);
  ::mallopt(M_MMAP_THRESHOLD, 32 << 20);
  ::mallopt(M_TRIM_THRESHOLD, 256 << 20);
#endif
}

}  // namespace toftwin::daemon
