// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/realtime.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "sim/images/rows.h"
#include "sim/tracer/hit.h"
#include "sim/tracer/indirect.h"
#include "sim/tracer/path.h"
#include "sim/tracer/shade.h"

namespace toftwin::sim {
namespace {

constexpr int kSize = 4;  // of a block of pixels, both ways
static_assert(kSize == CoarseGrid::kStep && kSize * kSize == embree::kLanes);

/// Samples of indirect light for each coarse point: of a frame, and of the first one.
constexpr int kSamples = 2, kFirstPasses = 8;
/// A cut to another view needs them as well.
constexpr double kMuchIsNew = 0.5;
/// Depth jumps where the inverse range bends by more than this share of itself.
constexpr float kJump = 0.02f;
/// So many samples in the whole image look into the pixels where depth jumps, at most 16 in each.
constexpr int kFootprintSamples = 24'000;

TraceRequest directOnly(const TraceRequest& request, int samples) {
  TraceRequest direct = request;
  direct.max_surfaces = 1;
  direct.samples_per_pixel = samples;
  return direct;
}

/// The geometry of a block's pixels in the camera's frame.
TOFTWIN_VECTOR
void keepGeometry(const Block& block, const TruthLanes& truth, BlockGeometry& pixels) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const bool is_hit = truth.range_m[i] > 0.0f;  // not NaN
    const double x = block.rays.x[i], y = block.rays.y[i], per_length = perRoot(x * x + y * y + 1.0);
    const float range = is_hit ? truth.range_m[i] : 0.0f, along = range * static_cast<float>(per_length);
    pixels.x[i] = along * static_cast<float>(x);
    pixels.y[i] = along * static_cast<float>(y);
    pixels.z[i] = along;
    pixels.range_m[i] = static_cast<double>(range);
    pixels.albedo[i] = is_hit ? truth.albedo[i] : 0.0f;
  }
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    pixels.normal_x[i] = truth.normal[i].x;
    pixels.normal_y[i] = truth.normal[i].y;
    pixels.normal_z[i] = truth.normal[i].z;
  }
}

/// The part of an image that a block covers.
struct Part {
  int x, y, width, height;

  Part(const Block& block, const CameraInfo& camera)
      : x(block.x),
        y(block.y),
        width(std::min(kSize, camera.width - x)),
        height(std::min(kSize, camera.height - y)) {}

  /// Each pixel becomes value(lane, what it was).
  template <class T, class Value>
  void store(Image<T>& image, const Value& value) const {
    for (int row = 0; row < height; ++row) {
      T* to = &image(x, y + row);
      const auto lane = [&](int column) { return static_cast<std::size_t>(row * kSize + column); };
      if (width == kSize) {  // mostly, and then without a loop
        for (int column = 0; column < kSize; ++column) to[column] = value(lane(column), to[column]);
      } else {
        for (int column = 0; column < width; ++column) to[column] = value(lane(column), to[column]);
      }
    }
  }
};

/// Pixels of one row at which depth jumps.
TOFTWIN_VECTOR
void markJumps(const float* above, const float* here, const float* below, int width, unsigned char* jumps) {
  const auto inverse = [](float range) { return range > 0.0f ? 1.0f / range : 0.0f; };  // 0 for NaN
  for (int x = 1; x < width - 1; ++x) {
    const float middle = inverse(here[x]), l = inverse(here[x - 1]), r = inverse(here[x + 1]);
    const float a = inverse(above[x]), b = inverse(below[x]);
    const float across = std::abs(l + r - 2.0f * middle), down = std::abs(a + b - 2.0f * middle);
    const float most = middle > l ? (middle > r ? middle : r) : (l > r ? l : r);
    jumps[x] = (across > kJump * most) | (down > kJump * most) ? 1 : 0;
  }
}

std::vector<std::array<int, 2>> pixelsWithJumps(const Image<float>& range) {
  const int width = range.width(), height = range.height();
  std::vector<std::vector<std::array<int, 2>>> rows(static_cast<std::size_t>(height));
  forRows(height, [&](int first, int last) {
    std::vector<unsigned char> jumps(static_cast<std::size_t>(width));
    for (int y = std::max(1, first); y < std::min(last, height - 1); ++y) {
      markJumps(&range(0, y - 1), &range(0, y), &range(0, y + 1), width, jumps.data());
      for (int x = 1; x < width - 1; ++x) {
        if (jumps[static_cast<std::size_t>(x)] != 0) rows[static_cast<std::size_t>(y)].push_back({x, y});
      }
    }
  });
  std::vector<std::array<int, 2>> pixels;
  for (const auto& row : rows) pixels.insert(pixels.end(), row.begin(), row.end());
  return pixels;
}

/// A ball around a moving object and a point that straight ways lead to, in the camera's frame.
struct Shade {
  float x, y, z, radius2;  ///< of the ball
  float to_x, to_y, to_z;
};

/// Balls around all movers, on the way to the pinhole and to each emitter.
std::vector<Shade> shadesOf(const Tracing& tracing) {
  std::vector<Shade> shades;
  const auto camera_from_scene = tracing.scene_from_camera.inverse();
  for (const Standing& standing : tracing.scene.poses) {
    const Vec3f lower = standing.lower, upper = standing.upper, middle = (lower + upper) / 2.0f;
    const Vec3d object{static_cast<double>(middle.x), static_cast<double>(middle.y), static_cast<double>(middle.z)};
    const Vec3d in_scene = (standing.scene_from_object * Point<Object>{object}).m;
    const Vec3d c = (camera_from_scene * Point<World>{in_scene}).m;
    // Wider by far more than what single precision rounds, here and in rays.
    const double radius = 1.001 * standing.radius + 1e-4 * norm(c) + standing.blur;
    const auto add = [&](Vec3d to, double by) {
      shades.push_back({static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z),
                        static_cast<float>((radius + by) * (radius + by)), static_cast<float>(to.x),
                        static_cast<float>(to.y), static_cast<float>(to.z)});
    };
    add({}, 0.0);
    for (const EmitterSpec& emitter : tracing.request.emitters) add(emitter.position_m, emitter.radius.in(metre));
  }
  return shades;
}

/// Whether a mover may lie on the way to any of the pixels, or has nothing behind it that would say so.
TOFTWIN_VECTOR
bool isNear(const BlockGeometry& pixels, const Shade& shade) {
  const Shade s = shade;
  const float mx = s.x - s.to_x, my = s.y - s.to_y, mz = s.z - s.to_z;
  int any = 0;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const float dx = pixels.x[i] - s.to_x, dy = pixels.y[i] - s.to_y, dz = pixels.z[i] - s.to_z;
    const float share = (mx * dx + my * dy + mz * dz) / (dx * dx + dy * dy + dz * dz + 1e-20f);
    const float low = share > 0.0f ? share : 0.0f, t = low < 1.0f ? low : 1.0f;
    const float ax = mx - t * dx, ay = my - t * dy, az = mz - t * dz;
    any |= (ax * ax + ay * ay + az * az <= s.radius2) | !(pixels.range_m[i] > 0.0) ? 1 : 0;
  }
  return any != 0;
}

/// Direct light of blocks that no mover is near to, kept while the camera stands still: tracing it again would
/// give the same bits.
class KeptDirect {
 public:
  struct Ways {
    Lanes<float> weight;
    Lanes<double> length;
  };

  /// Forgets everything that this frame's tracing would do otherwise.
  void prepare(const Tracing& tracing, std::size_t blocks) {
    const TraceRequest& r = tracing.request;
    shades_ = shadesOf(tracing);
    Key key{tracing.scene.id, r.camera, r.world_from_camera, r.emitters, r.seed, r.sampler};
    if (key == key_ && is_kept_.size() == blocks) return;
    key_ = std::move(key);
    is_kept_.assign(blocks, 0);
    ambient_.resize(tracing.scene.is_matt ? blocks : 0);
    ways_.resize(ambient_.size() * r.emitters.size());
  }
  [[nodiscard]] bool isStill(const BlockGeometry& pixels) const {
    return std::ranges::none_of(shades_, [&](const Shade& shade) { return isNear(pixels, shade); });
  }
  [[nodiscard]] bool has(std::size_t block) const { return is_kept_[block] != 0; }
  void mark(std::size_t block, bool is_kept) { is_kept_[block] = is_kept ? 1 : 0; }
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
};

/// Traces direct light and truth of a block's central rays.
class DirectTracer {
 public:
  explicit DirectTracer(const Tracing& tracing)
      : tracing_(tracing), sums(tracing.turns_per_metre.size() * tracing.orders.size()) {}

  void trace(const Block& block, KeptDirect& kept, std::size_t index) {
    clearSums(sums);
    preparePacket(tracing_, block, packet_);
    startInTheMiddle(tracing_, block, packet_);
    if (!tracing_.scene.is_matt) {
      followAll(tracing_, packet_, sums);
      traceTruth(tracing_, block, truth);
      return;
    }
    intersect(tracing_, packet_, rays_, true);
    endMissed(tracing_.scene.ambient_radiance, rays_, packet_, sums.ambient);
    findHits(tracing_.scene, packet_, rays_, hits_);
    addEmission(packet_, hits_, sums.ambient);
    kept.ambient(index) = sums.ambient;
    for (std::size_t e = 0; e < tracing_.emitters.size(); ++e) {
      DirectLight light;
      Vec3Lanes places;
      if (findLightOf(tracing_, e, packet_, hits_, 0, true, places, light)) addLight(tracing_, light, sums);
      kept.ways(index)[e] = {light.weight, light.length};
    }
    keepTruth(tracing_, packet_, hits_, truth);
  }

  void recall(KeptDirect& kept, std::size_t index) {
    clearSums(sums);
    sums.ambient = kept.ambient(index);
    for (std::size_t e = 0; e < tracing_.emitters.size(); ++e) {
      const KeptDirect::Ways& ways = kept.ways(index)[e];
      addPhasors(tracing_.turns_per_metre, tracing_.orders, ways.weight, ways.length, sums);
    }
  }

 private:
  const Tracing& tracing_;
  Packet packet_;
  RTCRayHit16 rays_;
  Hits hits_;

 public:
  LaneSums sums;
  TruthLanes truth;
};

}  // namespace

struct RealtimeTracer::Impl {
  Light light;
  Channels channels;
  IndirectLight indirect;
  std::vector<BlockGeometry> geometry;
  KeptDirect kept;

  void resize(const TraceRequest& request);
  template <class Work>
  void forBlocks(const CameraInfo& camera, const Work& work) const;
  void traceDirect(const Tracing& tracing);
  void storeDirect(const Part& at, const LaneSums& sums);
  void storeTruth(const Part& at, const TruthLanes& truth);
  void refineJumps(const Scene& scene, const TraceRequest& request);
  void storeMeans(const LaneSums& sums, int samples, int x, int y);
  void addIndirect(const Tracing& tracing);
  void addSpread(const Part& at, const IndirectLight::Spread& spread);
  void makeFrame(const Scene& scene, const TraceRequest& request);
};

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

void RealtimeTracer::Impl::traceDirect(const Tracing& tracing) {
  const BlockShape shape = BlockShape::forSamples(1);
  kept.prepare(tracing, geometry.size());
  forBlocks(tracing.request.camera, [&](int begin, int end, int columns) {
    Block block;
    DirectTracer direct{tracing};
    for (int i = begin; i != end; ++i) {
      const auto index = static_cast<std::size_t>(i);
      BlockGeometry& pixels = geometry[index];
      block.x = i % columns * kSize;
      block.y = i / columns * kSize;
      const Part at{block, tracing.request.camera};
      if (kept.has(index) && kept.isStill(pixels)) {
        direct.recall(kept, index);
      } else {
        prepareBlock(tracing, shape, block.x, block.y, block);
        direct.trace(block, kept, index);
        keepGeometry(block, direct.truth, pixels);
        storeTruth(at, direct.truth);
        kept.mark(index, tracing.scene.is_matt && kept.isStill(pixels));
      }
      storeDirect(at, direct.sums);
    }
  });
}

void RealtimeTracer::Impl::storeDirect(const Part& at, const LaneSums& sums) {
  at.store(light.steady, [&](std::size_t i, float) { return sums.steady[i]; });
  at.store(light.ambient, [&](std::size_t i, float) { return sums.ambient[i]; });
  for (std::size_t k = 0; k < channels.terms().size(); ++k) {
    const Lanes<float>&re = sums.re[channels.lanes()[k]], &im = sums.im[channels.lanes()[k]];
    at.store(light.phasors[channels.terms()[k]],
             [&](std::size_t i, std::complex<float>) { return std::complex<float>{re[i], im[i]}; });
  }
  for (Image<float>& variance : light.variance) at.store(variance, [](std::size_t, float) { return 0.0f; });
}

void RealtimeTracer::Impl::storeTruth(const Part& at, const TruthLanes& truth) {
  at.store(light.truth.range_m, [&](std::size_t i, float) { return truth.range_m[i]; });
  at.store(light.truth.albedo, [&](std::size_t i, float) { return truth.albedo[i]; });
  at.store(light.truth.normal, [&](std::size_t i, Vec3f) { return truth.normal[i]; });
}

/// Where depth jumps the pixel's centre says too little: direct light over its footprint.
void RealtimeTracer::Impl::refineJumps(const Scene& scene, const TraceRequest& request) {
  if (request.pixel_extent == 0.0) return;
  const auto pixels = pixelsWithJumps(light.truth.range_m);
  if (pixels.empty()) return;
  const int share = std::clamp(kFootprintSamples / static_cast<int>(pixels.size()), 2, 16);
  const TraceRequest what = directOnly(request, static_cast<int>(std::bit_floor(static_cast<unsigned>(share))));
  const Tracing tracing{scene.impl(), what, nullptr, channels.orders()};
  const BlockShape shape;  // the pixel itself, with all lanes
  inParallel(static_cast<int>(pixels.size()), 16, [&](int begin, int end) {
    const FlushDenormals flush;
    Block block;
    Packet packet;
    LaneSums sums{tracing.turns_per_metre.size() * tracing.orders.size()};
    for (int i = begin; i != end; ++i) {
      const auto [x, y] = pixels[static_cast<std::size_t>(i)];
      prepareBlock(tracing, shape, x, y, block);
      clearSums(sums);
      preparePacket(tracing, block, packet);
      startAtPlaces(tracing, block, 0, what.samples_per_pixel, packet);
      followAll(tracing, packet, sums);
      storeMeans(sums, what.samples_per_pixel, x, y);
    }
  });
}

void RealtimeTracer::Impl::storeMeans(const LaneSums& sums, int samples, int x, int y) {
  const auto mean = [&](const Lanes<float>& lanes) {
    double sum = 0.0;
    for (std::size_t i = 0; i < kLaneCount; ++i) sum += static_cast<double>(lanes[i]);
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

void RealtimeTracer::Impl::addIndirect(const Tracing& tracing) {
  const CameraInfo& camera = tracing.request.camera;
  forBlocks(camera, [&](int begin, int end, int columns) {
    Block block;
    IndirectLight::Spread spread{channels, tracing.turns_per_metre.size()};
    for (int i = begin; i != end; ++i) {
      block.x = i % columns * kSize;
      block.y = i / columns * kSize;
      indirect.spread(tracing, block.x, block.y, geometry[static_cast<std::size_t>(i)], spread);
      addSpread({block, camera}, spread);
    }
  });
}

void RealtimeTracer::Impl::addSpread(const Part& at, const IndirectLight::Spread& spread) {
  const LaneSums& sums = spread.sums;
  at.store(light.steady, [&](std::size_t i, float before) { return before + sums.steady[i]; });
  at.store(light.ambient, [&](std::size_t i, float before) { return before + sums.ambient[i]; });
  for (std::size_t k = 0; k < channels.terms().size(); ++k) {
    const Lanes<float>&re = sums.re[channels.lanes()[k]], &im = sums.im[channels.lanes()[k]];
    at.store(light.phasors[channels.terms()[k]], [&](std::size_t i, std::complex<float> before) {
      return std::complex<float>{before.real() + re[i], before.imag() + im[i]};
    });
  }
  for (std::size_t f = 0; f < spread.variance.size(); ++f) {
    at.store(light.variance[f], [&](std::size_t i, float before) { return before + spread.variance[f][i]; });
  }
}

void RealtimeTracer::Impl::makeFrame(const Scene& scene, const TraceRequest& request) {
  resize(request);
  const TraceRequest direct = directOnly(request, 1);
  traceDirect(Tracing{scene.impl(), direct, nullptr, channels.orders()});
  refineJumps(scene, request);
  if (request.max_surfaces == 1) return;
  const Tracing tracing{scene.impl(), request, nullptr, channels.orders()};
  indirect.gather(tracing, channels, kSamples);
  if (indirect.shareOfNew() > kMuchIsNew) {
    for (int pass = 1; pass < kFirstPasses; ++pass) indirect.gather(tracing, channels, kSamples);
  }
  indirect.smooth();
  addIndirect(tracing);
}

RealtimeTracer::RealtimeTracer() : impl_(std::make_unique<Impl>()) {}
RealtimeTracer::RealtimeTracer(RealtimeTracer&&) noexcept = default;
RealtimeTracer& RealtimeTracer::operator=(RealtimeTracer&&) noexcept = default;
RealtimeTracer::~RealtimeTracer() = default;

const Light& RealtimeTracer::next(const Scene& scene, const TraceRequest& request,
                                  std::span<const std::uint8_t> wanted) {
  checkRequest(request);
  const auto require = [](bool is_met, const char* what) {
    if (!is_met) throw std::invalid_argument{fmt::format("trace: {}", what)};
  };
  require(request.region_width == 0, "in real time the region must be the whole image");
  require(request.gates.empty(), "gates need mode unbiased: their light cannot be kept from frame to frame");
  require(wanted.empty() || wanted.size() == request.frequencies.size() * static_cast<std::size_t>(request.harmonics),
          "wanted must name every frequency's harmonics");
  impl_->channels = Channels{request, wanted};
  impl_->makeFrame(scene, request);
  return impl_->light;
}

}  // namespace toftwin::sim
