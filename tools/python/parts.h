// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

/// The parts of the module: each adds its classes and functions. tools/python/toftwin/__init__.pyi is what people read.
namespace toftwin::python {

void defineFrames(pybind11::module_& module);
void defineClient(pybind11::module_& module);
void defineRecordings(pybind11::module_& module);
void defineRendering(pybind11::module_& module);
void defineTables(pybind11::module_& module);

}  // namespace toftwin::python
