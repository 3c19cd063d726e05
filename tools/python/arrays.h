// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <array>
#include <vector>

#include <toftwin/frame.h>

namespace toftwin::python {

namespace py = pybind11;

/// A plane as an array that nobody can write into, over the plane's own memory, which it keeps: shape (height, width), or
/// (channels, height, width) where there are several.
py::array arrayOf(const Plane& plane);

/// A copy of an array of shape (height, width) or (channels, height, width); float32, uint8 or uint16, or what becomes float32.
/// Throws ValueError for another shape.
Plane planeOf(PlaneKind kind, const py::array& array);

/// A 4 × 4 matrix that takes homogeneous coordinates, in metres.
template <class To, class From>
py::array_t<double> matrixOf(const Transform<To, From>& pose);

/// The pose of a 4 × 4 matrix. Throws ValueError if it is none of a rigid motion.
Transform<World, Camera> poseOf(const py::array_t<double, py::array::c_style | py::array::forcecast>& matrix);

/// One or several: of shape (4, 4) or (n, 4, 4).
std::vector<Transform<World, Camera>> posesOf(const py::array_t<double, py::array::c_style | py::array::forcecast>& matrices);

}  // namespace toftwin::python
