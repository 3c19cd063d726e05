// SPDX-License-Identifier: Apache-2.0
// The module toftwin._toftwin, which the package toftwin shows to people.
#include "tools/python/errors.h"
#include "tools/python/parts.h"

PYBIND11_MODULE(_toftwin, module) {
  using namespace toftwin::python;
  pybind11::options options;
  options.disable_function_signatures();  // they stand in __init__.pyi, with types that people know
  module.attr("__version__") = TOFTWIN_VERSION;
  defineErrors(module);
  defineFrames(module);
  defineClient(module);
  defineRecordings(module);
  defineRendering(module);
  defineTables(module);
}
