// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/wire/extrinsics.h"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace toftwin::o3d303 {
namespace {

using Matrix = std::array<double, 9>;  // row by row

/// Rx(a) Ry(b) Rz(c), multiplied out.
Matrix rotationOf(const ExtrinsicCalibration& extrinsics) {
  const auto radians = [&](std::size_t i) {
    return static_cast<double>(extrinsics[i]) * std::numbers::pi / 180.0;
  };
  const double a = radians(3), b = radians(4), c = radians(5);
  const double ca = std::cos(a), sa = std::sin(a), cb = std::cos(b), sb = std::sin(b), cc = std::cos(c),
               sc = std::sin(c);
  return {cb * cc,
          -cb * sc,
          sb,
          ca * sc + sa * sb * cc,
          ca * cc - sa * sb * sc,
          -sa * cb,
          sa * sc - ca * sb * cc,
          sa * cc + ca * sb * sc,
          ca * cb};
}

Matrix transposed(const Matrix& m) { return {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]}; }

bool isRotated(const ExtrinsicCalibration& extrinsics) {
  return extrinsics[3] != 0.0F || extrinsics[4] != 0.0F || extrinsics[5] != 0.0F;
}

std::vector<float> multiplied(const Matrix& m, std::span<const float> vectors) {
  std::vector<float> result(vectors.size());
  for (std::size_t i = 0; i + 2 < vectors.size(); i += 3) {
    for (std::size_t row = 0; row < 3; ++row) {
      double sum = 0.0;
      for (std::size_t k = 0; k < 3; ++k) sum += m[3 * row + k] * static_cast<double>(vectors[i + k]);
      result[i + row] = static_cast<float>(sum);
    }
  }
  return result;
}

}  // namespace

std::vector<float> unitVectorsFrom(std::span<const float> rays, const ExtrinsicCalibration& extrinsics) {
  if (!isRotated(extrinsics)) return {rays.begin(), rays.end()};
  return multiplied(rotationOf(extrinsics), rays);
}

std::vector<float> raysFrom(std::span<const float> unit_vectors, const ExtrinsicCalibration& extrinsics) {
  if (!isRotated(extrinsics)) return {unit_vectors.begin(), unit_vectors.end()};
  return multiplied(transposed(rotationOf(extrinsics)), unit_vectors);
}

}  // namespace toftwin::o3d303
