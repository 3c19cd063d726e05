// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/noise_traits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>
#include <variant>

#include <fmt/format.h>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/common_reference.h"

namespace toftwin::plan {
namespace {

using compare::NamedRows;
using compare::TraitCollector;
constexpr const char* kPattern = "fixed pattern";

/// A number of the frames' noise by its name; nothing where it is none: a pattern too weak to be told from
/// the noise left in the means, so that its interval reaches 0. Where it does, half of the values are over 0.
std::optional<double> noiseOf(const ComparedCapture& one, std::size_t camera, std::string_view name) {
  const auto& noise = one.seen[camera].noise;
  const auto found = std::ranges::find(noise, name, &compare::Trait::name);
  if (found == noise.end() || !(found->value > 0.0) || (name == kPattern && !(found->low > 0.0)))
    return std::nullopt;
  return found->value;
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

/// Captures of walls of which the camera tells its frames' noise; of which both do, where the other tells
/// any: noise goes with the distance. The distance block's, if there are any.
struct Walls {
  std::vector<const ComparedCapture*> chosen{};
  bool other_has = false, has = false;

  Walls(const ComparedRun& run, std::size_t camera) {
    for (const std::string_view kind : {"distance", "warm_up"}) {
      std::vector<const ComparedCapture*> own, both;
      for (const ComparedCapture& one : run.captures) {
        if (one.record.kind != kind) continue;
        const bool is_own = !one.seen[camera].noise.empty(), is_others = !one.seen[1 - camera].noise.empty();
        if (is_own) own.push_back(&one);
        if (is_own && is_others) both.push_back(&one);
        has = has || is_own, other_has = other_has || is_others;
      }
      if (!both.empty()) {
        chosen = both;
        return;
      }
      if (chosen.empty()) chosen = own;
    }
    if (other_has) chosen.clear();
  }
};

/// The noise at the capture whose wall is nearest to the middle of the others', the same for both cameras.
void addNoiseOfFrames(const ComparedRun& run, std::size_t camera, TraitCollector& all) {
  const Walls walls{run, camera};
  if (walls.chosen.empty()) {
    all.untold(
        fmt::format("noise of frames of {}: {}", kCameras[camera],
                    walls.has && walls.other_has
                        ? "A and B tell it at no capture in common, and it goes with the distance"
                        : "it takes eight frames of a wall in a block of kind distance or warm_up, 8 × 8 "
                          "pixels or more"));
    return;
  }
  std::vector<double> distances;
  for (const ComparedCapture* one : walls.chosen) distances.push_back(one->record.distance_m);
  const double middle = compare::quantile(distances, 0.5);
  const ComparedCapture& best = **std::ranges::min_element(walls.chosen, {}, [&](const ComparedCapture* one) {
    return std::abs(one->record.distance_m - middle);
  });
  all.add("noise of frames", kCameras[camera], best.seen[camera].noise,
          fmt::format("at {:.3g} m", best.record.distance_m));
}

/// Light falls with the square of the distance, so the law is that over amplitude with I = 1/d².
Result<compare::FittedTraits> fittedOverDistance(const NamedRows& rows,
                                                 std::span<const double> frequency_hz) {
  std::vector<double> light;
  for (const double d : rows.x) light.push_back(1.0 / (d * d));
  auto fitted = compare::fittedNoiseLaw(light, rows.y, frequency_hz);
  if (fitted) fitted->curve.at = [law = std::move(fitted->curve.at)](double d) { return law(1.0 / (d * d)); };
  return fitted;
}

/// By which it is known up to where noise goes as 1/amplitude; a pattern that stands still is no such noise.
std::span<const double> frequenciesOfNoise(const ComparedRun& run, std::size_t camera,
                                           std::string_view name) {
  return name == kPattern ? std::span<const double>{} : run.frequency_hz[camera];
}

void nameAsPattern(std::vector<compare::Trait>& traits) {
  for (compare::Trait& one : traits) {
    const auto part = std::ranges::find(compare::kLawParts, std::string_view{one.name});
    if (part != compare::kLawParts.end())
      one.name = compare::kPatternParts[static_cast<std::size_t>(part - compare::kLawParts.begin())];
  }
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
    auto fitted = fittedOverDistance(rows, frequenciesOfNoise(run, camera, name));
    const auto nearest = fmt::format("{:.3g} m", std::ranges::min(rows.x));
    for (std::size_t i = 0; fitted && i < fitted->traits.size(); ++i) {
      if (compare::AtSignal* at = compare::signalOf(fitted->traits[i]); at != nullptr) at->place = nearest;
    }
    if (fitted && std::string_view{name} == kPattern) nameAsPattern(fitted->traits);
    all.add(std::move(rows), fitted);
  }
}

/// Only how signals compare counts; the largest is 1.
void scaleToLargest(std::vector<double>& signal) {
  if (signal.empty()) return;
  const double most = std::ranges::max(signal);
  for (double& one : signal) one /= most;
}

/// Where the signal is largest: another run's may be largest elsewhere, and what is told at it is another number then.
void namePlace(const ComparedRun& run, const NamedRows& rows, std::vector<compare::Trait>& traits) {
  const auto recordOf = [&](std::size_t number) {
    const auto numberOf = [](const ComparedCapture& one) { return one.record.number; };
    const auto found = std::ranges::find(run.captures, number, numberOf);
    return found == run.captures.end() ? nullptr : &found->record;
  };
  const auto largest = static_cast<std::size_t>(std::ranges::max_element(rows.x) - rows.x.begin());
  const CaptureRecord* record = recordOf(rows.condition[largest]);
  // Which of a condition's repeats has most is chance.
  if (const CaptureRecord* first = record->again ? recordOf(*record->again) : nullptr; first != nullptr) record = first;
  for (compare::Trait& one : traits)
    if (compare::AtSignal* at = compare::signalOf(one); at != nullptr) at->place = record->name;
}

/// Cameras have units of signal of their own: what both are told at is the light of the capture at which both
/// have most.
void relateTo(const NamedRows& other, const NamedRows& rows, std::vector<compare::Trait>& traits) {
  double most = 0.0, at_it = std::nan("");
  std::string unit;
  for (std::size_t i = 0; i < rows.x.size(); ++i) {
    const auto same = std::ranges::find(other.condition, rows.condition[i]);
    if (same == other.condition.end()) continue;
    const double both = rows.x[i] * other.x[static_cast<std::size_t>(same - other.condition.begin())];
    if (both <= most) continue;
    most = both, at_it = rows.x[i], unit = fmt::format("the signal of capture {}", rows.condition[i]);
  }
  for (compare::Trait& one : traits) {
    if (compare::AtSignal* at = compare::signalOf(one); at != nullptr) at->most /= at_it, at->unit = unit;
  }
}

void addLaw(const ComparedRun& run, NamedRows rows, const NamedRows& other, std::span<const double> frequency_hz,
            TraitCollector& all) {
  scaleToLargest(rows.x);
  auto fitted = compare::fittedNoiseLaw(rows.x, rows.y, frequency_hz);
  if (fitted) relateTo(other, rows, fitted->traits), namePlace(run, rows, fitted->traits);
  if (fitted && rows.what == kPatternOverAmplitude) nameAsPattern(fitted->traits);
  all.add(std::move(rows), fitted);
}

/// Of the wall's middle, where the pattern is told.
NamedRows patternOverAmplitude(const ComparedRun& run, std::size_t camera) {
  NamedRows rows{kPatternOverAmplitude, kCameras[camera]};
  for (const ComparedCapture* one : toldBy(run, camera, kPattern)) {
    const double amplitude = compare::summarise(one->seen[camera].brightness).mean;
    if (!(amplitude > 0.0)) continue;
    rows.x.push_back(amplitude), rows.y.push_back(*noiseOf(*one, camera, kPattern));
    rows.condition.push_back(one->record.number);
  }
  return rows;
}

/// Of whole images; not in other light, which makes noise of its own, nor with the lens covered: what is read
/// there is noise as its signal, too.
NamedRows noiseOverSignal(const ComparedRun& run, std::size_t camera) {
  NamedRows rows{kNoiseLaw, kCameras[camera]};
  for (const ComparedCapture& one : run.captures) {
    const OwnReading& own = one.own[camera];
    const bool is_covered = one.record.kind == nameOf(Kind::Dark);
    if (one.record.ambient_klx > 0.0 || is_covered || !(own.amplitude > 0.0)) continue;
    rows.x.push_back(own.amplitude), rows.y.push_back(own.noise_mm);
    rows.condition.push_back(one.record.number);
  }
  return rows;
}

void addNoiseLaw(const ComparedRun& run, std::size_t camera, TraitCollector& all) {
  NamedRows rows = noiseOverSignal(run, camera);
  if (rows.x.empty()) {
    all.untold(fmt::format("noise law of {}: its frames have no amplitude", kCameras[camera]));
    return;
  }
  if (run.frequency_hz[camera].empty()) {
    all.untold(
        fmt::format("up to which noise the noise law of {} holds: its frames say no modulation frequency, so "
                    "all captures are "
                    "fitted",
                    kCameras[camera]));
  }
  addLaw(run, std::move(rows), noiseOverSignal(run, 1 - camera), run.frequency_hz[camera], all);
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
    if (NamedRows rows = patternOverAmplitude(run, camera); !rows.x.empty())
      addLaw(run, std::move(rows), patternOverAmplitude(run, 1 - camera), {}, all);
  }
}

}  // namespace toftwin::plan
