// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <toftwin/frame.h>

namespace toftwin::python {

/// The kinds of these words, or ValueError that lists the words there are.
std::vector<PlaneKind> planesNamed(const std::vector<std::string>& names);

}  // namespace toftwin::python
