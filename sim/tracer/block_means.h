// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <complex>
#include <vector>

#include "sim/tracer/path.h"

namespace toftwin::sim {

/// What is traced of the image.
struct Region {
  int x, y, width, height;
};
Region regionOf(const TraceRequest& request);

/// Means of a block's pixels as the images hold them, pixel by pixel.
struct BlockMeans {
  explicit BlockMeans(const Light& light) : phasors(light.phasors.size()), variance(light.variance.size()) {}

  Lanes<float> steady, ambient;
  std::vector<Lanes<std::complex<float>>> phasors;
  std::vector<Lanes<float>> variance;
};

/// Adds up the lanes of each pixel and moves the sum to the lane of the pixel's number.
void addUpPixels(const BlockShape& shape, BlockSums& sums);
void takeMeans(const BlockSums& sums, int harmonics, BlockMeans& means);
/// The same of the only samples.
void takeMeans(const LaneSums& lanes, BlockMeans& means);
/// Writes the pixels that lie in the region.
void storeBlock(const Block& block, const Region& region, const BlockMeans& means, const TruthLanes& truth,
                Light& light);

/// The variance of pixels' ranges, added up, for deciding how many samples they take.
struct NoiseCount {
  double variance_m2 = 0.0;
  int pixels = 0;
};
/// Adds the block's pixels that light reaches. The range is that of the highest frequency; no variance is
/// larger than that of a range that may be anything.
void countNoise(const Tracing& tracing, const BlockShape& shape, const BlockSums& sums,
                const BlockMeans& means, NoiseCount& noise);
/// How many samples it takes for the root mean square of the pixels' noise to be the wanted one, when `pilot`
/// of them left `noise`: a multiple of 16 from 16 up to `most`.
int samplesFor(Length wanted_noise, const NoiseCount& noise, int pilot, int most);
/// The same block with random numbers of its own.
Block pilotOf(const Block& block);

}  // namespace toftwin::sim
