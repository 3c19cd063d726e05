// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <xmmintrin.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sim/tracer/embree.h"
#include "sim/tracer/emitter.h"
#include "sim/tracer/lanes.h"
#include "sim/tracer/lens.h"
#include "sim/tracer/mirrored_light.h"
#include "sim/tracer/packet.h"
#include "sim/tracer/scene_impl.h"
#include "sim/tracer/trace.h"
#include "sim/tracer/transient.h"

namespace toftwin::sim {

struct DirectLight;

/// Below this throughput a path survives by chance and is weighted up. Unbiased; with it, a path of
/// albedo 0.8 is followed for ten surfaces before the first draw.
inline constexpr float kRouletteThreshold = 0.1f;

/// So many bounces of a pixel's samples are spread evenly over all directions.
inline constexpr int kEvenBounces = 2;

/// Numbers of a path's random dimensions.
struct Dimensions {
  std::uint32_t emitters;
  static constexpr std::uint32_t kFootprint = 0;
  [[nodiscard]] std::uint32_t bounce(int surface) const { return first(surface); }
  [[nodiscard]] std::uint32_t roulette(int surface) const { return first(surface) + 1; }
  [[nodiscard]] std::uint32_t emitter(int surface, std::size_t e) const {
    return first(surface) + 2 + static_cast<std::uint32_t>(e);
  }

 private:
  [[nodiscard]] std::uint32_t first(int surface) const { return 1 + static_cast<std::uint32_t>(surface) * (2 + emitters); }
};

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
  /// `orders`: which harmonics, ascending from 1; empty: all of the request. LaneSums hold those, by frequency; of
  /// each frequency those beyond `last_orders` stay dark, unless that is empty.
  Tracing(const Scene::Impl& scene, const TraceRequest& request, RayLog* log, std::vector<int> orders = {},
          std::vector<int> last_orders = {});

  const Scene::Impl& scene;
  const TraceRequest& request;
  RayLog* log;
  Lens lens;
  Transform<World, Camera> scene_from_camera;  ///< "World" moved to the scene's origin
  Vec3d pinhole;
  std::array<Vec3d, 3> camera_axes;  ///< x, y, z of the camera in the scene
  std::vector<PlacedEmitter> emitters;
  std::vector<MirroredEmitter> mirrored;  ///< the points' images in flat mirrors
  std::vector<double> turns_per_metre;  ///< f / c
  std::vector<int> orders;
  std::vector<int> last_orders;  ///< by frequency
  TransientBins bins;                   ///< none but in transient.cpp
  PixelKey seed;

  /// The number of the highest frequency, which decides over the range; 0 if there is none.
  [[nodiscard]] std::size_t highest() const {
    return static_cast<std::size_t>(std::ranges::max_element(turns_per_metre) - turns_per_metre.begin());
  }
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

/// The block whose top left pixel is (x, y). Lane i works for pixel i / shape.samples of the block, row by
/// row, and there for the samples i % shape.samples, that plus shape.samples, and so on.
struct Block {
  BlockShape shape;
  int x, y;
  Lanes<int> is_inside;  ///< −1 where the lane's pixel is one of the image
  Lanes<int> first_sample;
  Lanes<std::uint32_t> key_a, key_b;
  PixelRays rays;
};

void prepareBlock(const Tracing& tracing, const BlockShape& shape, int x, int y, Block& block);

/// Sums over the samples that each lane worked for.
struct BlockSums {
  explicit BlockSums(const TraceRequest& request);

  Lanes<double> steady, ambient, samples;
  Lanes<double> batches;               ///< of one or several samples, whose spread is the variance
  std::vector<Lanes<double>> re, im;   ///< [frequency][harmonic], or gates
  std::vector<Lanes<double>> squares;  ///< [frequency] Σ |first harmonic of a batch|² / its samples
  LaneSums of_packet;                  ///< the packet being traced
};

void clearSums(BlockSums& sums);
void addSums(const BlockSums& from, BlockSums& to);

/// Adds light that arrived: to the phasors, and to the bins if there are any.
void addLight(const Tracing& tracing, const DirectLight& light, LaneSums& sums);

/// Traces samples [first, last) of every pixel of the block.
void traceBlock(const Tracing& tracing, const Block& block, int first, int last, BlockSums& sums);
/// The only sample of every pixel: lane i is pixel i of the block.
void traceOnce(const Tracing& tracing, const Block& block, LaneSums& lanes);

/// What the central rays of the block's pixels meet, pixel by pixel.
struct TruthLanes {
  Lanes<float> range_m, albedo;
  Lanes<Vec3f> normal;
};
void traceTruth(const Tracing& tracing, const Block& block, TruthLanes& truth);

/// A request that makes no sense is the calling program's mistake: std::invalid_argument.
void checkRequest(const TraceRequest& request);

/// Denormal numbers count as zero while this lives, on this thread: Embree asks for it.
class FlushDenormals {
 public:
  FlushDenormals() : before_(_mm_getcsr()) { _mm_setcsr(before_ | kFlushToZero | kDenormalsAreZero); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;
  ~FlushDenormals() { _mm_setcsr(before_); }

 private:
  static constexpr unsigned kFlushToZero = 0x8000, kDenormalsAreZero = 0x0040;
  unsigned before_;
};

// The steps of a path, for those who put them together otherwise:

/// The parts of a packet that do not depend on the sample: starts in the pinhole, full throughput.
void preparePacket(const Tracing& tracing, const Block& block, Packet& packet);
/// Directions of the central rays; for the first sample of each pixel.
void startInTheMiddle(const Tracing& tracing, const Block& block, Packet& packet);
/// Finds where each living path goes; lanes that meet nothing get no geometry id.
void intersect(const Tracing& tracing, const Packet& packet, RTCRayHit16& rays, bool coherent);
/// Paths that met nothing end, with the surroundings' light.
void endMissed(float ambient_radiance, const RTCRayHit16& rays, Packet& packet, Lanes<float>& ambient);
/// Light of the surfaces themselves.
void addEmission(const Packet& packet, const Hits& hits, Lanes<float>& ambient);
/// Next-event estimation: from every hit to every emitter.
void gatherDirectLight(const Tracing& tracing, const Packet& packet, const Hits& hits, int surface, bool coherent,
                       LaneSums& sums);
/// The light of emitter `e`, whatever is in its way; false if there is none, and then `light` holds nothing of use.
bool lookForLightOf(const Tracing& tracing, std::size_t e, const Packet& packet, const Hits& hits, int surface,
                    Vec3Lanes& places, DirectLight& light);
/// Of what is `valid` in it, that which something hides becomes zero.
void takeOffShadowed(const Tracing& tracing, const Hits& hits, const Vec3Lanes& places, bool coherent, DirectLight& light);
/// Both; false if there is none, and then `light` holds none.
bool findLightOf(const Tracing& tracing, std::size_t e, const Packet& packet, const Hits& hits, int surface,
                 bool coherent, Vec3Lanes& places, DirectLight& light);
/// The same to emitter `e` alone; `places` are those on it.
void gatherLightOf(const Tracing& tracing, std::size_t e, const Packet& packet, const Hits& hits, int surface, bool coherent,
                   Vec3Lanes& places, LaneSums& sums);
/// Where central rays came from, in the camera's frame; NaN where from nowhere.
void keepTruth(const Tracing& tracing, const Packet& packet, const Hits& hits, TruthLanes& truth);
void clearSums(LaneSums& sums);
/// Places of the samples [sample, last) on their pixels.
void startAtPlaces(const Tracing& tracing, const Block& block, int sample, int last, Packet& packet);
/// Follows sixteen paths from their hits on surface number `surface` to their ends.
void followFrom(const Tracing& tracing, int surface, Packet& packet, RTCRayHit16& rays, Hits& hits, LaneSums& sums);
/// The lanes' sums of one packet, or of a batch of so many samples, go to those of all, and their squares to the variance.
void fold(std::size_t harmonics, const Lanes<int>& started, int samples, BlockSums& sums);
/// The same of a batch of so many samples of one pixel, whichever lanes they were in: its sums are in lane 0.
void foldTogether(std::size_t harmonics, int samples, BlockSums& sums);
void record(RayLog* log, const Lanes<int>& valid, const RTCRay16& rays, bool coherent, bool shadow);
/// Follows sixteen paths over all their surfaces, whatever those are.
void followAll(const Tracing& tracing, Packet& packet, LaneSums& sums);

/// trace() with a record of its rays; only for one thread.
Light traceLogged(const Scene& scene, const TraceRequest& request, RayLog* log, Light recycled = {});

}  // namespace toftwin::sim
