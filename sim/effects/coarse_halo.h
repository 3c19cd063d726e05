// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <toftwin/image.h>

namespace toftwin::sim {

/// G * image for a wide Gaussian G, dark outside the image, by way of an image of cells of 4 × 4 pixels: the same
/// cost for any width. Its rows are made one by one, where they are wanted.
class CoarseHalo {
 public:
  /// From this standard deviation on, in pixels, its form is right within 1e-3 of its peak (tested).
  static constexpr double kLeastSigma = 12.0;

  /// Of `width` × `height` pixels that have `parts` floats each: one, or the two of a complex number.
  CoarseHalo(const float* image, int width, int height, int parts, double sigma);

  /// The sum over all pixels, part by part.
  [[nodiscard]] std::array<double, 2> sum() const { return sum_; }
  /// Writes row y of the halo, one float more than the row has if their number is odd.
  void row(int y, float* out) const;

 private:
  /// The four cells from `first` on, counted with a dark ring around the image, that a pixel's light goes to or
  /// comes from.
  struct Knots {
    int first;
    std::array<float, 4> weight;
  };
  static Knots knotsOf(int pixel);
  static std::vector<Knots> knotsOfAll(int pixels);

  [[nodiscard]] Image<float> cellsOf(const float* image, int height) const;
  [[nodiscard]] Image<float> blurred(const Image<float>& cells, double sigma_cells) const;
  [[nodiscard]] Image<float> widened(const Image<float>& cells) const;

  int width_, parts_;
  std::vector<Knots> rows_;
  std::array<double, 2> sum_{};
  Image<float> wide_;  ///< rows of cells with as many columns as the image has
};

}  // namespace toftwin::sim
