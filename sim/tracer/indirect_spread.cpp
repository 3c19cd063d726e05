// SPDX-License-Identifier: Apache-2.0
// From coarse points to smooth light, and from there to pixels: means whose weights fall where the surface
// bends or another begins (a joint bilateral filter).
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "sim/images/rows.h"
#include "sim/tracer/indirect.h"
#include "sim/tracer/kept_direct.h"

namespace toftwin::sim {
namespace {

constexpr int kRadius = 3;       // of the smoothing, in coarse points
constexpr float kSigma = 2.5f;   // of its Gaussian
/// So far off a plane, and so far away at all, as shares of the range, weights are a quarter. The latter
/// where many samples are known; where n are, √(1 + kFewSamples/n) times as far.
constexpr float kPlaneShare = 0.007f, kNearShare = 0.035f, kFewSamples = 16.0f;

/// A place and the way it faces.
struct Facet {
  float x, y, z, normal_x, normal_y, normal_z;
};

/// A quotient that is to be put together with others before it is divided: one division takes as long as the rest.
struct Fraction {
  float over, under;
  friend Fraction operator*(Fraction a, Fraction b) { return {a.over * b.over, a.under * b.under}; }
  [[nodiscard]] float squared() const {
    const float quotient = over / under;
    return quotient * quotient;
  }
};

/// The root of what falls from 1 as q leaves p's plane and turns away: facing / (1 + off² / so far off it).
TOFTWIN_INLINE Fraction alike(const Facet& p, const Facet& q, float range2) {
  const float off =
      p.normal_x * (q.x - p.x) + p.normal_y * (q.y - p.y) + p.normal_z * (q.z - p.z);
  const float far2 = range2 * (kPlaneShare * kPlaneShare);
  const float cosine =
      p.normal_x * q.normal_x + p.normal_y * q.normal_y + p.normal_z * q.normal_z;
  const float facing = cosine > 0.0f ? cosine * cosine : 0.0f;
  return {facing * far2, far2 + off * off};
}

TOFTWIN_INLINE float rangeSquared(const Facet& p) { return p.x * p.x + p.y * p.y + p.z * p.z + 1e-12f; }

/// One row of a coarse grid from some column on.
struct Row {
  const float *x, *y, *z, *normal_x, *normal_y, *normal_z, *samples;
  Row(const CoarseGrid& grid, int u, int v)
      : x(&grid.x(0, v) + u),
        y(&grid.y(0, v) + u),
        z(&grid.z(0, v) + u),
        normal_x(&grid.normal_x(0, v) + u),
        normal_y(&grid.normal_y(0, v) + u),
        normal_z(&grid.normal_z(0, v) + u),
        samples(&grid.samples(0, v) + u) {}
};

/// Weights of the points of `there` for those of `here`.
TOFTWIN_VECTOR
void weigh(const Row& here, const Row& there, int first, int last, float spatial, float* __restrict weight) {
  for (int u = first; u < last; ++u) {
    const Facet p{here.x[u], here.y[u], here.z[u], here.normal_x[u], here.normal_y[u], here.normal_z[u]};
    const Facet q{there.x[u],        there.y[u],        there.z[u],
                  there.normal_x[u], there.normal_y[u], there.normal_z[u]};
    const float dx = q.x - p.x, dy = q.y - p.y, dz = q.z - p.z, range2 = rangeSquared(p);
    // 1 / (1 + d² / r²) of reach r² = (k · range)² (1 + kFewSamples / n)
    const float n = here.samples[u] + 1.0f, reach2 = range2 * (kNearShare * kNearShare) * (n + kFewSamples);
    const Fraction near{reach2, reach2 + (dx * dx + dy * dy + dz * dz) * n};
    weight[u] = spatial * there.samples[u] * (alike(p, q, range2) * near).squared();
  }
}

TOFTWIN_VECTOR
void addWeighted(const float* __restrict weight, const float* __restrict value, int first, int last,
                 float* __restrict sum) {
  for (int u = first; u < last; ++u) sum[u] += weight[u] * value[u];
}

/// Variance of a mean, per component: (⟨|z|²⟩ − |⟨z⟩|²) s / 2, with s the share of it that averaging over samples left.
/// Of a row: of what lit places send, and of the rest of the light.
TOFTWIN_VECTOR
void varianceOfMeans(const float* __restrict squares, const float* __restrict re, const float* __restrict im,
                     const float* __restrict left, const float* __restrict lit_squares,
                     const float* __restrict lit_re, const float* __restrict lit_im,
                     const float* __restrict lit_left, int count, float* __restrict variance) {
  for (int u = 0; u < count; ++u) {
    const float rest_re = re[u] - lit_re[u], rest_im = im[u] - lit_im[u];
    const float rest = squares[u] - rest_re * rest_re - rest_im * rest_im;
    const float lit = lit_squares[u] - lit_re[u] * lit_re[u] - lit_im[u] * lit_im[u];
    variance[u] = 0.5f * ((rest > 0.0f ? rest : 0.0f) * left[u] + (lit > 0.0f ? lit : 0.0f) * lit_left[u]);
  }
}

/// Those of a row of the grid, at one frequency.
void findVariances(const CoarseGrid& grid, const Channels& channels, std::size_t f, int v, float* variances) {
  const std::size_t re = Channels::re(channels.first(f)), im = Channels::im(channels.first(f));
  varianceOfMeans(&grid.squares[f](0, v), &grid.means[re](0, v), &grid.means[im](0, v), &grid.variance_left(0, v),
                  &grid.lit_squares[f](0, v), &grid.lit[re](0, v), &grid.lit[im](0, v), &grid.lit_left(0, v), grid.width,
                  variances);
}

TOFTWIN_VECTOR
void addWeightedTwice(const float* __restrict weight, const float* __restrict value, int first, int last,
                      float* __restrict sum) {
  for (int u = first; u < last; ++u) sum[u] += weight[u] * weight[u] * value[u];
}

/// A neighbour of all points of a row, and its weights for them.
struct Neighbour {
  int dx, dy, first, last;
  float* weight;

  const float* of(const Image<float>& image, int v) const { return &image(0, v + dy) + dx; }
};

/// Smoothes rows, one after the other in the same room.
class RowSmoother {
 public:
  explicit RowSmoother(const CoarseGrid& grid)
      : grid_(grid),
        per_total_(static_cast<std::size_t>(grid.width)),
        weights_(kMostNeighbours * per_total_.size()) {}

  /// One row of the smooth grid. The weights of all neighbours come first, then every channel with them.
  void smooth(const std::vector<Image<float>>& variances, int v, CoarseGrid& out) {
    const auto neighbours = findNeighbours(v);
    findTotals(neighbours);
    const std::size_t width = per_total_.size();
    for (std::size_t c = 0; c < grid_.means.size(); ++c) {
      float* to = &out.means[c](0, v);
      std::fill_n(to, width, 0.0f);
      for (const Neighbour& n : neighbours)
        addWeighted(n.weight, n.of(grid_.means[c], v), n.first, n.last, to);
      for (std::size_t u = 0; u < width; ++u) to[u] *= per_total_[u];
    }
    for (std::size_t f = 0; f < grid_.squares.size(); ++f) {
      float* to = &out.squares[f](0, v);
      std::fill_n(to, width, 0.0f);
      for (const Neighbour& n : neighbours)
        addWeightedTwice(n.weight, n.of(variances[f], v), n.first, n.last, to);
      for (std::size_t u = 0; u < width; ++u) to[u] *= per_total_[u] * per_total_[u];
    }
  }

 private:
  static constexpr std::size_t kMostNeighbours = (2 * kRadius + 1) * (2 * kRadius + 1);

  std::span<const Neighbour> findNeighbours(int v) {
    std::size_t count = 0;
    for (int dy = std::max(-kRadius, -v); dy <= std::min(kRadius, grid_.height - 1 - v); ++dy) {
      for (int dx = -kRadius; dx <= kRadius; ++dx) {
        const float spatial = std::exp(-static_cast<float>(dx * dx + dy * dy) / (2.0f * kSigma * kSigma));
        const int first = std::max(0, -dx), last = std::max(first, std::min(grid_.width, grid_.width - dx));
        float* const weight = weights_.data() + count * per_total_.size();
        neighbours_[count++] = {dx, dy, first, last, weight};
        weigh(Row{grid_, 0, v}, Row{grid_, dx, v + dy}, first, last, spatial, weight);
      }
    }
    return std::span<const Neighbour>{neighbours_}.first(count);
  }

  void findTotals(std::span<const Neighbour> neighbours) {
    std::ranges::fill(per_total_, 1e-20f);
    for (const Neighbour& n : neighbours) {
      for (int u = n.first; u < n.last; ++u) per_total_[static_cast<std::size_t>(u)] += n.weight[u];
    }
    for (float& total : per_total_) total = 1.0f / total;
  }

  const CoarseGrid& grid_;
  std::array<Neighbour, kMostNeighbours> neighbours_;
  std::vector<float> per_total_, weights_;
};

/// What a point of the grid next to a block counts for the block's pixels.
TOFTWIN_VECTOR
void weighCorner(const CoarseGrid& grid, std::size_t at, const BlockGeometry& pixels, int right, int below,
                 Lanes<float>& of, Lanes<float>& total) {
  const Facet q{grid.x[at],        grid.y[at],        grid.z[at],
                grid.normal_x[at], grid.normal_y[at], grid.normal_z[at]};
  const float known = grid.samples[at] > 0.0f ? 1.0f : 0.0f;
  Lanes<float> weight;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const auto lane = static_cast<int>(i);
    const float across = static_cast<float>(lane & 3) * (1.0f / CoarseGrid::kStep);
    const float down = static_cast<float>(lane >> 2) * (1.0f / CoarseGrid::kStep);
    const float linear = (right != 0 ? across : 1.0f - across) * (below != 0 ? down : 1.0f - down);
    const Facet p{pixels.x[i],        pixels.y[i],        pixels.z[i],
                  pixels.normal_x[i], pixels.normal_y[i], pixels.normal_z[i]};
    // Next to things that no coarse point lies on, others are better than none.
    weight[i] = known * (linear + 0.01f) * (alike(p, q, rangeSquared(p)).squared() + 1e-4f);
  }
  of = weight;
  for (std::size_t i = 0; i < kLaneCount; ++i) total[i] += weight[i];
}

/// The points around a block, by their places in the grid's images.
using Corners = std::array<std::size_t, 4>;

void weighCorners(const CoarseGrid& grid, const Corners& corners, const BlockGeometry& pixels,
                  const Lanes<float>& albedo, CornerWeights& weights) {
  Lanes<float> total;
  for (std::size_t i = 0; i < kLaneCount; ++i) total[i] = 1e-20f;
  for (std::size_t corner = 0; corner < corners.size(); ++corner) {
    weighCorner(grid, corners[corner], pixels, static_cast<int>(corner & 1), static_cast<int>(corner >> 1),
                weights.of[corner], total);
  }
  for (std::size_t i = 0; i < kLaneCount; ++i) total[i] = albedo[i] / total[i];
  for (Lanes<float>& of : weights.of) {
    for (std::size_t i = 0; i < kLaneCount; ++i) of[i] *= total[i];
  }
}

TOFTWIN_VECTOR
void mix(const Corners& corners, const CornerWeights& weights, const Image<float>& values, Lanes<float>& out) {
  const float a = values[corners[0]], b = values[corners[1]], c = values[corners[2]], d = values[corners[3]];
  const auto& [wa, wb, wc, wd] = weights.of;
  Lanes<float> mixed;
  for (std::size_t i = 0; i < kLaneCount; ++i) mixed[i] = wa[i] * a + wb[i] * b + wc[i] * c + wd[i] * d;
  out = mixed;
}

}  // namespace

void IndirectLight::smooth() {
  smooth_.resize(grid_.width, grid_.height, grid_.means.size(), grid_.squares.size());
  for (auto image : {&CoarseGrid::x, &CoarseGrid::y, &CoarseGrid::z, &CoarseGrid::normal_x, &CoarseGrid::normal_y,
                     &CoarseGrid::normal_z, &CoarseGrid::samples}) {
    smooth_.*image = grid_.*image;
  }
  std::vector<Image<float>> variances(grid_.squares.size(), Image<float>{grid_.width, grid_.height});
  inParallel(grid_.height, 8, [&](int first, int last) {
    for (int v = first; v < last; ++v) {
      for (std::size_t f = 0; f < variances.size(); ++f) findVariances(grid_, channels_, f, v, &variances[f](0, v));
    }
  });
  inParallel(grid_.height, 4, [&](int first, int last) {
    RowSmoother smoother{grid_};
    for (int v = first; v < last; ++v) smoother.smooth(variances, v, smooth_);
  });
}

IndirectLight::Spread::Spread(const Channels& channels, std::size_t frequencies)
    : sums(frequencies * channels.orders().size()),
      variance(frequencies),
      light(channels.count()) {}

void IndirectLight::spread(const Tracing& tracing, int left, int top, const BlockGeometry& pixels,
                           const BlockTruth& truth, const KeptDirect& kept, Spread& out) {
  const int u = left / CoarseGrid::kStep, v = top / CoarseGrid::kStep;
  const int right = std::min(u + 1, smooth_.width - 1), below = std::min(v + 1, smooth_.height - 1);
  const auto pointAt = [&](int column, int row) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(smooth_.width) + static_cast<std::size_t>(column);
  };
  const Corners corners{pointAt(u, v), pointAt(right, v), pointAt(u, below), pointAt(right, below)};
  CornerWeights& weights = weights_[static_cast<std::size_t>(v) * static_cast<std::size_t>(kept.columns()) +
                                    static_cast<std::size_t>(u)];
  if (weights.frame == 0 || weights.frame < kept.newest(u, v, u + 1, v + 1)) {
    weighCorners(smooth_, corners, pixels, truth.albedo, weights);
    weights.frame = kept.frame();
  }
  Lanes<float> one;
  Lanes<double> range_m;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    one[i] = 1.0f;
    range_m[i] = static_cast<double>(truth.range_m[i]);
  }
  for (std::size_t c = 0; c < out.light.size(); ++c) mix(corners, weights, smooth_.means[c], out.light[c]);
  clearSums(out.sums);
  addTurned(tracing, channels_, one, range_m, out.light, out.sums);
  for (std::size_t f = 0; f < out.variance.size(); ++f) {
    mix(corners, weights, smooth_.squares[f], out.variance[f]);
    for (std::size_t i = 0; i < kLaneCount; ++i) out.variance[f][i] *= truth.albedo[i];
  }
}

}  // namespace toftwin::sim
