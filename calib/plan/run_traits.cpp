// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/run_traits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/compare/characteristics.h"
#include "calib/compare/live_report.h"
#include "calib/compare/statistics.h"
#include "calib/compare/traits/clusters.h"
#include "calib/plan/frame_traits.h"
#include "calib/plan/noise_traits.h"
#include "calib/plan/own_series.h"

namespace toftwin::plan {
namespace {

using compare::TraitCollector;
using Captures = std::vector<const ComparedCapture*>;

/// Which kind of block tells what; docs/characteristics.md has the same.
struct Feeds {
  const char* kind;
  const char* what;
};
constexpr std::array kFeeds{Feeds{"warm_up", "drift"},
                            Feeds{"distance", "harmonics"},
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

Captures capturesOf(const ComparedRun& run, std::string_view kind) {
  Captures chosen;
  for (const ComparedCapture& one : run.captures) {
    if (one.pixels > 0 && (kind.empty() || one.record.kind == kind)) chosen.push_back(&one);
  }
  return chosen;
}

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

constexpr std::array kCameras{"A", "B"};

/// The camera's series, and what it is without.
OwnSeries ownSeriesOf(const ComparedRun& run, const char* kind, std::size_t camera, const char* what,
                      TraitCollector& all) {
  OwnSeries series = ownSeries(run, kind, camera);
  if (series.captures.empty()) {
    all.untold(
        fmt::format("{} of {}: it has no pixel in all captures of kind {}", what, kCameras[camera], kind));
  } else if (series.left_out > 0) {
    all.untold(fmt::format("{} of {} at {} captures, in which it lost over half of its pixels", what,
                           kCameras[camera], series.left_out));
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

/// So near frequencies are one: over 8 m at 100 MHz, 0.1 % shifts a wave by 0.03 rad.
constexpr double kSameFrequency = 1e-3;

bool areTheSame(const std::vector<double>& a, const std::vector<double>& b) {
  return std::ranges::equal(a, b, [](double x, double y) { return std::abs(x - y) <= kSameFrequency * x; });
}

std::string wordsOf(const std::vector<double>& frequency_hz) {
  std::string words;
  for (const double f : frequency_hz) words += fmt::format("{}{:.6g}", words.empty() ? "" : ", ", f / 1e6);
  return words.empty() ? "no frequency that its frames say" : words + " MHz";
}

/// Errors over distance: a wall's parts in steps of range, capture by capture. Over a wide wall ranges differ
/// by much of a wave, so that a whole image's mean would lose the short ones.
struct OverDistance {
  std::vector<double> distance_m{}, error_mm{};
  std::vector<std::size_t> capture{}, condition{};  ///< condition: capture and step

  void add(std::size_t number, const std::vector<double>& at_m, const std::vector<double>& of_mm) {
    constexpr double kStep_m = 0.025;
    constexpr double kFewest = 0.01;  // of all pixels: fewer are beside the wall, or wrapped
    double all = 0.0;
    std::map<long, std::pair<compare::Running, compare::Running>> steps;  // ranges are positive
    for (std::size_t i = 0; i < at_m.size(); ++i) {
      if (!std::isfinite(of_mm[i]) || !std::isfinite(at_m[i])) continue;
      auto& [at, of] = steps[std::lround(at_m[i] / kStep_m)];
      at.add(at_m[i]), of.add(of_mm[i]), ++all;
    }
    for (const auto& [step, means] : steps) {
      if (static_cast<double>(means.first.n()) < kFewest * all) continue;
      distance_m.push_back(means.first.mean()), error_mm.push_back(means.second.mean());
      capture.push_back(number), condition.push_back(kMostSteps * number + static_cast<std::size_t>(step));
    }
  }

 private:
  static constexpr std::size_t kMostSteps = 1'000'000;  ///< 25 km of them
};

/// What A weighs in the mean of both cameras' ranges by 1/σ². Of all means of the two it is the one whose
/// noise does not go with that of B − A: steps of A's own range would show A's noise as a slope.
double weightOfA(const ComparedCapture& one) {
  const double a = one.noise_a_mm * one.noise_a_mm, b = one.noise_b_mm * one.noise_b_mm;
  return a + b > 0.0 ? b / (a + b) : 0.5;  // no noise, or not known
}

/// B − A of a capture's compared pixels over the range to the plan's wall, of those that see it; where no
/// pose tells that, over what both cameras read.
void addDifference(const ComparedCapture& one, OverDistance& rows) {
  const Image<float> difference = compare::comparedDifference_mm(one.thinned);
  const double of_b = 1.0 - weightOfA(one);
  std::vector<double> at, of;
  for (std::size_t i = 0; i < difference.size(); ++i) {
    const auto d_mm = static_cast<double>(difference[i]);
    const double read_mm = static_cast<double>(one.thinned.range_a_mm[i]) + of_b * d_mm;
    const double wall_mm =
        one.wall_range_m.empty() ? read_mm : 1e3 * static_cast<double>(one.wall_range_m[i]);
    // About 0 even where noise is large: that of read_mm does not go with that of d_mm, which the cut leaves
    // as it is.
    if (!(std::abs(read_mm - wall_mm) <= compare::kGross_mm)) continue;
    at.push_back(1e-3 * wall_mm), of.push_back(d_mm);
  }
  if (difference.empty()) at.push_back(1e-3 * one.range_a_mm), of.push_back(one.difference_mm);
  rows.add(one.record.number, at, of);
}

/// Captures of the distance block for a fit of waves. What wraps in part is told as wraps, and left out.
Captures unwrapped(const Captures& captures, const std::string& whose,
                   const std::function<bool(const ComparedCapture&)>& is_wrapped, TraitCollector& all) {
  Captures chosen;
  std::set<std::string> names;
  for (const ComparedCapture* one : captures) {
    if (!is_wrapped(*one))
      chosen.push_back(one);
    else
      names.insert(one->record.name);
  }
  if (names.empty()) return chosen;
  all.untold(fmt::format(
      "harmonics of {} at {}: {} of {} captures are left out, in which over 1 % of the wall is off by a "
      "whole period (see wraps)",
      whose, fmt::join(names, "; "), captures.size() - chosen.size(), captures.size()));
  return chosen;
}

void addHarmonicsOfDifference(const ComparedRun& run, const Captures& captures, TraitCollector& all) {
  const auto& [of_a, of_b] = run.frequency_hz;
  if (of_a.empty() || !areTheSame(of_a, of_b)) {
    all.untold(fmt::format("harmonics of B − A: A is modulated at {}, B at {}; their waves are told apart only where "
                           "both have the same frequencies",
                           wordsOf(of_a), wordsOf(of_b)));
    return;
  }
  OverDistance rows;
  const auto eitherWraps = [](const ComparedCapture& one) {
    return std::ranges::any_of(one.seen, isWrapped);
  };
  const Captures used = unwrapped(captures, "B − A", eitherWraps, all);
  for (const ComparedCapture* one : used) addDifference(*one, rows);
  const auto without = std::ranges::count_if(used, [](const auto* one) { return one->wall_range_m.empty(); });
  if (without > 0) {
    all.untold(
        fmt::format("how far the wall was at {} of {} captures (harmonics of B − A): no pose is known; they "
                    "are over the mean of "
                    "what A and B read, each weighted by 1/σ² of its noise",
                    without, used.size()));
  }
  all.add("harmonics", "B − A", compare::fittedHarmonics(rows.distance_m, rows.error_mm, of_a, rows.capture));
}

void addHarmonics(const ComparedRun& run, TraitCollector& all) {
  const Captures captures = capturesOf(run, "distance");
  if (captures.empty()) return;
  addHarmonicsOfDifference(run, captures, all);
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    OverDistance rows;
    const auto wraps = [camera](const ComparedCapture& one) { return isWrapped(one.seen[camera]); };
    for (const ComparedCapture* one : unwrapped(captures, kCameras[camera], wraps, all))
      rows.add(one->record.number, one->seen[camera].wall_range_m, one->seen[camera].wall_error_mm);
    if (rows.distance_m.empty()) continue;  // no wall, a pose by planes, or all wrapped: said elsewhere
    if (run.frequency_hz[camera].empty()) {
      all.untold(fmt::format("harmonics of {}: its frames say no modulation frequency", kCameras[camera]));
      continue;
    }
    const auto fitted =
        compare::fittedHarmonics(rows.distance_m, rows.error_mm, run.frequency_hz[camera], rows.capture);
    all.add({kHarmonicsOfWall, kCameras[camera], rows.distance_m, rows.error_mm, rows.condition}, fitted);
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
      "errors against the plan's walls at {} captures (harmonics, error over amplitude, corners and lens scatter of "
      "A and of B by themselves): their pose was fitted to A's own ranges of these planes, which takes "
      "up A's errors",
      hidden));
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
  std::map<std::pair<std::string, std::size_t>, std::size_t> conditions;
  std::vector<double> a, b, both;
  std::vector<std::size_t> condition;
  compare::Running pixels;  // of one image
  for (const ComparedCapture& one : run.captures) {
    const ValidShares shares{one.thinned};
    if (one.record.kind == nameOf(Kind::Dark) || !(shares.a + shares.b > 0.0)) continue;
    a.push_back(shares.a), b.push_back(shares.b), both.push_back(shares.both), pixels.add(shares.pixels);
    condition.push_back(
        conditions.try_emplace({one.record.block, one.record.condition}, conditions.size()).first->second);
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
  addAmplitudeAndAmbient(run, all);
  addMasks(run, all);
  addValidPixels(run, all);
  addNoiseTraits(run, all);
  addFrameTraits(run, all);
  sayWhatPlanesHide(run, all);
  sayWhatIsMissing(run, all);
  return std::move(all).found();
}

std::vector<std::string> feedsOf(std::string_view kind) {
  std::vector<std::string> told;
  for (const Feeds& one : kFeeds) {
    if (one.kind == kind) told.emplace_back(one.what);
  }
  return told;
}

}  // namespace toftwin::plan
