// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sim/images/light.h"
#include "sim/tracer/depth_jumps.h"
#include "sim/tracer/indirect.h"
#include "sim/tracer/part.h"
#include "sim/tracer/path.h"

namespace toftwin::sim {

/// The images of a frame's light, written block by block; by several threads for several blocks.
class LightImages {
 public:
  /// `indirect` is of the light that spreads come in.
  void use(Channels channels, Channels indirect);
  /// Makes them as large as the request wants them; those that are keep what they hold.
  void resize(const TraceRequest& request);
  [[nodiscard]] const Light& light() const { return light_; }
  [[nodiscard]] const Channels& channels() const { return channels_; }
  [[nodiscard]] const Channels& indirectChannels() const { return indirect_channels_; }

  /// Adds to first harmonics what is folded into them: of direct light, before it is stored.
  void fold(LaneSums& sums) const;
  void storeTruth(const Part& at, const TruthLanes& truth);
  /// Direct light of central rays, which has no variance.
  void storeDirect(const Part& at, const LaneSums& sums);
  /// Of one pixel the mean over so many lanes, and its variance.
  void storeMeans(const LaneSums& sums, std::size_t first_lane, unsigned samples, Pixel pixel);
  /// Adds light over several surfaces to what the images hold.
  void addSpread(const Part& at, const IndirectLight::Spread& spread);
  /// The same with direct light that they do not hold yet, written once. Changes `direct`.
  void storeWithSpread(const Part& at, const IndirectLight::Spread& spread, LaneSums& direct);

 private:
  void storeSums(const Part& at, const LaneSums& sums);

  Light light_;
  Channels channels_, indirect_channels_;
  std::vector<std::size_t> direct_of_indirect_;  ///< by phasor of the latter: which it is of the former
};

}  // namespace toftwin::sim
