// SPDX-License-Identifier: Apache-2.0
#include "protocol/transport/buffer_pool.h"

#include <algorithm>
#include <iterator>
#include <mutex>
#include <utility>
#include <vector>

namespace toftwin::transport {

struct BufferPool::Shelf {
  std::mutex mutex;
  std::size_t kept = 0;
  std::vector<wire::AlignedBytes> pieces;

  /// A piece that is large enough but not wastefully large, or an empty one. The one that came back
  /// last is the one most likely still in the CPU's caches.
  wire::AlignedBytes take(std::size_t size) {
    const std::scoped_lock lock{mutex};
    const auto fits = std::find_if(pieces.rbegin(), pieces.rend(), [&](const auto& piece) {
      return piece.size >= size && piece.size / 2 <= size;
    });
    if (fits == pieces.rend()) return {};
    wire::AlignedBytes piece = std::move(*fits);
    pieces.erase(std::next(fits).base());
    return piece;
  }
  /// Keeps the piece, in the place of the oldest if the shelf is full.
  void put(wire::AlignedBytes piece) {
    const std::scoped_lock lock{mutex};
    if (kept == 0) return;
    if (pieces.size() == kept) pieces.erase(pieces.begin());
    pieces.push_back(std::move(piece));
  }
};

BufferPool::BufferPool(std::size_t kept) : shelf_(std::make_shared<Shelf>()) {
  shelf_->kept = kept;
  shelf_->pieces.reserve(kept);
}

wire::AlignedBytes BufferPool::allocate(std::size_t size) {
  constexpr std::size_t kWorthKeeping = 64 << 10;  // below, the heap is as good
  if (size < kWorthKeeping) return wire::allocateAligned(size);
  wire::AlignedBytes piece = shelf_->take(size);
  if (!piece.bytes) piece = wire::allocateAligned(size);
  std::byte* const memory = piece.bytes.get();
  std::shared_ptr<std::byte[]> lent{
      memory, [shelf = std::weak_ptr{shelf_}, piece = std::move(piece)](std::byte*) mutable {
        if (const auto home = shelf.lock()) home->put(std::move(piece));
      }};
  return {std::move(lent), size};
}

}  // namespace toftwin::transport
