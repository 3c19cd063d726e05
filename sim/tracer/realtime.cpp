// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/realtime.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <stdexcept>
#include <utility>

#include "sim/images/rows.h"
#include "sim/tracer/depth_jumps.h"
#include "sim/tracer/indirect.h"
#include "sim/tracer/kept_direct.h"
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
constexpr int kFootprintSamples = 12'000;

TraceRequest directOnly(const TraceRequest& request, int samples) {
  TraceRequest direct = request;
  direct.max_surfaces = 1;
  direct.samples_per_pixel = samples;
  return direct;
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
  Light light;
  Channels channels;           ///< of the images
  Channels indirect_channels;  ///< of light over several surfaces
  std::vector<std::size_t> direct_of_indirect;  ///< by phasor of those: which it is of the images'
  IndirectLight indirect;
  std::vector<BlockGeometry> geometry;
  KeptDirect kept;
  std::uint32_t frame = 0;  ///< of those with light over several surfaces

  void use(Channels of_indirect);
  void resize(const TraceRequest& request);
  template <class Work>
  void forBlocks(const CameraInfo& camera, const Work& work) const;
  void traceDirect(const Tracing& tracing, bool is_all);
  void recall(const Part& at, std::size_t block, DirectTracer& direct);
  void storeDirect(const Part& at, std::size_t block, const LaneSums& sums);
  void storeSums(const Part& at, const LaneSums& sums);
  void storeTruth(const Part& at, const TruthLanes& truth);
  void refineJumps(const Scene& scene, const TraceRequest& request, std::uint32_t turn);
  void recallBlocksOf(std::span<const Pixel> pixels, const Tracing& tracing);
  void storeMeans(const LaneSums& sums, std::size_t first_lane, unsigned samples, Pixel pixel);
  void addIndirect(const Tracing& of_direct, const Tracing& tracing);
  void addSpread(const Part& at, const IndirectLight::Spread& spread);
  void storeWithSpread(const Part& at, const IndirectLight::Spread& spread, LaneSums& direct);
  void makeFrame(const Scene& scene, const TraceRequest& request);
};

void RealtimeTracer::Impl::use(Channels of_indirect) {
  indirect_channels = std::move(of_indirect);
  direct_of_indirect.clear();
  for (const std::size_t term : indirect_channels.terms()) {
    const auto at = std::ranges::lower_bound(channels.terms(), term);
    direct_of_indirect.push_back(static_cast<std::size_t>(at - channels.terms().begin()));
  }
}

void RealtimeTracer::Impl::resize(const TraceRequest& request) {
  const int w = request.camera.width, h = request.camera.height;
  const auto fit = [&](auto& image) {
    if (image.width() != w || image.height() != h) image = std::remove_reference_t<decltype(image)>(w, h);
  };
  light.frequencies = request.frequencies;
  light.harmonics = request.harmonics;
  light.phasors.resize(request.frequencies.size() * static_cast<std::size_t>(request.harmonics));
  light.variance.resize(request.frequencies.size());
  for (std::size_t term = 0; term < light.phasors.size(); ++term) {
    if (std::ranges::find(channels.terms(), term) != channels.terms().end()) {
      fit(light.phasors[term]);
    } else {
      light.phasors[term] = {};
    }
  }
  std::for_each(light.variance.begin(), light.variance.end(), fit);
  fit(light.steady);
  fit(light.ambient);
  fit(light.truth.range_m);
  fit(light.truth.normal);
  fit(light.truth.albedo);
  geometry.resize(static_cast<std::size_t>(((w + kSize - 1) / kSize) * ((h + kSize - 1) / kSize)));
}

template <class Work>
void RealtimeTracer::Impl::forBlocks(const CameraInfo& camera, const Work& work) const {
  const int columns = (camera.width + kSize - 1) / kSize, rows = (camera.height + kSize - 1) / kSize;
  inParallel(columns * rows, 8, [&](int begin, int end) {
    const FlushDenormals flush;
    work(begin, end, columns);
  });
}

void RealtimeTracer::Impl::traceDirect(const Tracing& tracing, bool is_all) {
  const BlockShape shape = BlockShape::forSamples(1);
  kept.prepare(tracing);
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
      storeTruth(at, direct.truth);
      kept.keep(index, pixels);
      if (!tracing.scene.is_matt) {
        storeDirect(at, index, direct.sums);
      } else if (is_all) {
        recall(at, index, direct);
      }
    }
  });
}

/// Puts direct light that is kept into the images, unless it is there.
void RealtimeTracer::Impl::recall(const Part& at, std::size_t block, DirectTracer& direct) {
  if (kept.inImages(block) == KeptDirect::InImages::Direct) return;
  direct.recall(kept, block);
  storeDirect(at, block, direct.sums);
}

void RealtimeTracer::Impl::storeDirect(const Part& at, std::size_t block, const LaneSums& sums) {
  storeSums(at, sums);
  for (Image<float>& variance : light.variance) at.store(variance, [](std::size_t, float) { return 0.0f; });
  kept.inImages(block) = KeptDirect::InImages::Direct;
}

void RealtimeTracer::Impl::storeSums(const Part& at, const LaneSums& sums) {
  at.copy(light.steady, sums.steady);
  at.copy(light.ambient, sums.ambient);
  for (std::size_t k = 0; k < channels.terms().size(); ++k) {
    const std::size_t lanes = channels.lanes()[k];
    at.copy(light.phasors[channels.terms()[k]], sums.re[lanes], sums.im[lanes]);
  }
}

void RealtimeTracer::Impl::storeTruth(const Part& at, const TruthLanes& truth) {
  at.store(light.truth.range_m, [&](std::size_t i, float) { return truth.range_m[i]; });
  at.store(light.truth.albedo, [&](std::size_t i, float) { return truth.albedo[i]; });
  at.store(light.truth.normal, [&](std::size_t i, Vec3f) { return truth.normal[i]; });
}

/// Where depth jumps the pixel's centre says too little: direct light over its footprint. Each packet holds the
/// samples of as many pixels as it has room for. Each turn takes other places on them, as evenly spread.
void RealtimeTracer::Impl::refineJumps(const Scene& scene, const TraceRequest& request, std::uint32_t turn) {
  if (request.pixel_extent == 0.0) return;
  const auto pixels = pixelsWithJumps(light.truth.range_m);
  if (pixels.empty()) return;
  const auto count = static_cast<int>(pixels.size());
  const auto share = static_cast<unsigned>(std::clamp(kFootprintSamples / count, 2, static_cast<int>(kLaneCount)));
  constexpr std::uint32_t kTurns = 1U << 24;
  const auto samples = std::bit_floor(share), per_packet = static_cast<unsigned>(kLaneCount) / samples;
  const TraceRequest what = directOnly(request, static_cast<int>(samples));
  const Tracing tracing{scene.impl(), what, nullptr, channels.orders(), channels.lastOrders()};
  const int first_sample = static_cast<int>(turn % kTurns * samples), last_sample = first_sample + what.samples_per_pixel;
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
      for (std::size_t p = 0; p < together.size(); ++p) storeMeans(sums, p * samples, samples, together[p]);
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

void RealtimeTracer::Impl::storeMeans(const LaneSums& sums, std::size_t first_lane, unsigned samples, Pixel pixel) {
  const auto [x, y] = pixel;
  const auto mean = [&](const Lanes<float>& lanes) {
    double sum = 0.0;
    for (std::size_t i = first_lane; i < first_lane + samples; ++i) sum += static_cast<double>(lanes[i]);
    return sum / samples;
  };
  light.steady(x, y) = static_cast<float>(mean(sums.steady));
  light.ambient(x, y) = static_cast<float>(mean(sums.ambient));
  for (std::size_t k = 0; k < channels.terms().size(); ++k) {
    const std::size_t lanes = channels.lanes()[k];
    light.phasors[channels.terms()[k]](x, y) =
        std::complex<float>{std::complex<double>{mean(sums.re[lanes]), mean(sums.im[lanes])}};
  }
  for (std::size_t f = 0; f < light.variance.size(); ++f) {
    const std::size_t first = channels.lanes()[channels.first(f)];
    const Lanes<float>&re = sums.re[first], &im = sums.im[first];
    Lanes<float> squares;
    for (std::size_t i = 0; i < kLaneCount; ++i) squares[i] = re[i] * re[i] + im[i] * im[i];
    const double spread = std::max(0.0, mean(squares) - std::norm(std::complex<double>{mean(re), mean(im)}));
    light.variance[f](x, y) = static_cast<float>(spread / (2.0 * (samples - 1.0)));
  }
}

void RealtimeTracer::Impl::addIndirect(const Tracing& of_direct, const Tracing& tracing) {
  const CameraInfo& camera = tracing.request.camera;
  forBlocks(camera, [&](int begin, int end, int columns) {
    Block block;
    DirectTracer direct{of_direct};
    BlockTruth truth;
    IndirectLight::Spread spread{indirect_channels, tracing.turns_per_metre.size()};
    for (int i = begin; i != end; ++i) {
      const auto index = static_cast<std::size_t>(i);
      block.x = i % columns * kSize;
      block.y = i / columns * kSize;
      const Part at{block, camera};
      at.load(light.truth.range_m, truth.range_m);
      at.load(light.truth.albedo, truth.albedo);
      indirect.spread(tracing, block.x, block.y, geometry[index], truth, kept, spread);
      if (kept.inImages(index) == KeptDirect::InImages::Nothing) {
        direct.recall(kept, index);
        storeWithSpread(at, spread, direct.sums);
      } else {
        addSpread(at, spread);
      }
    }
  });
}

void RealtimeTracer::Impl::addSpread(const Part& at, const IndirectLight::Spread& spread) {
  const LaneSums& sums = spread.sums;
  at.store(light.steady, [&](std::size_t i, float before) { return before + sums.steady[i]; });
  at.store(light.ambient, [&](std::size_t i, float before) { return before + sums.ambient[i]; });
  for (std::size_t k = 0; k < indirect_channels.terms().size(); ++k) {
    const std::size_t lanes = indirect_channels.lanes()[k];
    const Lanes<float>&re = sums.re[lanes], &im = sums.im[lanes];
    at.store(light.phasors[indirect_channels.terms()[k]], [&](std::size_t i, std::complex<float> before) {
      return std::complex<float>{before.real() + re[i], before.imag() + im[i]};
    });
  }
  for (std::size_t f = 0; f < spread.variance.size(); ++f) {
    at.store(light.variance[f], [&](std::size_t i, float before) { return before + spread.variance[f][i]; });
  }
}

/// The same with direct light that is not in the images yet, written once.
void RealtimeTracer::Impl::storeWithSpread(const Part& at, const IndirectLight::Spread& spread, LaneSums& direct) {
  const auto add = [](const Lanes<float>& from, Lanes<float>& to) {
    for (std::size_t i = 0; i < kLaneCount; ++i) to[i] += from[i];
  };
  add(spread.sums.steady, direct.steady);
  add(spread.sums.ambient, direct.ambient);
  for (std::size_t k = 0; k < direct_of_indirect.size(); ++k) {
    const std::size_t from = indirect_channels.lanes()[k], to = channels.lanes()[direct_of_indirect[k]];
    add(spread.sums.re[from], direct.re[to]);
    add(spread.sums.im[from], direct.im[to]);
  }
  storeSums(at, direct);
  for (std::size_t f = 0; f < spread.variance.size(); ++f) at.copy(light.variance[f], spread.variance[f]);
}

void RealtimeTracer::Impl::makeFrame(const Scene& scene, const TraceRequest& request) {
  resize(request);
  const TraceRequest direct = directOnly(request, 1);
  // Indirect light is added to all pixels, so that none may keep what was refined for another frame.
  if (request.max_surfaces != 1) kept.forgetImages();
  traceDirect(Tracing{scene.impl(), direct, nullptr, channels.orders(), channels.lastOrders()}, request.max_surfaces == 1);
  // Direct light alone is to stay the same where nothing moves.
  refineJumps(scene, request, request.max_surfaces == 1 ? 0 : frame++);
  if (request.max_surfaces == 1) return;
  const Tracing of_direct{scene.impl(), request, nullptr, channels.orders(), channels.lastOrders()};
  const Tracing tracing{scene.impl(), request, nullptr, indirect_channels.orders(), indirect_channels.lastOrders()};
  indirect.gather(tracing, indirect_channels, kept, kSamples);
  if (indirect.shareOfNew() > kMuchIsNew) {
    for (int pass = 1; pass < kFirstPasses; ++pass) indirect.gather(tracing, indirect_channels, kept, kSamples);
  }
  indirect.smooth();
  addIndirect(of_direct, tracing);
  kept.forgetImages();
}

RealtimeTracer::RealtimeTracer() : impl_(std::make_unique<Impl>()) {}
RealtimeTracer::RealtimeTracer(RealtimeTracer&&) noexcept = default;
RealtimeTracer& RealtimeTracer::operator=(RealtimeTracer&&) noexcept = default;
RealtimeTracer::~RealtimeTracer() = default;

const Light& RealtimeTracer::next(const Scene& scene, const TraceRequest& request,
                                  std::span<const Harmonic> seen) {
  checkRequest(request);
  const auto require = [](bool is_met, const char* what) {
    if (!is_met) throw std::invalid_argument{fmt::format("trace: {}", what)};
  };
  require(request.region_width == 0, "in real time the region must be the whole image");
  require(request.gates.empty(), "gates need mode unbiased: their light cannot be kept from frame to frame");
  require(seen.empty() || seen.size() == request.frequencies.size() * static_cast<std::size_t>(request.harmonics),
          "seen must name every frequency's harmonics");
  Channels channels{request, seen};
  const Light& light = impl_->light;
  if (!(channels == impl_->channels) || request.frequencies != light.frequencies || request.harmonics != light.harmonics)
    impl_->kept.forgetImages();
  impl_->channels = std::move(channels);
  impl_->use(Channels{request, seen, Harmonic::Seen});
  impl_->makeFrame(scene, request);
  return impl_->light;
}

}  // namespace toftwin::sim
