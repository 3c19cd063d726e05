// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace toftwin::test {

/// All places of the text that match the expression (ECMAScript), each as the whole and its groups. Compiled once:
/// <regex> costs a test two seconds of compiling.
std::vector<std::vector<std::string>> matchesIn(const std::string& text, const std::string& expression);

}  // namespace toftwin::test
