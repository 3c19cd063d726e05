// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/realtime.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <span>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "sim/images/rows.h"
#include "sim/tracer/depth_jumps.h"
#include "sim/tracer/indirect.h"
#include "sim/tracer/kept_direct.h"
#include "sim/tracer/light_images.h"
#include "sim/tracer/part.h"
#include "sim/tracer/path.h"

namespace toftwin::sim {
namespace {

constexpr int kSize = Part::kSize;
static_assert(kSize == CoarseGrid::kStep && kSize * kSize == embree::kLanes);

/// Samples of indirect light for each coarse point: of a frame, and of the first one.
constexpr int kSamples = 1, kFirstPasses = 12;
/// A cut to another view needs them as well.
constexpr double kMuchIsNew = 0.5;
/// So many samples in the whole image look into the pixels where depth jumps, at most 16 in each.
constexpr int kFootprintSamples = 6'000;
constexpr int kStrip = 16;  ///< columns of pixels whose depth jumps that are looked into together

TraceRequest directOnly(const TraceRequest& request, int samples) {
  TraceRequest direct = request;
  direct.max_surfaces = 1;
  direct.samples_per_pixel = samples;
  return direct;
}

Lanes<Vec3f> normalsOf(const BlockGeometry& pixels) {
  Lanes<Vec3f> normals;
  for (std::size_t i = 0; i < kLaneCount; ++i)
    normals[i] = {pixels.normal_x[i], pixels.normal_y[i], pixels.normal_z[i]};
  return normals;
}

/// A packet of so many samples of each of those pixels.
void preparePixels(const Tracing& tracing, std::span<const Pixel> pixels, std::size_t samples, Block& block) {
  Lanes<int> columns, rows;
  block.shape.samples = static_cast<int>(samples);
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const std::size_t p = i / samples;
    const auto [x, y] = pixels[std::min(p, pixels.size() - 1)];
    columns[i] = x;
    rows[i] = y;
    block.is_inside[i] = p < pixels.size() ? -1 : 0;
    block.first_sample[i] = static_cast<int>(i % samples);
    const PixelKey key = pixelKey(tracing.seed, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
    block.key_a[i] = key.a;
    block.key_b[i] = key.b;
  }
  tracing.lens.raysOf(columns, rows, block.rays);
}

}  // namespace

struct RealtimeTracer::Impl {
  /// A frame that was begun, and what its light is to hold.
  struct Begun {
    Scene scene;
    TraceRequest request;
    Channels channels, indirect_channels;
    bool is_gathered;  ///< all of it that leaves the images alone is done
  };
  std::optional<Begun> begun;
  LightImages images;
  IndirectLight indirect;
  std::vector<BlockGeometry> geometry;
  KeptDirect kept;
  std::uint32_t frame = 0;  ///< of those with light over several surfaces
  /// By block; of those traced since the images were written. Its normals lie in `geometry`.
  std::vector<BlockTruth> truth_ahead;
  std::vector<unsigned char> is_ahead_of_images;

  template <class Work>
  void forBlocks(const CameraInfo& camera, const Work& work) const;
  void traceDirect(const Tracing& tracing, bool is_all, bool is_ahead);
  void recall(const Part& at, std::size_t block, DirectTracer& direct);
  void storeDirect(const Part& at, std::size_t block, const LaneSums& sums);
  void storeTruths(const CameraInfo& camera);
  void refineJumps(const Scene& scene, const TraceRequest& request, std::uint32_t turn);
  void recallBlocksOf(std::span<const Pixel> pixels, const Tracing& tracing);
  void addIndirect(const Tracing& of_direct, const Tracing& tracing);
  void prepare(const Scene& scene, const TraceRequest& request, std::span<const SeenHarmonic> seen);
  void gather(bool is_ahead);
  void finish();
};

template <class Work>
void RealtimeTracer::Impl::forBlocks(const CameraInfo& camera, const Work& work) const {
  const int columns = (camera.width + kSize - 1) / kSize, rows = (camera.height + kSize - 1) / kSize;
  inParallel(columns * rows, 8, [&](int begin, int end) {
    const FlushDenormals flush;
    work(begin, end, columns);
  });
}

/// `is_ahead`: leaves the images alone.
void RealtimeTracer::Impl::traceDirect(const Tracing& tracing, bool is_all, bool is_ahead) {
  const BlockShape shape = BlockShape::forSamples(1);
  kept.prepare(tracing);
  is_ahead_of_images.resize(geometry.size());
  if (is_ahead) truth_ahead.resize(geometry.size());
  forBlocks(tracing.request.camera, [&](int begin, int end, int columns) {
    Block block;
    DirectTracer direct{tracing};
    for (int i = begin; i != end; ++i) {
      const auto index = static_cast<std::size_t>(i);
      BlockGeometry& pixels = geometry[index];
      block.x = i % columns * kSize;
      block.y = i / columns * kSize;
      const Part at{block, tracing.request.camera};
      if (kept.goesOn(index, pixels)) {
        if (is_all) recall(at, index, direct);
        continue;
      }
      prepareBlock(tracing, shape, block.x, block.y, block);
      direct.trace(block, kept, index);
      keepGeometry(block, direct.truth, pixels);
      is_ahead_of_images[index] = is_ahead ? 1 : 0;
      if (is_ahead) {
        truth_ahead[index] = {direct.truth.range_m, direct.truth.albedo};
      } else {
        images.storeTruth(at, direct.truth);
      }
      kept.keep(index, pixels);
      if (!tracing.scene.is_matt) {
        images.fold(direct.sums);
        storeDirect(at, index, direct.sums);
      } else if (is_all) {
        recall(at, index, direct);
      }
    }
  });
}

void RealtimeTracer::Impl::storeTruths(const CameraInfo& camera) {
  const int columns = (camera.width + kSize - 1) / kSize;
  for (int i = 0; i != static_cast<int>(is_ahead_of_images.size()); ++i) {
    const auto index = static_cast<std::size_t>(i);
    if (std::exchange(is_ahead_of_images[index], 0) == 0) continue;
    images.storeTruth({i % columns * kSize, i / columns * kSize, camera},
                      {truth_ahead[index].range_m, truth_ahead[index].albedo, normalsOf(geometry[index])});
  }
}

/// Puts direct light that is kept into the images, unless it is there.
void RealtimeTracer::Impl::recall(const Part& at, std::size_t block, DirectTracer& direct) {
  if (kept.inImages(block) == KeptDirect::InImages::Direct) return;
  direct.recall(kept, block);
  images.fold(direct.sums);
  storeDirect(at, block, direct.sums);
}

void RealtimeTracer::Impl::storeDirect(const Part& at, std::size_t block, const LaneSums& sums) {
  images.storeDirect(at, sums);
  kept.inImages(block) = KeptDirect::InImages::Direct;
}

/// Where depth jumps the pixel's centre says too little: direct light over its footprint. Each packet holds the
/// samples of as many pixels as it has room for. Each turn takes other places on them, as evenly spread.
void RealtimeTracer::Impl::refineJumps(const Scene& scene, const TraceRequest& request, std::uint32_t turn) {
  if (request.pixel_extent == 0.0) return;
  auto pixels = pixelsWithJumps(images.light().truth.range_m);
  if (pixels.empty()) return;
  // In strips, so that those of a packet are neighbours: edges of things mostly lie one beside the other in a row.
  std::ranges::sort(pixels, {}, [](const Pixel& p) { return std::tuple{p[0] / kStrip, p[1], p[0]}; });
  const auto count = static_cast<int>(pixels.size());
  const auto share = static_cast<unsigned>(std::clamp(kFootprintSamples / count, 2, static_cast<int>(kLaneCount)));
  constexpr std::uint32_t kTurns = 1U << 24;
  const auto samples = std::bit_floor(share), per_packet = static_cast<unsigned>(kLaneCount) / samples;
  const TraceRequest what = directOnly(request, static_cast<int>(samples));
  const Tracing tracing{scene.impl(), what, nullptr, images.channels().orders(), images.channels().lastOrders()};
  const int first_sample = static_cast<int>(turn % kTurns * samples);
  const int last_sample = first_sample + what.samples_per_pixel;
  recallBlocksOf(pixels, tracing);
  inParallel((count + static_cast<int>(per_packet) - 1) / static_cast<int>(per_packet), 16, [&](int begin, int end) {
    const FlushDenormals flush;
    Block block;
    Packet packet;
    LaneSums sums{tracing.turns_per_metre.size() * tracing.orders.size()};
    for (int i = begin; i != end; ++i) {
      const std::size_t first = static_cast<std::size_t>(i) * per_packet;
      const auto together = std::span{pixels}.subspan(first, std::min<std::size_t>(per_packet, pixels.size() - first));
      preparePixels(tracing, together, samples, block);
      clearSums(sums);
      preparePacket(tracing, block, packet);
      startAtPlaces(tracing, block, first_sample, last_sample, packet);
      followAll(tracing, packet, sums);
      images.fold(sums);
      for (std::size_t p = 0; p < together.size(); ++p) images.storeMeans(sums, p * samples, samples, together[p]);
    }
  });
}

/// Before single pixels change, their blocks' direct light must lie in the images.
void RealtimeTracer::Impl::recallBlocksOf(std::span<const Pixel> pixels, const Tracing& tracing) {
  const CameraInfo& camera = tracing.request.camera;
  const int columns = (camera.width + kSize - 1) / kSize;
  std::vector<int> blocks;
  for (const auto& [x, y] : pixels) blocks.push_back(y / kSize * columns + x / kSize);
  std::ranges::sort(blocks);
  blocks.erase(std::ranges::unique(blocks).begin(), blocks.end());
  inParallel(static_cast<int>(blocks.size()), 64, [&](int first, int last) {
    const FlushDenormals flush;
    DirectTracer direct{tracing};
    Block block;
    for (const int i : std::span{blocks}.subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(last - first))) {
      block.x = i % columns * kSize;
      block.y = i / columns * kSize;
      const auto index = static_cast<std::size_t>(i);
      if (kept.inImages(index) == KeptDirect::InImages::Nothing) recall({block, camera}, index, direct);
      kept.inImages(index) = KeptDirect::InImages::Refined;
    }
  });
}

void RealtimeTracer::Impl::addIndirect(const Tracing& of_direct, const Tracing& tracing) {
  const CameraInfo& camera = tracing.request.camera;
  forBlocks(camera, [&](int begin, int end, int columns) {
    Block block;
    DirectTracer direct{of_direct};
    BlockTruth truth;
    const Truth& seen = images.light().truth;
    IndirectLight::Spread spread{images.indirectChannels(), tracing.turns_per_metre.size()};
    for (int i = begin; i != end; ++i) {
      const auto index = static_cast<std::size_t>(i);
      block.x = i % columns * kSize;
      block.y = i / columns * kSize;
      const Part at{block, camera};
      at.load(seen.range_m, truth.range_m);
      at.load(seen.albedo, truth.albedo);
      indirect.spread(tracing, block.x, block.y, geometry[index], truth, kept, spread);
      if (kept.inImages(index) == KeptDirect::InImages::Nothing) {
        direct.recall(kept, index);
        images.fold(direct.sums);
        images.storeWithSpread(at, spread, direct.sums);
      } else {
        images.addSpread(at, spread);
      }
    }
  });
}

void RealtimeTracer::Impl::prepare(const Scene& scene, const TraceRequest& request,
                                   std::span<const SeenHarmonic> seen) {
  checkRequest(request);
  const auto require = [](bool is_met, const char* what) {
    if (!is_met) throw std::invalid_argument{fmt::format("trace: {}", what)};
  };
  require(request.region_width == 0, "in real time the region must be the whole image");
  require(request.gates.empty(), "gates need mode unbiased: their light cannot be kept from frame to frame");
  require(seen.empty() || seen.size() == request.frequencies.size() * static_cast<std::size_t>(request.harmonics),
          "seen must name every frequency's harmonics");
  require(std::ranges::none_of(seen, [](const SeenHarmonic& one) { return one.is_folded && one.how != Harmonic::Faint; }),
          "of seen, only faint harmonics can be folded");
  begun.emplace(scene, request, Channels{request, seen}, Channels{request, seen, Harmonic::Seen}, false);
}

/// What a frame's light is made of.
void RealtimeTracer::Impl::gather(bool is_ahead) {
  const auto& [scene, request, channels, indirect_channels, is_done] = *begun;
  const auto blocks = [](int pixels) { return static_cast<std::size_t>((pixels + kSize - 1) / kSize); };
  geometry.resize(blocks(request.camera.width) * blocks(request.camera.height));
  const bool is_direct = request.max_surfaces == 1;
  const TraceRequest direct = directOnly(request, 1);
  traceDirect({scene.impl(), direct, nullptr, channels.orders(), channels.lastOrders()}, is_direct, is_ahead);
  if (is_direct) return;
  const Tracing tracing{scene.impl(), request, nullptr, indirect_channels.orders(), indirect_channels.lastOrders()};
  indirect.gather(tracing, indirect_channels, kept, kSamples);
  if (indirect.shareOfNew() > kMuchIsNew) {
    for (int pass = 1; pass < kFirstPasses; ++pass) indirect.gather(tracing, indirect_channels, kept, kSamples);
  }
  indirect.smooth();
}

/// Writes the images.
void RealtimeTracer::Impl::finish() {
  const auto& [scene, request, channels, indirect_channels, is_gathered] = *begun;
  const bool is_direct = request.max_surfaces == 1;
  const Light& before = images.light();
  // Indirect light is added to all pixels, so that none may keep what was refined for another frame.
  if (!is_direct || !(channels == images.channels()) || request.frequencies != before.frequencies ||
      request.harmonics != before.harmonics) {
    kept.forgetImages();
  }
  images.use(channels, indirect_channels);
  images.resize(request);
  if (!is_gathered) gather(false);
  storeTruths(request.camera);
  // Direct light alone is to stay the same where nothing moves.
  refineJumps(scene, request, is_direct ? 0 : frame++);
  if (is_direct) return;
  addIndirect({scene.impl(), request, nullptr, channels.orders(), channels.lastOrders()},
              {scene.impl(), request, nullptr, indirect_channels.orders(), indirect_channels.lastOrders()});
  kept.forgetImages();
}

RealtimeTracer::RealtimeTracer() : impl_(std::make_unique<Impl>()) {}
RealtimeTracer::RealtimeTracer(RealtimeTracer&&) noexcept = default;
RealtimeTracer& RealtimeTracer::operator=(RealtimeTracer&&) noexcept = default;
RealtimeTracer::~RealtimeTracer() = default;

void RealtimeTracer::begin(const Scene& scene, const TraceRequest& request, std::span<const SeenHarmonic> seen) {
  impl_->prepare(scene, request, seen);
  if (!worksAhead(scene, request)) return;
  impl_->gather(true);
  impl_->begun->is_gathered = true;
}

bool RealtimeTracer::worksAhead(const Scene& scene, const TraceRequest& request) {
  // Direct light alone is left in the images from frame to frame; that of special surfaces is kept nowhere else.
  return request.max_surfaces != 1 && scene.impl().is_matt;
}

const Light& RealtimeTracer::finish() {
  if (!impl_->begun) throw std::logic_error{"no frame was begun"};
  impl_->finish();
  impl_->begun.reset();
  return impl_->images.light();
}

const Light& RealtimeTracer::next(const Scene& scene, const TraceRequest& request, std::span<const SeenHarmonic> seen) {
  impl_->prepare(scene, request, seen);
  return finish();
}

}  // namespace toftwin::sim
