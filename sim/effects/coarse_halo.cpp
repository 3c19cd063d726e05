// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/coarse_halo.h"

#include <algorithm>
#include <cmath>

#include "sim/effects/half_gaussian.h"
#include "sim/images/rows.h"
#include "sim/images/simd.h"

namespace toftwin::sim {
namespace {

constexpr int kCell = 4;  ///< pixels
/// Cells around the image: pixels at its border reach so far.
constexpr int kRing = 2;
/// What going down to cells and up again adds to the variance of a Gaussian, pixels²: cubic
/// B-splines, both times. Wherever sampled, their sum, mean and variance (a third of a cell²) are
/// exact, so that only the fourth moment depends on where in a cell light falls: of the peak 1.7e-4
/// at 12 pixels, 5e-5 at 15.
constexpr double kCellVariance = 2.0 * kCell * kCell / 3.0;
/// So many pixels send light to a cell, the first of them so far before the cell's own first.
constexpr int kReach = 16, kBefore = 14;

int cellsAlong(int pixels) { return (pixels + kCell - 1) / kCell + 2 * kRing; }

TOFTWIN_SIMD void addScaled(const float* __restrict in, float weight, int count, float* __restrict sum) {
  for (int i = 0; i < count; ++i) sum[i] += weight * in[i];
}

TOFTWIN_SIMD void addFour(const float* const* rows, const std::array<float, 4>& weight, int count,
                          float* __restrict sum) {
  const float *a = rows[0], *b = rows[1], *c = rows[2], *d = rows[3];
  const float wa = weight[0], wb = weight[1], wc = weight[2], wd = weight[3];
  for (int i = 0; i < count; ++i) sum[i] += wa * a[i] + wb * b[i] + wc * c[i] + wd * d[i];
}

TOFTWIN_SIMD void mixFour(const float* const* rows, const std::array<float, 4>& weight, int count,
                          float* __restrict out) {
  const float *a = rows[0], *b = rows[1], *c = rows[2], *d = rows[3];
  const float wa = weight[0], wb = weight[1], wc = weight[2], wd = weight[3];
  for (int i = 0; i < count; ++i) out[i] = wa * a[i] + wb * b[i] + wc * c[i] + wd * d[i];
}

/// sum += Σ weight · row of any number of rows, four at a time.
template <class RowOf, class WeightOf>
void addRows(int first, int last, const RowOf& rowOf, const WeightOf& weightOf, int count, float* sum) {
  int i = first;
  for (; i + 4 <= last; i += 4) {
    const float* rows[] = {rowOf(i), rowOf(i + 1), rowOf(i + 2), rowOf(i + 3)};
    addFour(rows, {weightOf(i), weightOf(i + 1), weightOf(i + 2), weightOf(i + 3)}, count, sum);
  }
  for (; i < last; ++i) addScaled(rowOf(i), weightOf(i), count, sum);
}

/// out[4c + r] = pixels[r][c]
void interleave(const std::vector<float>* pixels, int parts, std::size_t groups, float* out) {
  for (std::size_t c = 0; c < groups; ++c) {
    for (std::size_t r = 0; r < kCell; ++r) {
      for (std::size_t part = 0; part < static_cast<std::size_t>(parts); ++part)
        *out++ = pixels[r][c * static_cast<std::size_t>(parts) + part];
    }
  }
}

/// Σ weights · pixels for each of a row's cells; eight sums side by side, of which `parts` are left.
TOFTWIN_SIMD void sumCells(const float* pixels, const float* weights, int parts, int cells, float* out) {
  for (int u = 0; u < cells; ++u) {
    const float* from = pixels + u * kCell * parts;
    float sums[8] = {};
    for (int k = 0; k < kReach * parts; k += 8) {
#pragma GCC unroll 8
      for (int i = 0; i < 8; ++i) sums[i] += weights[k + i] * from[k + i];
    }
    for (int part = 0; part < parts; ++part) {
      float sum = 0.0F;
      for (int i = part; i < 8; i += parts) sum += sums[i];
      out[u * parts + part] = sum * (1.0F / (kCell * kCell));
    }
  }
}

}  // namespace

CoarseHalo::Knots CoarseHalo::knotsOf(int pixel) {
  const double place = (pixel + 0.5) / kCell - 0.5 + kRing, t = place - std::floor(place), s = 1.0 - t;
  return {static_cast<int>(std::floor(place)) - 1,
          {static_cast<float>(s * s * s / 6.0), static_cast<float>((4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0),
           static_cast<float>((4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0), static_cast<float>(t * t * t / 6.0)}};
}

std::vector<CoarseHalo::Knots> CoarseHalo::knotsOfAll(int pixels) {
  std::vector<Knots> knots;
  for (int i = 0; i < pixels; ++i) knots.push_back(knotsOf(i));
  return knots;
}

CoarseHalo::CoarseHalo(const float* image, int width, int height, int parts, double sigma)
    : width_(width), parts_(parts), rows_(knotsOfAll(height)) {
  const Image<float> cells = cellsOf(image, height);
  for (std::size_t i = 0; i < cells.size(); ++i)
    sum_[i % static_cast<std::size_t>(parts)] += static_cast<double>(cells[i]) * (kCell * kCell);
  wide_ = widened(blurred(cells, std::sqrt(sigma * sigma - kCellVariance) / kCell));
}

/// Mean light of cells and of the dark ring, into which light is scattered too.
Image<float> CoarseHalo::cellsOf(const float* image, int height) const {
  const int count = width_ * parts_, across = cellsAlong(width_);
  // Every cell sees its pixels in the same way.
  std::array<float, 2 * kReach> weights{};
  for (int i = 0; i < kReach; ++i) {
    const int pixel = kCell * 8 - kBefore + i, cell = 8;
    const Knots knots = knotsOf(pixel);
    for (int part = 0; part < parts_; ++part)
      weights[static_cast<std::size_t>(i * parts_ + part)] = knots.weight[static_cast<std::size_t>(cell - knots.first)];
  }
  auto cells = Image<float>::unset(across * parts_, cellsAlong(height));
  inFewParts(cells.height(), 4, [&](int first, int last) {
    std::vector<float> padded(static_cast<std::size_t>((kCell * across + kReach) * parts_));
    float* sum = padded.data() + kBefore * parts_;
    for (int v = first; v < last; ++v) {
      std::fill_n(sum, count, 0.0F);
      const int from = kCell * v - kBefore;
      addRows(
          std::max(0, from), std::min(from + kReach, height),
          [&](int y) { return image + static_cast<std::size_t>(y) * static_cast<std::size_t>(count); },
          [&](int y) {
            const Knots& row = rows_[static_cast<std::size_t>(y)];
            return row.weight[static_cast<std::size_t>(v - row.first)];
          },
          count, sum);
      sumCells(padded.data(), weights.data(), parts_, across, &cells(0, v));
    }
  });
  return cells;
}

/// Along the rows, then along the columns.
Image<float> CoarseHalo::blurred(const Image<float>& cells, double sigma_cells) const {
  const std::vector<float> half = halfGaussian(sigma_cells);
  const int count = cells.width(), height = cells.height(), reach = static_cast<int>(half.size()) - 1;
  const auto weightAt = [&](int i) { return half[static_cast<std::size_t>(std::abs(i))]; };
  Image<float> along_rows{count, height}, result{count, height};
  inFewParts(height, 4, [&](int first, int last) {
    std::vector<float> padded(static_cast<std::size_t>(count + 2 * reach * parts_));
    for (int y = first; y < last; ++y) {
      std::copy_n(&cells(0, y), count, padded.begin() + reach * parts_);
      addRows(
          -reach, reach + 1, [&](int i) { return padded.data() + (reach + i) * parts_; }, weightAt, count,
          &along_rows(0, y));
    }
  });
  inFewParts(height, 4, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      addRows(
          std::max(0, y - reach), std::min(height, y + reach + 1), [&](int from) { return &along_rows(0, from); },
          [&](int from) { return weightAt(from - y); }, count, &result(0, y));
    }
  });
  return result;
}

Image<float> CoarseHalo::widened(const Image<float>& cells) const {
  auto wide = Image<float>::unset(width_ * parts_, cells.height());
  const int groups = (width_ + kCell - 1) / kCell, count = groups * parts_;
  inFewParts(cells.height(), 4, [&](int first, int last) {
    // Every fourth column sees its cells in the same way.
    std::array<std::vector<float>, kCell> pixels;
    pixels.fill(std::vector<float>(static_cast<std::size_t>(count)));
    std::vector<float> row(static_cast<std::size_t>(count) * kCell);
    for (int v = first; v < last; ++v) {
      for (int r = 0; r < kCell; ++r) {
        const Knots knots = knotsOf(r);
        const float* in = &cells(knots.first * parts_, v);
        const float* four[] = {in, in + parts_, in + 2 * parts_, in + 3 * parts_};
        mixFour(four, knots.weight, count, pixels[static_cast<std::size_t>(r)].data());
      }
      const bool fits = groups * kCell == width_;  // else the last group has more pixels than there are
      interleave(pixels.data(), parts_, static_cast<std::size_t>(groups), fits ? &wide(0, v) : row.data());
      if (!fits) std::copy_n(row.data(), width_ * parts_, &wide(0, v));
    }
  });
  return wide;
}

void CoarseHalo::row(int y, float* out) const {
  const Knots& row = rows_[static_cast<std::size_t>(y)];
  const float* four[4];
  for (int i = 0; i < 4; ++i) four[i] = &wide_(0, row.first + i);
  mixFour(four, row.weight, width_ * parts_, out);
}

}  // namespace toftwin::sim
