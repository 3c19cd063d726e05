// SPDX-License-Identifier: Apache-2.0
#include "tools/python/arrays.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#include <toftwin/names.h>

namespace toftwin::python {
namespace {

py::dtype typeOf(ElementType type) {
  if (type == ElementType::U8) return py::dtype::of<std::uint8_t>();
  return type == ElementType::U16 ? py::dtype::of<std::uint16_t>() : py::dtype::of<float>();
}

/// Keeps a buffer for as long as an array looks at it.
py::capsule keeperOf(const Buffer& buffer) {
  return py::capsule{new Buffer{buffer}, [](void* kept) { delete static_cast<Buffer*>(kept); }};
}

template <class T>
Buffer copied(const py::array& array) {
  const auto numbers = py::array_t<T, py::array::c_style | py::array::forcecast>::ensure(array);
  if (!numbers) throw py::error_already_set{};
  return Buffer::adopt(std::vector<T>(numbers.data(), numbers.data() + numbers.size()));
}

/// Of a rotation matrix, the branch whose root is largest, so that nothing small is divided by.  [Shepperd 1978]
std::array<double, 4> quaternionOf(const std::array<std::array<double, 3>, 3>& r) {
  const double trace = r[0][0] + r[1][1] + r[2][2];
  const std::array<double, 4> squares{trace, r[0][0], r[1][1], r[2][2]};
  const auto largest = std::max_element(squares.begin(), squares.end()) - squares.begin();
  std::array<double, 4> q{};
  if (largest == 0) {
    q = {1.0 + trace, r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]};
  } else if (largest == 1) {
    q = {r[2][1] - r[1][2], 1.0 + r[0][0] - r[1][1] - r[2][2], r[0][1] + r[1][0], r[0][2] + r[2][0]};
  } else if (largest == 2) {
    q = {r[0][2] - r[2][0], r[0][1] + r[1][0], 1.0 + r[1][1] - r[0][0] - r[2][2], r[1][2] + r[2][1]};
  } else {
    q = {r[1][0] - r[0][1], r[0][2] + r[2][0], r[1][2] + r[2][1], 1.0 + r[2][2] - r[0][0] - r[1][1]};
  }
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (double& one : q) one /= length;
  return q;
}

/// How far R Rᵀ is from one, at most in any element.
double distanceFromRotation(const std::array<std::array<double, 3>, 3>& r) {
  double most = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const double product = r[i][0] * r[j][0] + r[i][1] * r[j][1] + r[i][2] * r[j][2];
      most = std::max(most, std::abs(product - (i == j ? 1.0 : 0.0)));
    }
  }
  return most;
}

Transform<World, Camera> poseAt(const double* matrix) {
  std::array<std::array<double, 3>, 3> r{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) r[i][j] = matrix[4 * i + j];
  const double determinant = r[0][0] * (r[1][1] * r[2][2] - r[1][2] * r[2][1]) - r[0][1] * (r[1][0] * r[2][2] - r[1][2] * r[2][0]) +
                             r[0][2] * (r[1][0] * r[2][1] - r[1][1] * r[2][0]);
  const bool has_last_row = matrix[12] == 0.0 && matrix[13] == 0.0 && matrix[14] == 0.0 && matrix[15] == 1.0;
  const bool is_finite = std::all_of(matrix, matrix + 16, [](double one) { return std::isfinite(one); });
  constexpr double kMostError = 1e-6;  // of matrices in single precision
  if (!is_finite || !has_last_row || !(distanceFromRotation(r) <= kMostError) || determinant < 0.0) {
    throw py::value_error{"a pose is a 4 x 4 matrix of a rotation and a translation in metres, with the last row 0, 0, 0, 1"};
  }
  return {quaternionOf(r), {matrix[3], matrix[7], matrix[11]}};
}

}  // namespace

py::array arrayOf(const Plane& plane) {
  std::vector<py::ssize_t> shape{plane.height, plane.width};
  if (plane.channels != 1) shape.insert(shape.begin(), plane.channels);
  py::array array{typeOf(plane.type), shape, plane.data.bytes().data(), keeperOf(plane.data)};
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

Plane planeOf(PlaneKind kind, const py::array& array) {
  if (array.ndim() != 2 && array.ndim() != 3) {
    throw py::value_error{fmt::format("{}: a plane has the shape (height, width) or (channels, height, width), not {} dimensions",
                                      nameOf(kind), array.ndim())};
  }
  Plane plane;
  plane.kind = kind;
  plane.channels = array.ndim() == 3 ? static_cast<int>(array.shape(0)) : 1;
  plane.height = static_cast<int>(array.shape(array.ndim() - 2));
  plane.width = static_cast<int>(array.shape(array.ndim() - 1));
  const bool is_whole = array.dtype().kind() == 'u';
  plane.type = is_whole && array.itemsize() == 1   ? ElementType::U8
               : is_whole && array.itemsize() == 2 ? ElementType::U16
                                                   : ElementType::F32;
  plane.data = plane.type == ElementType::U8    ? copied<std::uint8_t>(array)
               : plane.type == ElementType::U16 ? copied<std::uint16_t>(array)
                                                : copied<float>(array);
  return plane;
}

template <class To, class From>
py::array_t<double> matrixOf(const Transform<To, From>& pose) {
  py::array_t<double> matrix{std::vector<py::ssize_t>{4, 4}};
  auto m = matrix.mutable_unchecked<2>();
  const std::array<Vec3d, 3> columns{pose.rotate({1, 0, 0}), pose.rotate({0, 1, 0}), pose.rotate({0, 0, 1})};
  for (py::ssize_t j = 0; j < 4; ++j) {
    const Vec3d v = j < 3 ? columns[static_cast<std::size_t>(j)] : pose.translation_m;
    m(0, j) = v.x, m(1, j) = v.y, m(2, j) = v.z, m(3, j) = j < 3 ? 0.0 : 1.0;
  }
  return matrix;
}
template py::array_t<double> matrixOf(const Transform<World, Camera>&);

Transform<World, Camera> poseOf(const py::array_t<double, py::array::c_style | py::array::forcecast>& matrix) {
  if (matrix.ndim() != 2) throw py::value_error{"a pose is one matrix of shape (4, 4)"};
  return posesOf(matrix).front();
}

std::vector<Transform<World, Camera>> posesOf(const py::array_t<double, py::array::c_style | py::array::forcecast>& matrices) {
  const auto n = matrices.ndim();
  if ((n != 2 && n != 3) || matrices.shape(n - 1) != 4 || matrices.shape(n - 2) != 4) {
    throw py::value_error{"poses have the shape (4, 4) or (n, 4, 4)"};
  }
  std::vector<Transform<World, Camera>> poses;
  const py::ssize_t count = n == 2 ? 1 : matrices.shape(0);
  for (py::ssize_t i = 0; i < count; ++i) poses.push_back(poseAt(matrices.data() + 16 * i));
  return poses;
}

}  // namespace toftwin::python
