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
  float x, y, z, radius2;  ///< of the ball
  float to_x, to_y, to_z;
};

/// Direct light of blocks that no mover is near to, kept while the camera stands still: tracing it again would
/// give the same bits.
class KeptDirect {
 public:
  struct Ways {
    Lanes<float> weight;
    Lanes<double> length;
  };
  /// What the frame's images hold of a block.
  enum class InImages : std::uint8_t {
    Nothing,  ///< of use
    Direct,   ///< its direct light
    Refined,  ///< the same, but for pixels where depth jumps
  };

  /// Forgets everything that this frame's tracing would do otherwise.
  void prepare(const Tracing& tracing, std::size_t blocks);
  [[nodiscard]] bool isStill(const BlockGeometry& pixels) const;
  [[nodiscard]] bool has(std::size_t block) const { return is_kept_[block] != 0; }
  void mark(std::size_t block, bool is_kept) { is_kept_[block] = is_kept ? 1 : 0; }
  InImages& inImages(std::size_t block) { return in_images_[block]; }
  void forgetImages() { std::fill(in_images_.begin(), in_images_.end(), InImages::Nothing); }
  /// Of all emitters.
  Ways* ways(std::size_t block) { return ways_.data() + block * key_.emitters.size(); }
  Lanes<float>& ambient(std::size_t block) { return ambient_[block]; }

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
  Key key_{};
  std::vector<Shade> shades_;
  std::vector<Ways> ways_;
  std::vector<Lanes<float>> ambient_;
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
