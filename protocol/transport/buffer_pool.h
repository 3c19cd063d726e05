// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>

#include "protocol/wire/codec.h"

namespace toftwin::transport {

/// Memory for received bodies that is used again when the last holder of a frame lets go, in any
/// thread. Fresh memory costs a page fault per 4 KiB, more than receiving the bytes. Keeps at most
/// `kept` pieces.
class BufferPool {
 public:
  explicit BufferPool(std::size_t kept = 4);
  /// At a multiple of 64, not initialised. Outlives the pool if it must.
  wire::AlignedBytes allocate(std::size_t size);

 private:
  struct Shelf;
  std::shared_ptr<Shelf> shelf_;  // shared with the pieces that are out, which come back to it
};

}  // namespace toftwin::transport
