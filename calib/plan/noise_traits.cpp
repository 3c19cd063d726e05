// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/noise_traits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "calib/compare/statistics.h"

namespace toftwin::plan {
namespace {

using compare::NamedRows;
using compare::TraitCollector;
constexpr std::array kCameras{"A", "B"};
constexpr const char* kPattern = "fixed pattern";

/// A number of the frames' noise by its name; nothing where it is none: a pattern too weak to be told from
/// the noise left in the means.
std::optional<double> noiseOf(const ComparedCapture& one, std::size_t camera, std::string_view name) {
  const auto& noise = one.seen[camera].noise;
  const auto found = std::ranges::find(noise, name, &compare::Trait::name);
  return found == noise.end() || !(found->value > 0.0) ? std::nullopt : std::optional{found->value};
}

/// Captures without other light, which makes noise of its own, of which both cameras tell this noise: a law's numbers
/// are those at the largest signal, which must be the same for both. Where the other camera tells none at all, those of
/// this one.
std::vector<const ComparedCapture*> toldBy(const ComparedRun& run, std::size_t camera, std::string_view name,
                                           std::string_view kind = {}) {
  std::vector<const ComparedCapture*> own, both;
  for (const ComparedCapture& one : run.captures) {
    if (one.record.ambient_klx > 0.0 || (!kind.empty() && one.record.kind != kind) || !noiseOf(one, camera, name))
      continue;
    own.push_back(&one);
    if (noiseOf(one, 1 - camera, name)) both.push_back(&one);
  }
  return both.empty() ? own : both;
}

/// The noise at the capture whose wall is nearest to the middle of the others'.
void addNoiseOfFrames(const ComparedRun& run, std::size_t camera, TraitCollector& all) {
  std::vector<const ComparedCapture*> walls;
  std::vector<double> distances;
  for (const std::string_view kind : {"distance", "warm_up"}) {
    for (const ComparedCapture& one : run.captures) {
      if (one.record.kind != kind || one.seen[camera].noise.empty()) continue;
      walls.push_back(&one), distances.push_back(one.record.distance_m);
    }
    if (!walls.empty()) break;
  }
  if (walls.empty()) {
    all.untold(
        fmt::format("noise of frames of {}: it takes eight frames of a wall in a block of kind distance or "
                    "warm_up, 8 × 8 pixels or more",
                    kCameras[camera]));
    return;
  }
  const double middle = compare::quantile(distances, 0.5);
  const ComparedCapture& best = **std::ranges::min_element(
      walls, {}, [&](const ComparedCapture* one) { return std::abs(one->record.distance_m - middle); });
  all.add("noise of frames", kCameras[camera], best.seen[camera].noise,
          fmt::format("at {:.3g} m", best.record.distance_m));
}

/// Light falls with the square of the distance, so the law is that over amplitude with I = 1/d².
Result<compare::FittedTraits> fittedOverDistance(const NamedRows& rows) {
  std::vector<double> light;
  for (const double d : rows.x) light.push_back(1.0 / (d * d));
  auto fitted = compare::fittedNoiseLaw(light, rows.y);
  if (fitted) fitted->curve.at = [law = std::move(fitted->curve.at)](double d) { return law(1.0 / (d * d)); };
  return fitted;
}

/// Light is 1/d² at one exposure only.
void keepMostCommonExposure(std::vector<const ComparedCapture*>& captures) {
  std::map<double, int> count;
  for (const ComparedCapture* one : captures) ++count[one->record.exposure_us];
  const auto most = std::ranges::max_element(count, {}, &std::pair<const double, int>::second);
  std::erase_if(captures, [&](const ComparedCapture* one) { return one->record.exposure_us != most->first; });
}

void addOverDistance(const ComparedRun& run, std::size_t camera, TraitCollector& all) {
  for (const auto& [what, name] :
       {std::pair{kNoiseOverDistance, "temporal noise"}, std::pair{kPatternOverDistance, kPattern}}) {
    NamedRows rows{what, kCameras[camera]};
    auto captures = toldBy(run, camera, name, "distance");
    keepMostCommonExposure(captures);
    for (const ComparedCapture* one : captures) {
      if (!(one->record.distance_m > 0.0)) continue;
      rows.x.push_back(one->record.distance_m), rows.y.push_back(*noiseOf(*one, camera, name));
      rows.condition.push_back(one->record.number);
    }
    if (rows.x.empty()) continue;  // said of the noise of frames
    const auto fitted = fittedOverDistance(rows);
    all.add(std::move(rows), fitted);
  }
}

/// Only how signals compare counts; the largest is 1.
void scaleToLargest(std::vector<double>& signal) {
  if (signal.empty()) return;
  const double most = std::ranges::max(signal);
  for (double& one : signal) one /= most;
}

void addLaw(NamedRows rows, TraitCollector& all) {
  scaleToLargest(rows.x);
  const auto fitted = compare::fittedNoiseLaw(rows.x, rows.y);
  all.add(std::move(rows), fitted);
}

/// Of the wall's middle, where the pattern is told.
void addPatternOverAmplitude(const ComparedRun& run, std::size_t camera, TraitCollector& all) {
  NamedRows rows{kPatternOverAmplitude, kCameras[camera]};
  for (const ComparedCapture* one : toldBy(run, camera, kPattern)) {
    const double amplitude = compare::summarise(one->seen[camera].brightness).mean;
    if (!(amplitude > 0.0)) continue;
    rows.x.push_back(amplitude), rows.y.push_back(*noiseOf(*one, camera, kPattern));
    rows.condition.push_back(one->record.number);
  }
  if (!rows.x.empty()) addLaw(std::move(rows), all);
}

/// Of whole images; not in other light, which makes noise of its own.
void addNoiseLaw(const ComparedRun& run, std::size_t camera, TraitCollector& all) {
  NamedRows rows{kNoiseLaw, kCameras[camera]};
  for (const ComparedCapture& one : run.captures) {
    const double amplitude = camera == 0 ? one.amplitude_a : one.amplitude_b;
    if (one.pixels == 0 || one.record.ambient_klx > 0.0 || !(amplitude > 0.0)) continue;
    rows.x.push_back(amplitude), rows.y.push_back(camera == 0 ? one.noise_a_mm : one.noise_b_mm);
    rows.condition.push_back(one.record.number);
  }
  if (rows.x.empty()) {
    all.untold(fmt::format("noise law of {}: its frames have no amplitude", kCameras[camera]));
    return;
  }
  addLaw(std::move(rows), all);
}

}  // namespace

void addNoiseTraits(const ComparedRun& run, TraitCollector& all) {
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    addNoiseLaw(run, camera, all);
    const auto isWall = [](const ComparedCapture& one) {
      return one.record.kind == "distance" || one.record.kind == "warm_up";
    };
    if (std::ranges::any_of(run.captures, isWall)) addNoiseOfFrames(run, camera, all);
    addOverDistance(run, camera, all);
    addPatternOverAmplitude(run, camera, all);
  }
}

}  // namespace toftwin::plan
