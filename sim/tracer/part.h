// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <xmmintrin.h>

#include <algorithm>
#include <complex>
#include <cstddef>

#include <toftwin/image.h>

#include "sim/tracer/path.h"

namespace toftwin::sim {

/// The part of an image that a block covers.
struct Part {
  static constexpr int kSize = 4;  ///< of a block, both ways

  int x, y, width, height;

  Part(const Block& block, const CameraInfo& camera) : Part(block.x, block.y, camera) {}
  Part(int left, int top, const CameraInfo& camera)
      : x(left),
        y(top),
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

  /// What the pixels have there; zero for NaN and outside.
  void load(const Image<float>& image, Lanes<float>& lanes) const {
    if (width == kSize && height == kSize) {
      for (int row = 0; row < kSize; ++row) {
        const __m128 values = _mm_loadu_ps(&image(x, y + row));
        _mm_store_ps(lanes.v + row * kSize, _mm_and_ps(values, _mm_cmpord_ps(values, values)));
      }
      return;
    }
    for (int row = 0; row < kSize; ++row) {
      const float* from = &image(x, y + std::min(row, height - 1));
      for (int column = 0; column < kSize; ++column) {
        const float value = from[std::min(column, width - 1)];
        const bool is_there = (row < height) & (column < width) & (value == value);
        lanes[static_cast<std::size_t>(row * kSize + column)] = is_there ? value : 0.0f;
      }
    }
  }

  void copy(Image<float>& image, const Lanes<float>& lanes) const {
    if (width != kSize) return store(image, [&](std::size_t i, float) { return lanes[i]; });
    for (int row = 0; row < height; ++row) _mm_storeu_ps(&image(x, y + row), _mm_load_ps(lanes.v + row * kSize));
  }
  /// Parts that lie apart become complex numbers.
  void copy(Image<std::complex<float>>& image, const Lanes<float>& re, const Lanes<float>& im) const {
    if (width != kSize) {
      return store(image, [&](std::size_t i, std::complex<float>) { return std::complex<float>{re[i], im[i]}; });
    }
    for (int row = 0; row < height; ++row) {
      const __m128 a = _mm_load_ps(re.v + row * kSize), b = _mm_load_ps(im.v + row * kSize);
      auto* to = reinterpret_cast<float*>(&image(x, y + row));
      _mm_storeu_ps(to, _mm_unpacklo_ps(a, b));
      _mm_storeu_ps(to + 4, _mm_unpackhi_ps(a, b));
    }
  }
};

}  // namespace toftwin::sim
