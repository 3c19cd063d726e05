// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sim/tracer/embree.h"
#include "sim/tracer/emitter.h"
#include "sim/tracer/lanes.h"
#include "sim/tracer/lens.h"
#include "sim/tracer/scene_impl.h"
#include "sim/tracer/trace.h"

namespace toftwin::sim {

/// The rays that the tracer cast, for replaying them through Embree alone. Not for several threads.
struct RayLog {
  struct Packet {
    alignas(64) int valid[embree::kLanes];
    RTCRay16 rays;
    bool is_coherent;
    bool is_shadow;
  };
  std::vector<Packet> packets;
};

/// Everything that is the same for all pixels of a request.
struct Tracing {
  Tracing(const Scene::Impl& scene, const TraceRequest& request, RayLog* log);

  const Scene::Impl& scene;
  const TraceRequest& request;
  RayLog* log;
  Transform<World, Camera> scene_from_camera;  ///< "World" moved to the scene's origin
  Vec3d pinhole;
  std::array<Vec3d, 3> camera_axes;  ///< x, y, z of the camera in the scene
  std::vector<PlacedEmitter> emitters;
  std::vector<double> turns_per_metre;  ///< f / c
};

/// A block of neighbouring pixels whose paths are traced together, sixteen at a time: the more
/// samples a pixel takes, the fewer pixels. Blocks are aligned to the image, not to the traced
/// region, so a pixel's value does not depend on the region.
struct BlockShape {
  int width = 1, height = 1;
  int samples = embree::kLanes;  ///< of each pixel in one packet

  static BlockShape forSamples(int samples_per_pixel);
  [[nodiscard]] int pixels() const { return width * height; }
};

/// Sums over the samples of the pixels of one block; `pixel` counts within the block.
struct BlockSums {
  BlockSums(int pixels, std::size_t frequencies, int harmonics);
  BlockSums& operator+=(const BlockSums& other);
  void clear();

  struct Pixel {
    double steady = 0.0;
    double ambient = 0.0;
    int samples = 0;
  };
  std::vector<Pixel> pixels;
  std::vector<std::complex<double>> phasors;  ///< [pixel][frequency][harmonic]
  std::vector<double> squares;                ///< [pixel][frequency] Σ |first harmonic|²
};

/// The block whose top left pixel is (x, y), with the rays of its pixels.
struct Block {
  Block(const Tracing& tracing, const BlockShape& shape, int x, int y);

  BlockShape shape;
  int x, y;
  std::array<PixelRays, kLaneCount> rays;
};

/// Traces samples [first, last) of every pixel of the block.
void traceBlock(const Tracing& tracing, const Block& block, int first, int last, BlockSums& sums);

/// What the central rays of the block's pixels meet.
struct TruthPixel {
  float range_m, albedo;
  Vec3f normal;
};
std::array<TruthPixel, kLaneCount> traceTruth(const Tracing& tracing, const Block& block);

/// trace() with a record of its rays; only for one thread.
Light traceLogged(const Scene& scene, const TraceRequest& request, RayLog* log);

}  // namespace toftwin::sim
