// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3d303/clipping.h"

#include <boost/property_tree/json_parser.hpp>

#include <cmath>
#include <sstream>

#include "daemon/facades/o3d303/answers.h"

namespace toftwin::daemon::o3d303 {

bool readCuboid(const std::string& json, Clipping& clipping) {
  constexpr std::size_t kLongest = 1024;  // and thereby the deepest
  if (json.size() > kLongest) return false;
  boost::property_tree::ptree tree;
  std::istringstream text{json};
  try {
    boost::property_tree::read_json(text, tree);
  } catch (const boost::property_tree::ptree_error&) {
    return false;
  }
  Clipping read = clipping;
  constexpr const char* kLeast[] = {"XMin", "YMin", "ZMin"};
  constexpr const char* kMost[] = {"XMax", "YMax", "ZMax"};
  std::size_t known = 0;
  const auto take = [&](const char* name, double& metres) {
    const auto found = tree.find(name);
    if (found == tree.not_found()) return true;
    const auto number = realIn(found->second.data());
    if (!number) return false;
    metres = *number;
    ++known;
    return true;
  };
  for (std::size_t i = 0; i < 3; ++i) {
    if (!take(kLeast[i], read.least_m[i]) || !take(kMost[i], read.most_m[i])) return false;
  }
  if (known != tree.size()) return false;
  clipping = read;
  return true;
}

}  // namespace toftwin::daemon::o3d303
