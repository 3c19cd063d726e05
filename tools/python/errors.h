// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

#include <string>

#include <toftwin/result.h>

namespace toftwin::python {

namespace py = pybind11;

/// An Error on its way to Python, where it is a toftwin.Error with a `code`.
struct Thrown {
  Error error;
};

/// The value, or its Error thrown.
template <class T>
T orThrow(Result<T> result) {
  if (!result) throw Thrown{result.error()};
  return std::move(*result);
}
inline void orThrow(const Result<>& result) {
  if (!result) throw Thrown{result.error()};
}

/// The word of a code, as `Error.code` gives it.
const char* wordOf(Error::Code code);

/// Adds the class Error to the module, and has what is thrown become one.
void defineErrors(py::module_& module);

/// Runs what may take long without holding Python up.
template <class Work>
auto withoutLock(Work work) {
  const py::gil_scoped_release released;
  return work();
}

}  // namespace toftwin::python
