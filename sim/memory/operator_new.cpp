// SPDX-License-Identifier: Apache-2.0
// operator new and delete of the programs that are linked with this: what is large comes from LargeBlocks, all else from
// the C library as ever.
#include <pthread.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <new>

#include "sim/memory/large_blocks.h"

#if TOFTWIN_HAS_LARGE_NEW

namespace {

using toftwin::sim::LargeBlocks;

/// Never destroyed: what other files hold to the end is given back after it would be.
LargeBlocks& largeBlocks() {
  alignas(LargeBlocks) static std::byte room[sizeof(LargeBlocks)];
  static LargeBlocks& blocks = *[] {
    auto* made = ::new (static_cast<void*>(room)) LargeBlocks;
    ::pthread_atfork([] { largeBlocks().lock(); }, [] { largeBlocks().unlock(); }, [] { largeBlocks().unlock(); });
    return made;
  }();
  return blocks;
}

void* fromLibrary(std::size_t bytes, std::size_t alignment) {
  const auto aligned = [&](std::size_t to) -> void* {
    return bytes > SIZE_MAX - to ? nullptr : std::aligned_alloc(to, (bytes + to - 1) / to * to);
  };
  if (bytes > LargeBlocks::kMost) {
    void* block = aligned(std::max(alignment, LargeBlocks::kPage));
    if (block != nullptr) toftwin::sim::wantLargePages(block, bytes);
    return block;
  }
  return alignment > __STDCPP_DEFAULT_NEW_ALIGNMENT__ ? aligned(alignment) : std::malloc(std::max(bytes, std::size_t{1}));
}

void* allocate(std::size_t bytes, std::size_t alignment) {
  for (;;) {
    void* block = alignment <= LargeBlocks::kUnit ? largeBlocks().take(bytes) : nullptr;
    if (block == nullptr) block = fromLibrary(bytes, alignment);
    if (block != nullptr) return block;
    const std::new_handler handler = std::get_new_handler();
    if (handler == nullptr) throw std::bad_alloc{};
    handler();
  }
}

void release(void* block) noexcept {
  if (largeBlocks().has(block)) {
    largeBlocks().give(block);
  } else {
    std::free(block);
  }
}

}  // namespace

std::size_t toftwin::sim::largeBytesInUse() { return largeBlocks().bytesInUse(); }

// Those for arrays, and those that do not throw, call these.
void* operator new(std::size_t bytes) { return allocate(bytes, __STDCPP_DEFAULT_NEW_ALIGNMENT__); }
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return allocate(bytes, static_cast<std::size_t>(alignment));
}
void operator delete(void* block) noexcept { release(block); }
void operator delete(void* block, std::size_t) noexcept { release(block); }
void operator delete(void* block, std::align_val_t) noexcept { release(block); }
void operator delete(void* block, std::size_t, std::align_val_t) noexcept { release(block); }

#else

std::size_t toftwin::sim::largeBytesInUse() { return 0; }

#endif
