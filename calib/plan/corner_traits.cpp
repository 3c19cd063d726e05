// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/corner_traits.h"

#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/least_squares.h"
#include "calib/plan/seen.h"

namespace toftwin::plan {
namespace {

using compare::Running;
using compare::TraitCollector;

struct Band {
  double from_m, to_m;
  [[nodiscard]] std::string name() const { return fmt::format("{:g} to {:g} m from the edge", from_m, to_m); }
};
constexpr std::array<Band, 3> kBands{{{0.0, 0.1}, {0.1, 0.3}, {0.3, 0.9}}};

/// A corner's errors, mm, of each pose and of all together, in steps of 2.5 cm of the distance to its edge, as pixels of
/// one step are no independent rows.
struct Corner {
  std::map<std::size_t, std::map<double, Running>> of_pose{};
  std::map<double, Running> together{};
};
using Corners = std::map<std::string, Corner>;  ///< by block

Corners cornersOf(const ComparedRun& run, const ErrorAtRange& own, std::size_t camera) {
  constexpr double kStep_m = 0.025;
  constexpr std::size_t kFewest = 4;
  Corners corners;
  for (const ComparedCapture* one : allCapturesOf(run, "corner")) {
    if (isPoseFromPlanes(one->record)) continue;
    const CameraSeen& seen = one->seen[camera];
    std::map<long, Running> steps;
    for (std::size_t i = 0; i < seen.corner_place_m.size(); ++i) {
      if (const double usual = own(seen.corner_range_m[i]); std::isfinite(usual))
        steps[std::lround(seen.corner_place_m[i] / kStep_m)].add(seen.corner_error_mm[i] - usual);
    }
    for (const auto& [step, errors] : steps) {
      if (errors.n() < kFewest) continue;
      Corner& corner = corners[one->record.block];
      const double place_m = kStep_m * static_cast<double>(step);
      corner.of_pose[one->record.condition][place_m].add(errors.mean()), corner.together[place_m].add(errors.mean());
    }
  }
  return corners;
}

/// The mean over a band, of each pose that shows some of it.
std::map<std::size_t, double> within(const Band& band, const Corner& corner) {
  std::map<std::size_t, double> means;
  for (const auto& [pose, steps] : corner.of_pose) {
    Running all;
    for (const auto& [place_m, errors] : steps) {
      if (place_m >= band.from_m && place_m < band.to_m) all.add(errors.mean());
    }
    if (all.n() > 0) means[pose] = all.mean();
  }
  return means;
}

/// Of what `meansIn` has of each pose in a band.
std::vector<compare::Trait> bandsBy(const auto& meansIn) {
  std::vector<compare::Trait> traits;
  for (const Band& band : kBands) {
    std::vector<double> rows;
    for (const auto& [pose, mean] : meansIn(band)) rows.push_back(mean);
    if (!rows.empty()) traits.push_back(compare::meanTrait(band.name(), "mm", rows));
  }
  return traits;
}

void addOwn(const std::string& name, const Corner& corner, std::size_t camera, TraitCollector& all) {
  const auto bands = bandsBy([&](const Band& band) { return within(band, corner); });
  if (bands.empty())
    all.untold(fmt::format("{} of {}: no wall is seen where the plan puts it (within 300 mm)", name, kCameras[camera]));
  else
    all.add(name, kCameras[camera], bands);
  // The fall from the edge as one exponential, where it is one: at the very edge both ways are equally long.
  std::vector<double> place_m, error_mm;
  for (const auto& [place, errors] : corner.together) place_m.push_back(place), error_mm.push_back(errors.mean());
  if (const auto fall = compare::cornerTraits(place_m, error_mm)) all.add(name, kCameras[camera], fall);
}

/// Pose by pose, as both cameras stood there.
void addDifference(const std::string& name, const Corner& of_a, const Corner& of_b, TraitCollector& all) {
  const auto bands = bandsBy([&](const Band& band) {
    const auto a = within(band, of_a);
    auto both = within(band, of_b);
    std::erase_if(both, [&](const auto& one) { return !a.contains(one.first); });
    for (auto& [pose, mean] : both) mean -= a.at(pose);
    return both;
  });
  if (!bands.empty()) all.add(name, "B − A", bands);
}

}  // namespace

void addCornerTraits(const ComparedRun& run, const std::array<ErrorAtRange, 2>& own, TraitCollector& all) {
  const std::array<Corners, 2> corners{cornersOf(run, own[0], 0), cornersOf(run, own[1], 1)};
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    for (const auto& [name, corner] : corners[camera]) addOwn(name, corner, camera, all);
  }
  for (const auto& [name, of_a] : corners[0]) {
    if (const auto of_b = corners[1].find(name); of_b != corners[1].end())
      addDifference(name, of_a, of_b->second, all);
  }
}

}  // namespace toftwin::plan
