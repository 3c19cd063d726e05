// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>

// Whether operator_new.cpp has operators: sanitizers have their own. Clang says by a feature what GCC says by a macro.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define TOFTWIN_HAS_LARGE_NEW 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer) || \
    __has_feature(hwaddress_sanitizer)
#define TOFTWIN_HAS_LARGE_NEW 0
#endif
#endif
#if !defined(TOFTWIN_HAS_LARGE_NEW)
#define TOFTWIN_HAS_LARGE_NEW 1
#endif

namespace toftwin::sim {

/// Memory for what is large, images and meshes, on the processor's large pages where the kernel gives them to those
/// who ask (transparent huge pages: `always` or `madvise`). An image then takes one or two entries of the processor's
/// table of pages, not hundreds; and what one frame gives back the next one takes, without the kernel, which would
/// clear every page anew. Thread-safe.
///
/// All of it lies in one range of addresses, cut into chunks. A block is the first free place that is large enough,
/// and places that are given back are one with the free ones beside them. Some chunks without blocks are kept, the memory
/// of others goes back to the kernel.
class LargeBlocks {
 public:
  static constexpr std::size_t kPage = std::size_t{2} << 20;    ///< bytes, of the large ones
  static constexpr std::size_t kUnit = std::size_t{4} << 10;    ///< of which blocks are multiples
  static constexpr std::size_t kChunk = std::size_t{32} << 20;
  static constexpr std::size_t kSpares = 8;  ///< chunks that are kept without blocks, at most
  static constexpr std::size_t kLeast = std::size_t{32} << 10, kMost = kChunk / 2;  ///< of a block

  LargeBlocks() = default;
  ~LargeBlocks();
  LargeBlocks(const LargeBlocks&) = delete;
  LargeBlocks& operator=(const LargeBlocks&) = delete;

  /// At least so many bytes, of no certain content, that begin at a multiple of kUnit; nullptr if it is not for
  /// kLeast to kMost bytes, or where there are none left.
  void* take(std::size_t bytes);
  /// Whether take() gave it.
  [[nodiscard]] bool has(const void* block) const;
  void give(void* block);
  /// In blocks that were taken and not given back.
  [[nodiscard]] std::size_t bytesInUse() const;
  /// Chunks whose memory is not the kernel's.
  [[nodiscard]] std::size_t chunksHeld() const;

  // Around a fork, so that no other thread is in here while the child's copy is made.
  void lock() { mutex_.lock(); }
  void unlock() { mutex_.unlock(); }

 private:
  /// What a chunk begins with; all zero if it is empty.
  struct Chunk {
    std::uint32_t used;      ///< units
    std::uint32_t is_spare;  ///< 1: it has no blocks, and its memory is kept
    std::uint16_t length[kChunk / kUnit];  ///< by unit: of the block that begins there, or 0
  };

  bool reserve();
  [[nodiscard]] Chunk& chunk(std::size_t number) const;

  mutable std::mutex mutex_;
  std::atomic<std::byte*> begin_ = nullptr;  ///< of the range, once there is one
  std::size_t opened_ = 0;                   ///< chunks that ever had a block
  std::size_t spares_ = 0;
  bool is_refused_ = false;
};

/// What operator new has taken of them, in a program that is linked with ours (operator_new.cpp).
std::size_t largeBytesInUse();

/// Asks for large pages for what lies in so many bytes from a multiple of LargeBlocks::kPage on.
void wantLargePages(void* memory, std::size_t bytes);

}  // namespace toftwin::sim
