// SPDX-License-Identifier: Apache-2.0
#include "sim/memory/large_blocks.h"

#include <sys/mman.h>

namespace toftwin::sim {
namespace {

constexpr std::size_t kChunks = 1024;  // addresses alone: memory comes where it is written
constexpr std::size_t kRange = kChunks * LargeBlocks::kChunk;
constexpr std::size_t kUnits = LargeBlocks::kChunk / LargeBlocks::kUnit;

/// The first of so many free units in a row from `first` on; 0 if there are none.
std::size_t firstFree(const std::uint16_t* length, std::size_t first, std::size_t units) {
  for (std::size_t at = first, from = first; at < kUnits;) {
    if (length[at] != 0) {
      from = at += length[at];
    } else if (++at - from == units) {
      return from;
    }
  }
  return 0;
}

}  // namespace

LargeBlocks::~LargeBlocks() {
  if (std::byte* begin = begin_) ::munmap(begin, kRange);
}

LargeBlocks::Chunk& LargeBlocks::chunk(std::size_t number) const {
  return *reinterpret_cast<Chunk*>(begin_.load(std::memory_order_relaxed) + number * kChunk);
}

/// Refused where addresses are limited (ulimit -v) or all memory must be there before it is promised.
bool LargeBlocks::reserve() {
  if (begin_ != nullptr) return true;
  if (is_refused_) return false;
  void* range = ::mmap(nullptr, kRange + kPage, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  is_refused_ = range == MAP_FAILED;
  if (is_refused_) return false;
  const std::size_t before = kPage - reinterpret_cast<std::uintptr_t>(range) % kPage;  // up to a large page
  auto* begin = static_cast<std::byte*>(range) + before;
  ::munmap(range, before);
  if (before < kPage) ::munmap(begin + kRange, kPage - before);
  wantLargePages(begin, kRange);
  begin_ = begin;
  return true;
}

void* LargeBlocks::take(std::size_t bytes) {
  if (bytes < kLeast || bytes > kMost) return nullptr;
  constexpr std::size_t kOwn = (sizeof(Chunk) + kUnit - 1) / kUnit;  // a chunk's first units hold its table
  const std::size_t units = (bytes + kUnit - 1) / kUnit;
  const std::scoped_lock lock{mutex_};
  if (!reserve()) return nullptr;
  for (std::size_t number = 0; number < kChunks; ++number) {
    Chunk& at = chunk(number);
    if (at.used + units > kUnits - kOwn) continue;
    const std::size_t unit = firstFree(at.length, kOwn, units);
    if (unit == 0) continue;
    at.length[unit] = static_cast<std::uint16_t>(units);
    at.used += static_cast<std::uint32_t>(units);
    spares_ -= at.is_spare;
    at.is_spare = 0;
    if (number == opened_) ++opened_;
    return reinterpret_cast<std::byte*>(&at) + unit * kUnit;
  }
  return nullptr;
}

bool LargeBlocks::has(const void* block) const {
  const std::byte* begin = begin_.load(std::memory_order_acquire);
  // Numbers: pointers into different memory have no order.
  return begin != nullptr && reinterpret_cast<std::uintptr_t>(block) - reinterpret_cast<std::uintptr_t>(begin) < kRange;
}

void LargeBlocks::give(void* block) {
  const std::scoped_lock lock{mutex_};
  const auto offset = static_cast<std::size_t>(static_cast<std::byte*>(block) - begin_.load());
  const std::size_t number = offset / kChunk;
  Chunk& at = chunk(number);
  std::uint16_t& length = at.length[offset % kChunk / kUnit];
  at.used -= length;
  length = 0;
  if (at.used != 0) return;
  if (spares_ < kSpares) {
    at.is_spare = 1;
    ++spares_;
  } else {
    ::madvise(&at, kChunk, MADV_DONTNEED);  // all zero then, as an empty chunk is
  }
}

std::size_t LargeBlocks::bytesInUse() const {
  const std::scoped_lock lock{mutex_};
  std::size_t units = 0;
  for (std::size_t number = 0; number < opened_; ++number) units += chunk(number).used;
  return units * kUnit;
}

std::size_t LargeBlocks::chunksHeld() const {
  const std::scoped_lock lock{mutex_};
  std::size_t held = spares_;
  for (std::size_t number = 0; number < opened_; ++number) held += chunk(number).used != 0 ? 1 : 0;
  return held;
}

void wantLargePages(void* memory, std::size_t bytes) { ::madvise(memory, bytes, MADV_HUGEPAGE); }

}  // namespace toftwin::sim
