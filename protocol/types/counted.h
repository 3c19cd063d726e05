// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace toftwin {

/// "1 capture", "2 captures": of words that take an s.
template <class Count>
std::string counted(Count count, std::string_view what) {
  return std::to_string(count) + ' ' + std::string{what} + (count == Count{1} ? "" : "s");
}

}  // namespace toftwin
