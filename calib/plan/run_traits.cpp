// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/run_traits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "calib/compare/characteristics.h"
#include "calib/compare/statistics.h"
#include "calib/compare/traits/clusters.h"
#include "calib/plan/frame_traits.h"
#include "calib/plan/harmonic_traits.h"
#include "calib/plan/missing.h"
#include "calib/plan/noise_traits.h"
#include "calib/plan/own_series.h"
#include "calib/plan/seen.h"
#include "calib/plan/tilt_traits.h"
#include "protocol/types/counted.h"

namespace toftwin::plan {
namespace {

using compare::TraitCollector;

/// Which kind of block tells what; docs/characteristics.md has the same.
struct Feeds {
  const char* kind;
  const char* what;
};
constexpr std::array kFeeds{Feeds{"warm_up", "drift"},
                            Feeds{"distance", "harmonics"},
                            Feeds{"distance", "tilt over the image"},
                            Feeds{"distance", "wraps"},
                            Feeds{"distance", "noise of frames"},
                            Feeds{"distance", "temporal noise and fixed pattern over distance"},
                            Feeds{"exposure", "error over amplitude"},
                            Feeds{"ambient", "ambient light"},
                            Feeds{"bright_dark", "lag"},
                            Feeds{"scatter", "lens scatter"},
                            Feeds{"foreground", "lens scatter"},
                            Feeds{"foreground", "flying pixels"},
                            Feeds{"foreground", "emitter shadow"},
                            Feeds{"foreground", "edge width and lateral resolution"},
                            Feeds{"corner", "multipath in a corner over the distance to its edge"},
                            Feeds{"moving", "motion"},
                            Feeds{"moving", "latency"}};

}  // namespace

namespace {

std::vector<double> column(const Captures& captures,
                           const std::function<double(const ComparedCapture&)>& value) {
  std::vector<double> values;
  for (const ComparedCapture* one : captures) values.push_back(value(*one));
  return values;
}
std::vector<double> differencesOf(const Captures& captures) {
  return column(captures, [](const auto& one) { return one.difference_mm; });
}

std::vector<std::size_t> numbersOf(const Captures& captures) {
  std::vector<std::size_t> numbers;
  for (const ComparedCapture* one : captures) numbers.push_back(one->record.number);
  return numbers;
}

double meanOf(const std::vector<double>& values) {
  return values.empty() ? std::nan("") : compare::summarise(values).mean;
}

/// "at 5 to 60 klx, " where it was in light; empty otherwise.
std::string lightOf(const Captures& captures) {
  const auto light = [](const ComparedCapture* one) { return one->record.ambient_klx; };
  const auto [least, most] = std::ranges::minmax_element(captures, {}, light);
  if (!(light(*most) > 0.0)) return "";
  if (light(*least) == light(*most)) return fmt::format("at {:g} klx, ", light(*most));
  return fmt::format("at {:g} to {:g} klx, ", light(*least), light(*most));
}

/// The camera's series, and what it is without.
OwnSeries ownSeriesOf(const ComparedRun& run, const char* kind, std::size_t camera, const char* what,
                      TraitCollector& all) {
  OwnSeries series = ownSeries(run, kind, camera);
  if (series.captures.empty()) {
    all.untold(
        fmt::format("{} of {}: it has no pixel in all captures of kind {}", what, kCameras[camera], kind));
  } else if (!series.left_out.empty()) {
    all.untold(fmt::format("{} of {}: {}in {} of {} captures, it lost over half of its pixels", what,
                           kCameras[camera], lightOf(series.left_out), series.left_out.size(),
                           series.captures.size() + series.left_out.size()));
  }
  return series;
}

void addDrift(const ComparedRun& run, TraitCollector& all) {
  if (capturesOf(run, "warm_up").empty()) return;
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    const OwnSeries series = ownSeriesOf(run, "warm_up", camera, kDrift, all);
    if (series.captures.empty()) continue;
    const auto since = column(series.captures, [&](const ComparedCapture& one) {
      return (camera == 0 ? one.record.a : one.record.b).since_power_on_s;
    });
    compare::NamedRows rows{kDrift, kCameras[camera], since, series.range_mm, numbersOf(series.captures)};
    const auto drift = compare::driftTraits(rows.x, rows.y);
    all.add(std::move(rows), drift);
  }
}

/// A number for each distance and angle of a block: what a camera is off by there does not go with the
/// amplitude.
std::vector<std::size_t> placesOf(const Captures& captures) {
  std::map<std::tuple<std::string, double, double>, std::size_t> numbers;
  const auto known = [](double value) { return std::isfinite(value) ? value : -1.0; };
  std::vector<std::size_t> places;
  for (const ComparedCapture* one : captures) {
    const auto& record = one->record;
    const std::tuple place{record.block, known(record.distance_m), known(record.angle_deg)};
    places.push_back(numbers.try_emplace(place, numbers.size()).first->second);
  }
  return places;
}

void addAmplitudeAndAmbient(const ComparedRun& run, TraitCollector& all) {
  if (const Captures captures = capturesOf(run, "exposure"); !captures.empty()) {
    const auto places = placesOf(captures);
    all.add("error over amplitude", "B − A",
            compare::amplitudeTraits(column(captures, [](const auto& one) { return one.amplitude_a; }),
                                     differencesOf(captures), places));
    for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
      const auto error = column(captures, [&](const auto& one) { return meanOf(one.seen[camera].wall_error_mm); });
      if (std::ranges::any_of(error, [](double e) { return std::isfinite(e); }))
        all.add(
            "error over amplitude, against the plan's wall", kCameras[camera],
            compare::amplitudeTraits(
                column(captures, [&](const auto& one) { return one.own[camera].amplitude; }), error, places));
    }
  }
  if (capturesOf(run, "ambient").empty()) return;
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    const OwnSeries series = ownSeriesOf(run, "ambient", camera, "ambient light", all);
    if (series.captures.empty()) continue;
    const auto light = column(series.captures, [](const auto& one) { return one.record.ambient_klx; });
    all.add("ambient light", kCameras[camera],
            compare::ambientTraits(light, series.range_mm, series.noise_mm));
  }
}

/// What seenOf() leaves out of captures whose pose is by planes.
void sayWhatPlanesHide(const ComparedRun& run, TraitCollector& all) {
  const auto isHidden = [](const ComparedCapture& one) { return isPoseFromPlanes(one.record); };
  const auto hidden = std::ranges::count_if(run.captures, isHidden);
  if (hidden == 0) return;
  all.untold(fmt::format(
      "errors against the plan's walls at {} (harmonics, error over amplitude, corners and lens scatter of "
      "A and of B by themselves): the pose was fitted to A's own ranges of these planes, which takes "
      "up A's errors",
      counted(hidden, "capture")));
}

void addMasks(const ComparedRun& run, TraitCollector& all) {
  const auto maskOf = [](const Image<float>& share, const Image<float>& looked_at) {
    Image<std::uint8_t> mask{share.width(), share.height()};
    for (std::size_t i = 0; i < mask.size(); ++i)
      mask[i] = std::isfinite(looked_at[i]) && share[i] >= 0.5F ? 1 : 0;
    return mask;
  };
  std::vector<Image<std::uint8_t>> a, b;
  for (const ComparedCapture* one : capturesOf(run, "")) {
    a.push_back(maskOf(one->thinned.valid_a, one->thinned.valid_b));
    b.push_back(maskOf(one->thinned.valid_b, one->thinned.valid_b));
  }
  all.add("masks", "A and B", compare::maskTraits(a, b));
}

/// Shares of one capture's pixels that both cameras look at.
struct ValidShares {
  double a = 0.0, b = 0.0, both = 0.0, pixels = 0.0;

  explicit ValidShares(const compare::PoseComparison& images) {
    for (std::size_t i = 0; i < images.valid_a.size(); ++i) {
      if (!std::isfinite(images.valid_b[i])) continue;
      const bool has_a = images.valid_a[i] >= 0.5F, has_b = images.valid_b[i] >= 0.5F;
      a += has_a, b += has_b, both += has_a && has_b, ++pixels;
    }
    for (double* share : {&a, &b, &both}) *share /= std::max(1.0, pixels);
  }
};

/// Repeats of a condition have the same mask but for noise: their mean is one row. Not with the lens covered,
/// where what is valid is noise; but where one camera has nothing at all.
void addValidPixels(const ComparedRun& run, TraitCollector& all) {
  std::map<CaptureRecord::Condition, std::size_t> conditions;
  std::vector<double> a, b, both;
  std::vector<std::size_t> condition;
  compare::Running pixels;  // of one image
  for (const ComparedCapture& one : run.captures) {
    const ValidShares shares{one.thinned};
    if (one.record.kind == nameOf(Kind::Dark) || !(shares.a + shares.b > 0.0)) continue;
    a.push_back(shares.a), b.push_back(shares.b), both.push_back(shares.both), pixels.add(shares.pixels);
    condition.push_back(
        conditions.try_emplace(one.record.conditionInRun(), conditions.size()).first->second);
  }
  const auto means = [&](const std::vector<double>& of) { return compare::clusterMeans(of, condition); };
  const auto valid = compare::validTraits(means(a), means(b), means(both), pixels.mean());
  if (!valid) return all.untold(valid.error().message);
  all.add(compare::kValidPixels, "A", valid->a);
  all.add(compare::kValidPixels, "B", valid->b);
  all.add(compare::kValidPixels, "B − A", valid->difference);
  all.add(compare::kValidPixels, "A and B", valid->both);
}

/// What no block of the run feeds. What two kinds of block tell needs one of them.
void sayWhatIsMissing(const ComparedRun& run, TraitCollector& all) {
  std::map<std::string_view, std::pair<bool, std::string>> told;  // whether it is, and by which kinds
  for (const Feeds& one : kFeeds) {
    const auto isIt = [&](const ComparedCapture& capture) { return capture.record.kind == one.kind; };
    auto& [is_told, kinds] = told[one.what];
    is_told = is_told || std::ranges::any_of(run.captures, isIt) || std::ranges::any_of(run.moving, isIt);
    kinds += (kinds.empty() ? "" : " or ") + std::string{one.kind};
  }
  for (const auto& [what, by] : told) {
    if (!by.first) all.untold(fmt::format("{}: the run has no block of kind {}", what, by.second));
  }
}

}  // namespace

RunTraits traitsOf(const ComparedRun& run) {
  TraitCollector all;
  addDrift(run, all);
  addHarmonics(run, all);
  addTilt(run, all);
  addAmplitudeAndAmbient(run, all);
  addMasks(run, all);
  addValidPixels(run, all);
  addNoiseTraits(run, all);
  addFrameTraits(run, all);
  sayWhatPlanesHide(run, all);
  sayWhatIsMissing(run, all);
  RunTraits found = std::move(all).found();
  found.missing = missingOf(run);
  return found;
}

std::vector<std::string> feedsOf(std::string_view kind) {
  std::vector<std::string> told;
  for (const Feeds& one : kFeeds) {
    if (one.kind == kind) told.emplace_back(one.what);
  }
  return told;
}

}  // namespace toftwin::plan
