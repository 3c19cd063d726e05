// SPDX-License-Identifier: Apache-2.0
// Noise of repeated frames: how large, how much of it stands still, how alike neighbours are.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <iterator>
#include <utility>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {
namespace {

constexpr int kBlocks = 4;  ///< along each side

/// Sums over the pixels of one block.
struct PixelBlock {
  double squares = 0.0, count = 0.0;  ///< of residuals from each pixel's mean
  double along_x = 0.0, along_x_squares = 0.0, along_y = 0.0, along_y_squares = 0.0, in_time = 0.0;
  std::vector<double> sums{};  ///< of each frame's residuals
  Running means{};
};

struct Residuals {
  std::vector<Image<float>> frames;
  Image<float> mean;  ///< NaN where a frame is not valid
};

Residuals residualsOf(std::span<const Image<float>> frames) {
  Residuals r{.frames = {frames.begin(), frames.end()},
              .mean = Image<float>(frames[0].width(), frames[0].height())};
  const auto n = static_cast<double>(frames.size());
  for (std::size_t i = 0; i < r.mean.size(); ++i) {
    double sum = 0.0;
    for (const auto& frame : frames) sum += static_cast<double>(frame[i]);
    r.mean[i] = static_cast<float>(sum / n);
    for (auto& frame : r.frames) frame[i] = static_cast<float>(static_cast<double>(frame[i]) - sum / n);
  }
  return r;
}

/// A pixel's own squares, and its products with its right and lower neighbour and with its next frame.
void add(const Residuals& r, int x, int y, PixelBlock& block) {
  const auto value = [&](std::size_t f, int px, int py) { return static_cast<double>(r.frames[f](px, py)); };
  if (std::isnan(r.mean(x, y))) return;
  block.means.add(static_cast<double>(r.mean(x, y)));
  block.sums.resize(r.frames.size(), 0.0);
  const bool has_right = x + 1 < r.mean.width() && !std::isnan(r.mean(x + 1, y));
  const bool has_below = y + 1 < r.mean.height() && !std::isnan(r.mean(x, y + 1));
  for (std::size_t f = 0; f < r.frames.size(); ++f) {
    const double e = value(f, x, y);
    block.squares += e * e, block.sums[f] += e;
    if (f + 1 < r.frames.size()) block.in_time += e * value(f + 1, x, y);
    if (has_right) {
      const double other = value(f, x + 1, y);
      block.along_x += e * other;
      block.along_x_squares += 0.5 * (e * e + other * other);
    }
    if (has_below) {
      const double other = value(f, x, y + 1);
      block.along_y += e * other;
      block.along_y_squares += 0.5 * (e * e + other * other);
    }
  }
  block.count += 1.0;
}

/// Variance of the mean of n values relative to theirs, if each goes with the one before by ρ (AR(1)):
///   v = ( (1 + ρ)/(1 − ρ) − 2ρ (1 − ρⁿ) / (n (1 − ρ)²) ) / n
double varianceOfMean(double rho, double n) {
  const double rest = 1.0 - rho;
  return ((1.0 + rho) / rest - 2.0 * rho * (1.0 - std::pow(rho, n)) / (n * rest * rest)) / n;
}

/// What Σ eₜ eₜ₊₁ / Σ eₜ² is on the mean for residuals from the mean of n such values:
///   ( (n − 1) ρ − (n + 1) v + 2 c ) / ( n − n v ),   c = (1 − ρⁿ) / (n (1 − ρ)), the first value's
///   covariance with the mean
double expectedRatio(double rho, double n) {
  const double v = varianceOfMean(rho, n), c = (1.0 - std::pow(rho, n)) / (n * (1.0 - rho));
  return ((n - 1.0) * rho - (n + 1.0) * v + 2.0 * c) / (n - n * v);
}

/// The ρ whose ratio was measured.
double correlationFrom(double ratio, double n) {
  double low = -0.95, high = 0.98;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (expectedRatio(middle, n) < ratio ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// What n frames, which are off from their mean, have in common in all of their blocks: the mean product of two blocks.
double sharedByFrames(std::span<const PixelBlock> blocks, double n, const PixelBlock* without) {
  double products = 0.0, pairs = 0.0;
  for (std::size_t f = 0; f < blocks.front().sums.size(); ++f) {
    double sum = 0.0, squares = 0.0, g = 0.0;
    for (const PixelBlock& one : blocks) {
      if (&one == without) continue;
      const double mean = one.sums[f] / one.count;
      sum += mean, squares += mean * mean, g += 1.0;
    }
    products += sum * sum - squares, pairs = g * (g - 1.0);
  }
  return products / (pairs * n);
}

/// What several blocks together make of n frames.
struct OfBlocks {
  double variance = 0.0, pattern = 0.0, in_time = 0.0;
  double shared = 0.0;  ///< of the variance, by all pixels of a frame

  OfBlocks(std::span<const PixelBlock> blocks, double n, const PixelBlock* without = nullptr) {
    double squares = 0.0, products = 0.0, count = 0.0;
    Running of_means;
    for (const PixelBlock& one : blocks) {
      if (&one == without) continue;
      squares += one.squares, products += one.in_time, count += one.count;
      of_means.add(one.means.variance());
    }
    in_time = correlationFrom(products / squares, n);
    // Values that go with each other scatter less about their own mean, and their mean scatters more.
    const double of_mean = varianceOfMean(in_time, n);
    variance = squares / (count * n * (1.0 - of_mean));
    shared = std::max(0.0, sharedByFrames(blocks, n, without) / (1.0 - of_mean));
    pattern = of_means.mean() - (variance - shared) * of_mean;
  }
};

/// What each block makes of a number of all of them together (J. W. Tukey's pseudo-values, Ann. Math. Stat. 29 (1958)
/// 614): how these scatter is how uncertain it is, and of σ² that of ρ is in it, by which all blocks' σ² are enlarged.
std::vector<double> pseudoValues(std::span<const PixelBlock> blocks, double n, double OfBlocks::*number) {
  const auto g = static_cast<double>(blocks.size());
  const double all = OfBlocks{blocks, n}.*number;
  std::vector<double> values;
  for (const PixelBlock& one : blocks) values.push_back(g * all - (g - 1.0) * (OfBlocks{blocks, n, &one}.*number));
  return values;
}

/// Blocks say nothing of how uncertain a part of σ² is that all of them share: that is χ² of the frames, n (1 −
/// ρ²)/(1 + ρ²) independent ones, and its sides are added in squares (R. K. Burdick, F. A. Graybill, Confidence
/// Intervals on Variance Components, 1992).
void addWhatFramesShare(std::span<const PixelBlock> blocks, double n, Trait& variance) {
  const OfBlocks all{blocks, n};
  const double square = all.in_time * all.in_time, shared = all.shared,
               degrees = std::max(1.0, n * (1.0 - square) / (1.0 + square) - 1.0);
  const boost::math::chi_squared spread{degrees};
  const double below = shared * (1.0 - degrees / boost::math::quantile(spread, 0.975)),
               above = shared * (degrees / boost::math::quantile(spread, 0.025) - 1.0);
  variance.low = variance.value - std::hypot(variance.value - variance.low, below);
  variance.high = variance.value + std::hypot(variance.high - variance.value, above);
}

/// Of a quantity whose root is shown.
Trait rootOf(Trait trait) {
  for (double* one : {&trait.value, &trait.low, &trait.high}) *one = std::sqrt(std::max(0.0, *one));
  return trait;
}

}  // namespace

Traits noiseTraits(std::span<const Image<float>> frames_mm) {
  const auto refuse = [](std::string why) {
    return Error{Error::Code::InvalidArgument, "noise: " + std::move(why)};
  };
  if (frames_mm.size() < 8) return refuse(fmt::format("{} frames; it takes eight", frames_mm.size()));
  const int width = frames_mm[0].width(), height = frames_mm[0].height();
  for (const auto& frame : frames_mm) {
    if (frame.width() != width || frame.height() != height) return refuse("frames of different sizes");
  }
  if (std::min(width, height) < 2 * kBlocks) return refuse("an image of less than 8 x 8 pixels");
  const Residuals r = residualsOf(frames_mm);
  std::array<PixelBlock, kBlocks * kBlocks> blocks;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x)
      add(r, x, y, blocks[static_cast<std::size_t>(y * kBlocks / height * kBlocks + x * kBlocks / width)]);
  }
  std::vector<PixelBlock> used;
  std::ranges::copy_if(blocks, std::back_inserter(used),
                       [](const PixelBlock& block) { return block.count >= 4.0 && block.squares > 0.0; });
  if (used.size() < 4) return refuse("fewer than four of 16 blocks of the image are valid and noisy");
  const double n = static_cast<double>(frames_mm.size());
  std::vector<double> along_x, along_y;
  for (const PixelBlock& block : used) {
    along_x.push_back(block.along_x / block.along_x_squares);
    along_y.push_back(block.along_y / block.along_y_squares);
  }
  Trait temporal = meanTrait("temporal noise", "mm", pseudoValues(used, n, &OfBlocks::variance));
  addWhatFramesShare(used, n, temporal);
  return std::vector{rootOf(std::move(temporal)),
                     rootOf(meanTrait("fixed pattern", "mm", pseudoValues(used, n, &OfBlocks::pattern))),
                     meanTrait("correlation along x", "1", along_x),
                     meanTrait("correlation along y", "1", along_y),
                     meanTrait("correlation in time", "1", pseudoValues(used, n, &OfBlocks::in_time))};
}

}  // namespace toftwin::compare
