// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/indirect.h"

#include <algorithm>
#include <cmath>

#include "sim/images/rows.h"
#include "sim/tracer/indirect_tile.h"
#include "sim/tracer/kept_direct.h"
#include "sim/tracer/lit_points.h"

namespace toftwin::sim {
namespace {

/// Most samples in a coarse point's means; what moves in a scene leaves its light behind for so long.
constexpr float kMostSamples = 128.0f, kMostWhereThingsMove = 48.0f;
constexpr float kFewestSamples = 6.0f;
/// The same of what lit places send to what stands still: it is known well from one frame alone, and moves with the
/// shadows. (Moving objects may be bent, which leaves few neighbours to smooth over.)
constexpr float kMostOfLitWhereThingsMove = 4.0f;
/// Of all light on what moves, which moves through it, and whose points are means of several before.
constexpr float kMostOfWhatMoves = 16.0f;
/// Cells remember so many times the samples; for twice as many frames once they are added to in every second one alone.
constexpr int kCellsPerPoints = 2, kCellsWhereThingsMove = 4;
/// Light is remembered for so much of the camera's way: its emitters move with it, which turns phasors.
constexpr double kMemory_m = 0.03;
/// A turn counts as a way, by what the light then falls on.
constexpr double kMetresPerRadian = 0.5;
/// Cells of indirect light have this share of the scene's diagonal.
constexpr double kCellShare = 1.0 / 64.0;

int coarse(int size) { return (size + CoarseGrid::kStep - 2) / CoarseGrid::kStep + 1; }

/// Sums of a tile at (i, j) become means of the grid.
void store(const CoarseTile& tile, const Channels& channels, int i, int j, int samples, CoarseGrid& grid) {
  const int width = std::min(4, grid.width - i), height = std::min(4, grid.height - j);
  const auto put = [&](auto& image, const auto& value) {
    for (int row = 0; row < height; ++row) {
      auto* to = &image(i, j + row);
      for (int column = 0; column < width; ++column) to[column] = value(static_cast<std::size_t>(4 * row + column));
    }
  };
  const auto copy = [&](Image<float>& image, const Lanes<float>& lanes) {
    put(image, [&](std::size_t lane) { return lanes[lane]; });
  };
  copy(grid.x, tile.x);
  copy(grid.y, tile.y);
  copy(grid.z, tile.z);
  copy(grid.normal_x, tile.normal_x);
  copy(grid.normal_y, tile.normal_y);
  copy(grid.normal_z, tile.normal_z);
  put(grid.samples, [&](std::size_t lane) { return tile.valid[lane] != 0 ? static_cast<float>(samples) : 0.0f; });
  put(grid.variance_left, [&](std::size_t) { return 1.0f / static_cast<float>(samples); });
  put(grid.lit_left, [&](std::size_t) { return 1.0f; });
  put(grid.mover, [&](std::size_t lane) { return tile.mover[lane]; });
  const double per_sample = 1.0 / samples;
  for (std::size_t c = 0; c < grid.means.size(); ++c) {
    copy(grid.lit[c], tile.lit[c]);
    put(grid.means[c], [&](std::size_t lane) {
      return tile.lit[c][lane] + static_cast<float>(tile.sums[c][lane] * per_sample);
    });
  }
  for (std::size_t f = 0; f < grid.squares.size(); ++f) {
    const std::size_t phasor = channels.first(f);
    const Lanes<float>&re = tile.lit[Channels::re(phasor)], &im = tile.lit[Channels::im(phasor)];
    put(grid.squares[f], [&](std::size_t lane) { return static_cast<float>(tile.squares[f][lane] * per_sample); });
    put(grid.lit_squares[f], [&](std::size_t lane) { return re[lane] * re[lane] + im[lane] * im[lane]; });
  }
}

/// Takes every coarse point's samples; what they found for the cells comes back tile by tile.
void gatherTiles(const Tracing& tracing, const IrradianceCells& cells, const LitPoints& lights, const Channels& channels,
                 const KeptDirect& kept, std::uint32_t first_sample, int samples, CoarseGrid& grid,
                 std::vector<SeenTile>& seen, std::vector<CellUpdate>& updates) {
  const int columns = (grid.width + 3) / 4, rows = (grid.height + 3) / 4;
  updates.resize(static_cast<std::size_t>(columns * rows));
  seen.resize(updates.size());
  const auto gather = [&](TileGatherer& gatherer, int begin, int end) {
    for (int t = begin; t != end; ++t) {
      const int i = t % columns * 4, j = t / columns * 4;
      const auto number = static_cast<std::size_t>(t);
      SeenTile& tile = seen[number];
      // The last points lie in the last blocks.
      const int left = std::min(i, kept.columns() - 1), top = std::min(j, kept.rows() - 1);
      if (tile.frame == 0 || tile.frame < kept.newest(left, top, i + 3, j + 3)) {
        if (!kept.find(i, j, tile)) gatherer.look(i, j, tile);
        tile.frame = kept.frame();
      }
      gatherer.gather(i, j, tile, first_sample, samples, updates[number]);
      store(gatherer.tile(), channels, i, j, samples, grid);
    }
  };
  Rooms<TileGatherer> gatherers;
  inParallel(columns * rows, 8, [&](int begin, int end) {
    const FlushDenormals flush;
    gatherers.use([&] { return TileGatherer{tracing, cells, lights, channels}; },
                  [&](TileGatherer& gatherer) { gather(gatherer, begin, end); });
  });
}

/// In order, whoever made them: the cells do not depend on the threads.
void update(const std::vector<CellUpdate>& updates, int memory, std::size_t channels, IrradianceCells& cells) {
  std::vector<float> sample(channels);
  const auto prepare = [&](std::size_t number) {
    if (number >= updates.size()) return;
    for (const auto key : updates[number].keys.v) cells.prepare(key);
  };
  for (std::size_t number = 0; number < updates.size(); ++number) {
    const CellUpdate& update = updates[number];
    prepare(number + 1);
    for (std::size_t lane = 0; lane < kLaneCount; ++lane) {
      if (update.keys[lane] == 0) continue;
      for (std::size_t c = 0; c < channels; ++c) sample[c] = update.values[c][lane];
      cells.add(update.keys[lane], sample, memory);
    }
  }
}

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

void CoarseGrid::resizeWithLit(int new_width, int new_height, std::size_t channels, std::size_t frequencies) {
  resize(new_width, new_height, channels, frequencies);
  if (lit.size() == channels && lit_left.width() == width && lit_left.height() == height) return;
  lit_left = Image<float>(width, height);
  lit.assign(channels, lit_left);
  lit_squares.assign(frequencies, lit_left);
  mover = Image<int>(width, height);
}

Channels::Channels(const TraceRequest& request, std::span<const SeenHarmonic> seen, Harmonic least) {
  const auto harmonics = static_cast<std::size_t>(request.harmonics);
  for (std::size_t term = 0; term < request.frequencies.size() * harmonics; ++term) {
    const bool is_first = term % harmonics == 0;
    if (is_first) firsts_.push_back(terms_.size());
    if (is_first) last_orders_.push_back(1);
    if (!is_first && !seen.empty() && seen[term].how < least) continue;
    if (!is_first && !seen.empty() && seen[term].is_folded) {
      folds_.push_back({terms_.size(), firsts_.back(), seen[term].beside_first, seen[term].is_mirrored});
    } else {
      shown_.push_back({term, terms_.size()});
    }
    terms_.push_back(term);
    const int order = last_orders_.back() = static_cast<int>(term % harmonics) + 1;
    orders_of_terms_.push_back(order);
    if (const auto at = std::ranges::lower_bound(orders_, order); at == orders_.end() || *at != order)
      orders_.insert(at, order);
  }
  for (std::size_t k = 0; k < terms_.size(); ++k) {
    const auto at = std::ranges::lower_bound(orders_, orders_of_terms_[k]) - orders_.begin();
    lanes_.push_back(terms_[k] / harmonics * orders_.size() + static_cast<std::size_t>(at));
  }
}

Places::Places(const Tracing& tracing) : scene_from_camera(tracing.scene_from_camera) {
  for (const Standing& mover : tracing.scene.poses) scene_from_movers.push_back(mover.scene_from_object);
}

IndirectLight::Memory IndirectLight::memoryFor(const Tracing& tracing, int samples) const {
  const Transform<World, Camera>&before = places_.scene_from_camera, &now = tracing.scene_from_camera;
  double way = 0.0;
  for (const EmitterSpec& emitter : tracing.request.emitters) {
    const Vec3d from = (before * Point<Camera>{emitter.position_m}).m;
    const Vec3d to = (now * Point<Camera>{emitter.position_m}).m;
    const double cosine = dot(before.rotate(emitter.axis), now.rotate(emitter.axis)) / dot(emitter.axis, emitter.axis);
    way = std::max(way, norm(to - from) + kMetresPerRadian * std::acos(std::clamp(cosine, -1.0, 1.0)));
  }
  const double allowed = kMemory_m * samples;  // samples · way
  const float most = !tracing.scene.poses.empty() ? kMostWhereThingsMove : kMostSamples;
  const auto points = way * static_cast<double>(most) > allowed
                          ? std::max(kFewestSamples, static_cast<float>(allowed / way))
                          : most;
  const bool is_moving = !tracing.scene.poses.empty();
  const int per_point = is_moving ? kCellsWhereThingsMove : kCellsPerPoints;
  return {.points = points,
          .lit = is_moving ? std::min(points, kMostOfLitWhereThingsMove) : points,
          .moving = std::min(points, kMostOfWhatMoves),
          .cells = per_point * static_cast<int>(points)};
}

IndirectLight::IndirectLight() : lights_(std::make_unique<LitPoints>()) {}
IndirectLight::IndirectLight(IndirectLight&&) noexcept = default;
IndirectLight& IndirectLight::operator=(IndirectLight&&) noexcept = default;
IndirectLight::~IndirectLight() = default;

void IndirectLight::gather(const Tracing& tracing, const Channels& channels, const KeptDirect& kept, int samples) {
  const TraceRequest& request = tracing.request;
  const int width = coarse(request.camera.width), height = coarse(request.camera.height);
  if (!cells_ || tracing.scene.id != scene_id_ || !(channels == channels_) ||
      request.frequencies != frequencies_ || width != grid_.width ||
      height != grid_.height) {
    scene_id_ = tracing.scene.id;
    channels_ = channels;
    frequencies_ = request.frequencies;
    grid_ = before_ = {};
    cells_ = std::make_unique<IrradianceCells>(tracing.scene.diagonal_m * kCellShare, channels.count());
    samples_done_ = 0;
    places_ = Places{tracing};
  }
  std::swap(before_, grid_);
  grid_.resizeWithLit(width, height, channels.count(), request.frequencies.size());
  const Memory memory = memoryFor(tracing, samples);
  // Special surfaces send light on in ways of their own.
  if (tracing.scene.is_matt) {
    lights_->take(tracing, channels_, samples_done_ / static_cast<std::uint32_t>(samples));
  } else {
    lights_->clear();
  }
  gatherTiles(tracing, *cells_, *lights_, channels_, kept, samples_done_, samples, grid_, seen_, updates_);
  update(updates_, memory.cells, channels_.count(), *cells_);
  samples_done_ += static_cast<std::uint32_t>(samples);
  weights_.resize(static_cast<std::size_t>(kept.columns()) * static_cast<std::size_t>(kept.rows()));
  Places now{tracing};
  takeHistory(before_, tracing, now, memory);
  places_ = std::move(now);
}

}  // namespace toftwin::sim
