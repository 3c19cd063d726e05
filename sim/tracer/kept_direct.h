// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "sim/tracer/indirect.h"
#include "sim/tracer/path.h"

namespace toftwin::sim {

/// A ball around a moving object and a point that straight ways lead to, in the camera's frame.
struct Shade {
  float x, y, z, radius;  ///< of the ball
  float to_x, to_y, to_z;
};

/// One around the places of a block's pixels.
struct Ball {
  float x, y, z, radius;  ///< infinite if one of them has no place
};

/// Direct light of blocks that no mover is near to, kept while the camera stands still: tracing it again would
/// give the same bits.
class KeptDirect {
 public:
  struct Ways {
    Lanes<float> weight;
    Lanes<double> length;
  };
  /// What the central ray of a block's first pixel met: a coarse point (indirect.h).
  struct Point {
    bool is_hit;
    int mover;  ///< CoarseGrid::mover
    Vec3d position, normal;
    Vec3f start;
  };
  /// What the frame's images hold of a block.
  enum class InImages : std::uint8_t {
    Nothing,  ///< of use
    Direct,   ///< its direct light
    Refined,  ///< the same, but for pixels where depth jumps
  };

  /// Forgets everything that this frame's tracing would do otherwise. Begins a frame.
  void prepare(const Tracing& tracing);
  /// Whether this frame goes on with what is kept of a block.
  [[nodiscard]] bool goesOn(std::size_t block, const BlockGeometry& pixels) const;
  /// A block was traced.
  void keep(std::size_t block, const BlockGeometry& pixels);
  [[nodiscard]] int columns() const { return columns_; }  ///< of blocks
  [[nodiscard]] int rows() const { return rows_; }
  /// The number of this frame, from 1 on.
  [[nodiscard]] std::uint32_t frame() const { return frame_; }
  /// The frame in which the newest of the blocks from (left, top) to (right, bottom), as far as they lie in the image, was
  /// traced: from then on nothing of them changed.
  [[nodiscard]] std::uint32_t newest(int left, int top, int right, int bottom) const;
  InImages& inImages(std::size_t block) { return in_images_[block]; }
  void forgetImages() { std::fill(in_images_.begin(), in_images_.end(), InImages::Nothing); }
  /// Of all emitters.
  Ways* ways(std::size_t block) { return ways_.data() + block * key_.emitters.size(); }
  Lanes<float>& ambient(std::size_t block) { return ambient_[block]; }
  Point& point(std::size_t block) { return points_[block]; }
  /// The coarse points from (i, j) on. False if they are not all first pixels of blocks, or nothing is kept.
  bool find(int i, int j, SeenTile& tile) const;

 private:
  struct Key {
    std::string scene;
    CameraInfo camera;
    Transform<World, Camera> pose;
    std::vector<EmitterSpec> emitters;
    std::uint64_t seed;
    Sampler sampler;
    bool operator==(const Key&) const = default;
  };
  [[nodiscard]] bool isStill(std::size_t block, const BlockGeometry& pixels) const;

  Key key_{};
  int columns_ = 0, rows_ = 0;  ///< of blocks
  std::uint32_t frame_ = 0;
  bool keeps_ = false;
  std::vector<Shade> shades_;
  std::vector<Ball> balls_;
  std::vector<std::uint32_t> traced_in_;  ///< by block: the frame
  std::vector<Ways> ways_;
  std::vector<Lanes<float>> ambient_;
  std::vector<Point> points_;
  std::vector<unsigned char> is_kept_;
  std::vector<InImages> in_images_;
};

/// Traces direct light and truth of a block's central rays.
class DirectTracer {
 public:
  explicit DirectTracer(const Tracing& tracing)
      : tracing_(tracing), sums(tracing.turns_per_metre.size() * tracing.orders.size()) {}

  /// Traces a block. In a scene without special surfaces it keeps what recall() needs, in others `sums` have the light.
  void trace(const Block& block, KeptDirect& kept, std::size_t index);
  /// The sums of a block that was traced, in this frame or before.
  void recall(KeptDirect& kept, std::size_t index);

 private:
  const Tracing& tracing_;
  Packet packet_;
  RTCRayHit16 rays_;
  Hits hits_;

 public:
  LaneSums sums;
  TruthLanes truth;
};

/// The geometry of a block's pixels in the camera's frame.
void keepGeometry(const Block& block, const TruthLanes& truth, BlockGeometry& pixels);

}  // namespace toftwin::sim
