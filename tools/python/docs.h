// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <python_docs.h>  // made of toftwin/__init__.pyi by docs_header.py

#include <string_view>

namespace toftwin::python {

/// What toftwin/__init__.pyi says of a thing ("Client.stream"), so that it is written once. What it does not say does not compile.
consteval const char* doc(std::string_view name) {
  for (const auto& [of, text] : kDocs) {
    if (of == name) return text;
  }
  throw "toftwin/__init__.pyi says nothing of it";
}

}  // namespace toftwin::python
