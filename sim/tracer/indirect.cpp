// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/indirect.h"

#include <algorithm>
#include <cmath>

#include "sim/images/rows.h"
#include "sim/tracer/indirect_tile.h"
#include "sim/tracer/lit_points.h"

namespace toftwin::sim {
namespace {

/// Most samples in a coarse point's means; what moves in a scene leaves its light behind for so long.
constexpr float kMostSamples = 128.0f, kMostWhereThingsMove = 16.0f;
constexpr float kFewestSamples = 8.0f;
/// Cells remember so many times the samples.
constexpr int kCellsPerPoints = 2, kCellsWhereThingsMove = 4;
/// Light is remembered for so much of the camera's way: its emitters move with it, which turns phasors.
constexpr double kMemory_m = 0.03;
/// A turn counts as a way, by what the light then falls on.
constexpr double kMetresPerRadian = 0.5;
/// Cells of indirect light have this share of the scene's diagonal.
constexpr double kCellShare = 1.0 / 64.0;
/// A coarse point is the same place as before if it lies in one plane with it to this share of the range,
/// this many coarse points away at most, and faces the same way to this cosine.
constexpr double kSamePlane = 0.005, kSamePlace = 2.0, kSameFacing = 0.8;

int coarse(int size) { return (size + CoarseGrid::kStep - 2) / CoarseGrid::kStep + 1; }

/// Sums of a tile at (i, j) become means of the grid.
void store(const CoarseTile& tile, int i, int j, int samples, CoarseGrid& grid) {
  for (std::size_t lane = 0; lane < kLaneCount; ++lane) {
    const int u = i + static_cast<int>(lane % 4), v = j + static_cast<int>(lane / 4);
    if (u >= grid.width || v >= grid.height) continue;
    grid.x(u, v) = tile.x[lane];
    grid.y(u, v) = tile.y[lane];
    grid.z(u, v) = tile.z[lane];
    grid.normal_x(u, v) = tile.normal_x[lane];
    grid.normal_y(u, v) = tile.normal_y[lane];
    grid.normal_z(u, v) = tile.normal_z[lane];
    grid.samples(u, v) = tile.valid[lane] != 0 ? static_cast<float>(samples) : 0.0f;
    grid.variance_left(u, v) = 1.0f / static_cast<float>(samples);
    for (std::size_t c = 0; c < grid.means.size(); ++c)
      grid.means[c](u, v) = static_cast<float>(tile.sums[c][lane] / samples);
    for (std::size_t f = 0; f < grid.squares.size(); ++f)
      grid.squares[f](u, v) = static_cast<float>(tile.squares[f][lane] / samples);
  }
}

Vec3d placeOf(const CoarseGrid& grid, int u, int v) {
  return {static_cast<double>(grid.x(u, v)), static_cast<double>(grid.y(u, v)),
          static_cast<double>(grid.z(u, v))};
}
Vec3d normalOf(const CoarseGrid& grid, int u, int v) {
  return {static_cast<double>(grid.normal_x(u, v)), static_cast<double>(grid.normal_y(u, v)),
          static_cast<double>(grid.normal_z(u, v))};
}

/// Takes every coarse point's samples; what they found for the cells comes back tile by tile.
std::vector<CellUpdate> gatherTiles(const Tracing& tracing, const IrradianceCells& cells, const LitPoints& lights,
                                    const Channels& channels, std::uint32_t first_sample, int samples, CoarseGrid& grid) {
  const int columns = (grid.width + 3) / 4, rows = (grid.height + 3) / 4;
  std::vector<CellUpdate> updates(static_cast<std::size_t>(columns * rows));
  inParallel(columns * rows, 8, [&](int begin, int end) {
    const FlushDenormals flush;
    TileGatherer gatherer{tracing, cells, lights, channels};
    for (int t = begin; t != end; ++t) {
      const int i = t % columns * 4, j = t / columns * 4;
      gatherer.gather(i, j, first_sample, samples, updates[static_cast<std::size_t>(t)]);
      store(gatherer.tile(), i, j, samples, grid);
    }
  });
  return updates;
}

/// In order, whoever made them: the cells do not depend on the threads.
void update(const std::vector<CellUpdate>& updates, int memory, std::size_t channels, IrradianceCells& cells) {
  std::vector<float> sample(channels);
  for (const CellUpdate& update : updates) {
    for (std::size_t lane = 0; lane < kLaneCount; ++lane) {
      if (update.keys[lane] == 0) continue;
      for (std::size_t c = 0; c < channels; ++c) sample[c] = update.values[c][lane];
      cells.add(update.keys[lane], sample, memory);
    }
  }
}

/// Where things were a frame ago.
class Past {
 public:
  Past(const CoarseGrid& grid, const CameraInfo& camera, const Transform<World, Camera>& world_from_before,
       const Transform<World, Camera>& world_from_camera)
      : grid_(grid), camera_(camera), is_at_rest_(world_from_before == world_from_camera),
        before_from_camera_(world_from_before.inverse() * world_from_camera) {}

  /// The point of the old grid on the same place of a surface as (u, v) of the new one.
  bool find(const CoarseGrid& now, int u, int v, int& old_u, int& old_v) const {
    Vec3d place = placeOf(now, u, v), normal = normalOf(now, u, v);
    old_u = u;
    old_v = v;
    if (!is_at_rest_) {
      place = (before_from_camera_ * Point<Camera>{place}).m;
      normal = before_from_camera_.rotate(normal);
      if (!(place.z > 0.0)) return false;
      const auto [x, y] = pixelOfPoint(camera_, {place});
      if (!(std::abs(x) < 1e6) || !(std::abs(y) < 1e6)) return false;
      old_u = static_cast<int>(std::lround(x / CoarseGrid::kStep));
      old_v = static_cast<int>(std::lround(y / CoarseGrid::kStep));
    }
    if (old_u < 0 || old_v < 0 || old_u >= grid_.width || old_v >= grid_.height) return false;
    if (grid_.samples(old_u, old_v) == 0.0f) return false;
    const double range = norm(place);
    const Vec3d apart = placeOf(grid_, old_u, old_v) - place;
    return std::abs(dot(apart, normal)) <= kSamePlane * range &&
           norm(apart) <= kSamePlace * CoarseGrid::kStep * range / camera_.fx &&
           dot(normalOf(grid_, old_u, old_v), normal) >= kSameFacing;
  }

 private:
  const CoarseGrid& grid_;
  const CameraInfo& camera_;
  bool is_at_rest_;
  Transform<Camera, Camera> before_from_camera_;
};

}  // namespace

void CoarseGrid::resize(int new_width, int new_height, std::size_t channels, std::size_t frequencies) {
  width = new_width;
  height = new_height;
  const auto fit = [&](Image<float>& image) {
    if (image.width() != width || image.height() != height) image = Image<float>(width, height);
  };
  for (Image<float>* image : {&x, &y, &z, &normal_x, &normal_y, &normal_z, &samples, &variance_left}) fit(*image);
  means.resize(channels);
  squares.resize(frequencies);
  std::for_each(means.begin(), means.end(), fit);
  std::for_each(squares.begin(), squares.end(), fit);
}

Channels::Channels(const TraceRequest& request, std::span<const std::uint8_t> wanted) {
  const auto harmonics = static_cast<std::size_t>(request.harmonics);
  for (std::size_t term = 0; term < request.frequencies.size() * harmonics; ++term) {
    const bool is_first = term % harmonics == 0;
    if (is_first) firsts_.push_back(terms_.size());
    if (!is_first && !wanted.empty() && wanted[term] == 0) continue;
    terms_.push_back(term);
    const int order = static_cast<int>(term % harmonics) + 1;
    if (const auto at = std::ranges::lower_bound(orders_, order); at == orders_.end() || *at != order)
      orders_.insert(at, order);
  }
  for (const std::size_t term : terms_) {
    const auto at = std::ranges::lower_bound(orders_, static_cast<int>(term % harmonics) + 1) - orders_.begin();
    lanes_.push_back(term / harmonics * orders_.size() + static_cast<std::size_t>(at));
  }
}

IndirectLight::Memory IndirectLight::memoryFor(const Tracing& tracing, int samples) const {
  const Transform<World, Camera>& now = tracing.request.world_from_camera;
  double way = 0.0;
  for (const EmitterSpec& emitter : tracing.request.emitters) {
    const Vec3d from = (pose_ * Point<Camera>{emitter.position_m}).m;
    const Vec3d to = (now * Point<Camera>{emitter.position_m}).m;
    const double cosine = dot(pose_.rotate(emitter.axis), now.rotate(emitter.axis)) / dot(emitter.axis, emitter.axis);
    way = std::max(way, norm(to - from) + kMetresPerRadian * std::acos(std::clamp(cosine, -1.0, 1.0)));
  }
  const double allowed = kMemory_m * samples;  // samples · way
  const float most = !tracing.scene.poses.empty() ? kMostWhereThingsMove : kMostSamples;
  const auto points = way * static_cast<double>(most) > allowed
                          ? std::max(kFewestSamples, static_cast<float>(allowed / way))
                          : most;
  const int per_point = !tracing.scene.poses.empty() ? kCellsWhereThingsMove : kCellsPerPoints;
  return {points, per_point * static_cast<int>(points)};
}

IndirectLight::IndirectLight() : lights_(std::make_unique<LitPoints>()) {}
IndirectLight::IndirectLight(IndirectLight&&) noexcept = default;
IndirectLight& IndirectLight::operator=(IndirectLight&&) noexcept = default;
IndirectLight::~IndirectLight() = default;

void IndirectLight::gather(const Tracing& tracing, const Channels& channels, int samples) {
  const TraceRequest& request = tracing.request;
  const int width = coarse(request.camera.width), height = coarse(request.camera.height);
  if (!cells_ || tracing.scene.id != scene_id_ || !(channels == channels_) || width != grid_.width ||
      height != grid_.height) {
    scene_id_ = tracing.scene.id;
    channels_ = channels;
    grid_ = before_ = {};
    cells_ = std::make_unique<IrradianceCells>(tracing.scene.diagonal_m * kCellShare, channels.count());
    samples_done_ = 0;
    pose_ = request.world_from_camera;
  }
  std::swap(before_, grid_);
  grid_.resize(width, height, channels.count(), request.frequencies.size());
  const Memory memory = memoryFor(tracing, samples);
  // Special surfaces send light on in ways of their own.
  if (tracing.scene.is_matt) {
    lights_->take(tracing, channels_, samples_done_ / static_cast<std::uint32_t>(samples));
  } else {
    lights_->clear();
  }
  update(gatherTiles(tracing, *cells_, *lights_, channels_, samples_done_, samples, grid_), memory.cells, channels_.count(),
         *cells_);
  samples_done_ += static_cast<std::uint32_t>(samples);
  takeHistory(before_, request.world_from_camera, request.camera, memory.points);
  pose_ = request.world_from_camera;
}

void IndirectLight::takeHistory(const CoarseGrid& before, const Transform<World, Camera>& world_from_camera,
                                const CameraInfo& camera, float memory) {
  const Past past{before, camera, pose_, world_from_camera};
  std::vector<int> surfaces(static_cast<std::size_t>(grid_.height)), unknown(surfaces.size());
  inParallel(grid_.height, 8, [&](int first, int last) {
    for (int v = first; v < last; ++v) {
      for (int u = 0; u < grid_.width; ++u) {
        float& samples = grid_.samples(u, v);
        if (samples == 0.0f) continue;
        ++surfaces[static_cast<std::size_t>(v)];
        int old_u = 0, old_v = 0;
        if (!past.find(grid_, u, v, old_u, old_v)) {
          ++unknown[static_cast<std::size_t>(v)];
          continue;
        }
        const float known = std::min(before.samples(old_u, old_v), memory), share = samples / (samples + known);
        const auto blend = [&](Image<float>& image, const Image<float>& old) {
          image(u, v) = old(old_u, old_v) + share * (image(u, v) - old(old_u, old_v));
        };
        for (std::size_t c = 0; c < grid_.means.size(); ++c) blend(grid_.means[c], before.means[c]);
        for (std::size_t f = 0; f < grid_.squares.size(); ++f) blend(grid_.squares[f], before.squares[f]);
        float& left = grid_.variance_left(u, v);
        left = share * share * left + (1.0f - share) * (1.0f - share) * before.variance_left(old_u, old_v);
        samples += known;
      }
    }
  });
  int all = 0, alone = 0;
  for (std::size_t v = 0; v < surfaces.size(); ++v) {
    all += surfaces[v];
    alone += unknown[v];
  }
  share_of_new_ = all > 0 ? static_cast<double>(alone) / all : 0.0;
}

}  // namespace toftwin::sim
