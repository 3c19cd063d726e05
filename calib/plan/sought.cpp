// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/sought.h"

#include <fmt/format.h>

#include <set>

#include "calib/plan/run_settings.h"

namespace toftwin::plan {
namespace {

using Numbers = std::vector<const LoggedTrait*>;

/// Sources of the cameras, by which one is asked for.
std::set<std::string> camerasOf(const Numbers& all) {
  std::set<std::string> names;
  for (const LoggedTrait* one : all) {
    if (one->trait.of != "B") names.insert(cameraNameOf(one->run.camera_a).source);
    if (one->trait.of != "A") names.insert(cameraNameOf(one->run.camera_b).source);
  }
  return names;
}

std::set<std::string> namesOf(const Numbers& all, const auto& name) {
  std::set<std::string> names;
  for (const LoggedTrait* one : all) names.insert(name(*one));
  return names;
}

std::string none(const std::string& what, const std::string& asked, const std::set<std::string>& there_are) {
  return fmt::format("no {} begins with \"{}\"; there are: {}", what, asked, fmt::join(there_are, ", "));
}

}  // namespace

std::string whyNone(const std::vector<LoggedTrait>& all, const Sought& sought) {
  if (all.empty()) return "none of its runs tells any number";
  const auto what = [](const LoggedTrait& one) { return one.trait.what; };
  const auto name = [](const LoggedTrait& one) { return one.trait.trait.name; };
  Numbers of_all, of_camera, of_both;
  for (const LoggedTrait& one : all) {
    of_all.push_back(&one);
    if (!one.isOf(sought.camera)) continue;
    of_camera.push_back(&one);
    if (what(one).starts_with(sought.characteristic)) of_both.push_back(&one);
  }
  if (of_camera.empty()) return none("camera", sought.camera, camerasOf(of_all));
  const std::string of_it = sought.camera.empty() ? "" : fmt::format(" of camera \"{}\"", sought.camera);
  if (of_both.empty()) return none("characteristic" + of_it, sought.characteristic, namesOf(of_camera, what));
  const std::string in_it =
      sought.characteristic.empty() ? "" : fmt::format(" of characteristic \"{}\"", sought.characteristic);
  return none("number" + in_it + of_it, sought.number, namesOf(of_both, name));
}

}  // namespace toftwin::plan
