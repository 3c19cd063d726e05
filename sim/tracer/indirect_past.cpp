// SPDX-License-Identifier: Apache-2.0
// What coarse points remember: light on the same places of surfaces a frame ago.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "sim/images/rows.h"
#include "sim/tracer/indirect.h"

namespace toftwin::sim {
namespace {

/// A coarse point is the same place as before if it lies in one plane with it to this share of the range,
/// this many coarse points away at most, and faces the same way to this cosine.
constexpr double kSamePlane = 0.005, kSamePlace = 2.0, kSameFacing = 0.8;

/// Of a mean of points around a place, those count that have this share of it.
constexpr double kLeastWeight = 0.02;

Vec3d placeOf(const CoarseGrid& grid, int u, int v) {
  return {static_cast<double>(grid.x(u, v)), static_cast<double>(grid.y(u, v)),
          static_cast<double>(grid.z(u, v))};
}
Vec3d normalOf(const CoarseGrid& grid, int u, int v) {
  return {static_cast<double>(grid.normal_x(u, v)), static_cast<double>(grid.normal_y(u, v)),
          static_cast<double>(grid.normal_z(u, v))};
}

/// Points of the grid before, up to four, and what each of them counts.
struct Origin {
  std::array<std::size_t, 4> place{};
  std::array<float, 4> weight{};
  int count = 0;

  void add(std::size_t where, double counts) {
    place[static_cast<std::size_t>(count)] = where;
    weight[static_cast<std::size_t>(count)] = static_cast<float>(counts);
    ++count;
  }
  [[nodiscard]] float of(const Image<float>& image) const {
    float sum = 0.0f, all = 1e-20f;
    for (std::size_t i = 0; i < place.size(); ++i) sum += weight[i] * image[place[i]], all += weight[i];
    return sum / all;
  }
};

/// Finds where things were a frame ago.
class Past {
 public:
  Past(const CoarseGrid& grid, const CameraInfo& camera, const Places& before, const Places& now)
      : grid_(grid), camera_(camera) {
    const auto before_from_scene = before.scene_from_camera.inverse();
    ways_.push_back({now.scene_from_camera == before.scene_from_camera, before_from_scene * now.scene_from_camera});
    for (std::size_t i = 0; i < std::min(before.scene_from_movers.size(), now.scene_from_movers.size()); ++i) {
      const auto before_from_mover = before_from_scene * before.scene_from_movers[i];
      const auto camera_from_mover = now.scene_from_camera.inverse() * now.scene_from_movers[i];
      ways_.push_back({before_from_mover == camera_from_mover, before_from_mover * camera_from_mover.inverse()});
    }
  }

  /// The points of the old grid around the same place of a surface as (u, v) of the new one, those on that surface.
  bool find(const CoarseGrid& now, int u, int v, Origin& origin) const {
    const int mover = now.mover(u, v);
    if (static_cast<std::size_t>(mover) >= ways_.size()) return false;
    const Way& way = ways_[static_cast<std::size_t>(mover)];
    Vec3d place = placeOf(now, u, v), normal = normalOf(now, u, v);
    origin = {};
    if (way.is_at_rest) return add(u, v, mover, place, normal, 1.0, origin);
    place = (way.before_from_now * Point<Camera>{place}).m;
    normal = way.before_from_now.rotate(normal);
    if (!(place.z > 0.0)) return false;
    const auto [x, y] = pixelOfPoint(camera_, {place});
    if (!(std::abs(x) < 1e6) || !(std::abs(y) < 1e6)) return false;
    const double left = std::floor(x / CoarseGrid::kStep), top = std::floor(y / CoarseGrid::kStep);
    const double right = x / CoarseGrid::kStep - left, below = y / CoarseGrid::kStep - top;
    const int old_u = static_cast<int>(left), old_v = static_cast<int>(top);
    bool is_any = add(old_u, old_v, mover, place, normal, (1.0 - right) * (1.0 - below), origin);
    is_any |= add(old_u + 1, old_v, mover, place, normal, right * (1.0 - below), origin);
    is_any |= add(old_u, old_v + 1, mover, place, normal, (1.0 - right) * below, origin);
    is_any |= add(old_u + 1, old_v + 1, mover, place, normal, right * below, origin);
    return is_any;
  }

 private:
  /// Adds a point if it is one on this surface, near by, that counts at all.
  bool add(int u, int v, int mover, const Vec3d& place, const Vec3d& normal, double weight, Origin& origin) const {
    if (u < 0 || v < 0 || u >= grid_.width || v >= grid_.height || !(weight > kLeastWeight)) return false;
    if (grid_.samples(u, v) == 0.0f || grid_.mover(u, v) != mover) return false;
    const double range = norm(place);
    const Vec3d apart = placeOf(grid_, u, v) - place;
    if (std::abs(dot(apart, normal)) > kSamePlane * range) return false;
    if (norm(apart) > kSamePlace * CoarseGrid::kStep * range / camera_.fx) return false;
    if (dot(normalOf(grid_, u, v), normal) < kSameFacing) return false;
    origin.add(static_cast<std::size_t>(v) * static_cast<std::size_t>(grid_.width) + static_cast<std::size_t>(u), weight);
    return true;
  }

  struct Way {
    bool is_at_rest;
    Transform<Camera, Camera> before_from_now;
  };
  const CoarseGrid& grid_;
  const CameraInfo& camera_;
  std::vector<Way> ways_;  ///< of what stands still, then of each mover
};

/// What a row's points go on from: places in the grid before, and the share that what is new has beside it.
struct Remembered {
  explicit Remembered(std::size_t width)
      : origin(width), share(width), lit_share(width), only(width), room(2 * width) {}
  void forget(std::size_t at) {
    origin[at] = {.count = 1};
    share[at] = lit_share[at] = 1.0f;
  }
  /// Before recall(): tells the points that have one place before, mostly all, from those that have several.
  void sortOut() {
    means.clear();
    for (std::size_t u = 0; u < origin.size(); ++u) {
      only[u] = static_cast<std::uint32_t>(origin[u].place[0]);
      if (origin[u].count > 1) means.push_back(u);
    }
  }
  /// What the row's points were in the image before, in room `number` of two.
  const float* recall(const Image<float>& old, std::size_t number) {
    float* was = room.data() + number * only.size();
    takeAll(&old[0], only.data(), only.size(), was);
    for (const std::size_t u : means) was[u] = origin[u].of(old);
    return was;
  }
  std::vector<Origin> origin;
  std::vector<float> share, lit_share;

 private:
  TOFTWIN_VECTOR
  static void takeAll(const float* from, const std::uint32_t* place, std::size_t count, float* __restrict to) {
    for (std::size_t u = 0; u < count; ++u) to[u] = from[place[u]];
  }
  std::vector<std::uint32_t> only;  ///< by point: the first of its places
  std::vector<std::size_t> means;   ///< points that have more
  std::vector<float> room;
};

void blendRow(const CoarseGrid& before, Remembered& row, int v, CoarseGrid& grid) {
  if (before.width == 0) return;
  const auto width = static_cast<std::size_t>(grid.width);
  row.sortOut();
  const auto blend = [&](Image<float>& image, const Image<float>& old, const std::vector<float>& shares) {
    float* now = &image(0, v);
    const float* was = row.recall(old, 0);
    for (std::size_t u = 0; u < width; ++u) now[u] = was[u] + shares[u] * (now[u] - was[u]);
  };
  // Of a mean of several points no less variance is told than of one: they have much of their past in common.
  const auto leave = [&](Image<float>& image, const Image<float>& old, const std::vector<float>& shares) {
    float* now = &image(0, v);
    const float* was = row.recall(old, 0);
    for (std::size_t u = 0; u < width; ++u) {
      const float share = shares[u], rest = 1.0f - share;
      now[u] = share * share * now[u] + rest * rest * was[u];
    }
  };
  for (std::size_t c = 0; c < grid.means.size(); ++c) {
    float *lit = &grid.lit[c](0, v), *all = &grid.means[c](0, v);
    const float *old_lit = row.recall(before.lit[c], 0), *old_all = row.recall(before.means[c], 1);
    for (std::size_t u = 0; u < width; ++u) {
      const float was_rest = old_all[u] - old_lit[u];
      const float rest = was_rest + row.share[u] * (all[u] - lit[u] - was_rest);
      lit[u] = old_lit[u] + row.lit_share[u] * (lit[u] - old_lit[u]);
      all[u] = lit[u] + rest;
    }
  }
  for (std::size_t f = 0; f < grid.squares.size(); ++f) {
    blend(grid.squares[f], before.squares[f], row.share);
    blend(grid.lit_squares[f], before.lit_squares[f], row.lit_share);
  }
  leave(grid.variance_left, before.variance_left, row.share);
  leave(grid.lit_left, before.lit_left, row.lit_share);
}

}  // namespace

void IndirectLight::takeHistory(const CoarseGrid& before, const Tracing& tracing, const Places& now, const Memory& memory) {
  const Past past{before, tracing.request.camera, places_, now};
  std::vector<int> surfaces(static_cast<std::size_t>(grid_.height)), unknown(surfaces.size());
  inParallel(grid_.height, 8, [&](int first, int last) {
    Remembered row{static_cast<std::size_t>(grid_.width)};
    for (int v = first; v < last; ++v) {
      for (int u = 0; u < grid_.width; ++u) {
        const float samples = grid_.samples(u, v);
        const auto at = static_cast<std::size_t>(u);
        row.forget(at);
        if (samples == 0.0f) continue;
        ++surfaces[static_cast<std::size_t>(v)];
        if (!past.find(grid_, u, v, row.origin[at])) {
          row.forget(at);
          ++unknown[static_cast<std::size_t>(v)];
          continue;
        }
        const bool is_moving = grid_.mover(u, v) != 0;
        const float known = row.origin[at].of(before.samples);
        const float counts = std::min(known, is_moving ? memory.moving : memory.points);
        row.share[at] = samples / (samples + counts);
        const float lit_memory = is_moving ? memory.moving : memory.lit;
        row.lit_share[at] = samples / (samples + std::min(known, lit_memory));
        grid_.samples(u, v) = samples + counts;
      }
      blendRow(before, row, v, grid_);
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
