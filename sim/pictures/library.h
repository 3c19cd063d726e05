// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include <toftwin/result.h>

namespace toftwin::pictures {

/// The function of that mangled name in OpenCV's library for picture files. It brings GDAL and a hundred more, whose
/// loading takes 60 ms: each program that links it would begin with that, and few ever see a picture. So it is opened
/// by the first that does, and stays open. Unsupported: it is not there, or is another one.
Result<void*> libraryFunction(const char* name);

/// The same with its type.
template <class Function>
Result<std::function<Function>> functionNamed(const char* name) {
  const auto symbol = libraryFunction(name);
  if (!symbol) return symbol.error();
  return std::function<Function>{reinterpret_cast<Function*>(*symbol)};
}

}  // namespace toftwin::pictures
