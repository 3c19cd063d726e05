// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <toftwin/geometry.h>

namespace toftwin::sim {

/// Running means of the indirect light that falls on the scene's surfaces, by cubic cells of space and
/// by which of six ways a surface faces. Reading is safe from many threads while nobody writes.
class IrradianceCells {
 public:
  /// Which cell a place belongs to; 0 is none.
  using Key = std::uint64_t;

  /// `channels` numbers are kept for each cell.
  IrradianceCells(double cell_size_m, std::size_t channels);

  [[nodiscard]] Key keyOf(Vec3d place, Vec3d normal) const;
  struct Known {
    std::span<const float> means;  ///< empty if fewer than kEnough samples are known
    int samples;                   ///< that are remembered
  };
  [[nodiscard]] Known find(Key key) const;
  /// Has the memory read that find() and add() will want.
  void prepare(Key key) const;
  /// Adds a sample to the cell's means. The newer a sample the more it counts, as early ones knew less of
  /// the light on other surfaces: the k-th of n has the share 2k/n(n+1), up to n = `memory`.
  void add(Key key, std::span<const float> sample, int memory);

  static constexpr int kEnough = 4;

 private:
  [[nodiscard]] std::size_t slotOf(Key key) const;

  double per_cell_size_;
  std::size_t channels_, used_ = 0;
  std::vector<Key> keys_;
  std::vector<int> counts_;
  std::vector<float> means_;  ///< [slot][channel]
};

}  // namespace toftwin::sim
