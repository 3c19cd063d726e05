// SPDX-License-Identifier: Apache-2.0
#include "matches.h"

#include <regex>

namespace toftwin::test {

std::vector<std::vector<std::string>> matchesIn(const std::string& text, const std::string& expression) {
  const std::regex wanted{expression};
  std::vector<std::vector<std::string>> all;
  for (std::sregex_iterator at{text.begin(), text.end(), wanted}, end; at != end; ++at)
    all.emplace_back(at->begin(), at->end());
  return all;
}

}  // namespace toftwin::test
