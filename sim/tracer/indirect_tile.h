// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sim/tracer/indirect.h"
#include "sim/tracer/lit_points.h"

namespace toftwin::sim {

/// Sixteen coarse points, 4 × 4.
struct CoarseTile {
  Lanes<int> valid, mover;  ///< CoarseGrid::mover
  Lanes<float> x, y, z, normal_x, normal_y, normal_z;
  std::vector<Lanes<double>> sums;     ///< by channel, less what is lit
  std::vector<Lanes<double>> squares;  ///< by frequency
  std::vector<Lanes<float>> lit;       ///< by channel: what is expected from lit places
};

/// Samples the light that falls onto coarse points, tile by tile. One for each thread.
class TileGatherer {
 public:
  TileGatherer(const Tracing& tracing, const IrradianceCells& cells, const LitPoints& lights,
               const Channels& channels);

  /// Finds the points of the tile whose first one is (i, j).
  void look(int i, int j, SeenTile& seen);
  /// Takes `samples` of each of them, numbered from `first_sample` on; in turns the first also looks a surface further,
  /// for the cells.
  void gather(int i, int j, const SeenTile& seen, std::uint32_t first_sample, int samples, CellUpdate& update);
  [[nodiscard]] const CoarseTile& tile() const { return tile_; }

 private:
  void lookAtLights(const Lanes<int>& valid);
  void mendLights(const Packet& packet, std::uint32_t sample, const Hits& seen);
  void follow(Packet& packet, CellUpdate* update, bool is_turn);
  bool meet(Packet& packet, int surface, LaneSums& sums);
  void addDirect(const Packet& packet, LaneSums& sums);
  void lookFurther(const Packet& at);
  Lanes<int> addFromCells(const Packet& packet, Lanes<IrradianceCells::Key>& keys, LaneSums& sums);
  void keepGeometry(const SeenTile& seen);
  template <class Work>
  void forEachChannel(const LaneSums& sums, const Work& work) const;
  void keepSums(const Lanes<int>& valid);

  const Tracing& tracing_;
  const IrradianceCells& cells_;
  const LitPoints& lights_;
  const Channels& channels_;
  CoarseTile tile_;
  LaneSums sums_, further_, fallen_;  ///< fallen: what is expected from lit points
  LitPoints::Shares shares_;
  Vec3Lanes normals_;  ///< of the coarse points
  int samples_ = 1;    ///< of each in this frame
  std::vector<Lanes<float>> found_;
  Hits hits_;
};

}  // namespace toftwin::sim
