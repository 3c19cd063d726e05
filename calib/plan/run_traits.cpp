// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/run_traits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/compare/live_report.h"
#include "calib/compare/statistics.h"
#include "calib/plan/frame_traits.h"
#include "calib/plan/noise_traits.h"

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

/// A camera, and how its own numbers are got from a capture.
struct Side {
  const char* name;
  double (*range_mm)(const ComparedCapture&);
  double (*noise_mm)(const ComparedCapture&);
  double (*amplitude)(const ComparedCapture&);
  double (*since_power_on_s)(const ComparedCapture&);
};
constexpr std::array kSides{Side{"A", [](const ComparedCapture& c) { return c.range_a_mm; },
                                 [](const ComparedCapture& c) { return c.noise_a_mm; },
                                 [](const ComparedCapture& c) { return c.amplitude_a; },
                                 [](const ComparedCapture& c) { return c.record.a.since_power_on_s; }},
                            Side{"B", [](const ComparedCapture& c) { return c.range_a_mm + c.difference_mm; },
                                 [](const ComparedCapture& c) { return c.noise_b_mm; },
                                 [](const ComparedCapture& c) { return c.amplitude_b; },
                                 [](const ComparedCapture& c) { return c.record.b.since_power_on_s; }}};

void addDrift(const ComparedRun& run, TraitCollector& all) {
  const Captures captures = capturesOf(run, "warm_up");
  if (captures.empty()) return;
  for (const Side& side : kSides) {
    // Less the first capture's range, on which no number of a drift depends.
    const double first_mm = side.range_mm(*captures.front());
    compare::NamedRows rows{kDrift, side.name, column(captures, side.since_power_on_s),
                            column(captures, [&](const auto& one) { return side.range_mm(one) - first_mm; }),
                            numbersOf(captures)};
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

/// B − A of a capture's compared pixels over A's range.
void addDifference(const ComparedCapture& one, OverDistance& rows) {
  const Image<float> difference = compare::comparedDifference_mm(one.thinned);
  std::vector<double> at, of;
  for (std::size_t i = 0; i < difference.size(); ++i) {
    at.push_back(1e-3 * static_cast<double>(one.thinned.range_a_mm[i]));
    of.push_back(static_cast<double>(difference[i]));
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

void addHarmonics(const ComparedRun& run, TraitCollector& all) {
  const Captures captures = capturesOf(run, "distance");
  if (captures.empty()) return;
  const auto& [of_a, of_b] = run.frequency_hz;
  if (of_a.empty() || !areTheSame(of_a, of_b)) {
    all.untold(fmt::format("harmonics of B − A: A is modulated at {}, B at {}; their waves are told apart only where "
                           "both have the same frequencies",
                           wordsOf(of_a), wordsOf(of_b)));
  } else {
    OverDistance rows;
    const auto eitherWraps = [](const ComparedCapture& one) {
      return std::ranges::any_of(one.seen, isWrapped);
    };
    for (const ComparedCapture* one : unwrapped(captures, "B − A", eitherWraps, all))
      addDifference(*one, rows);
    all.add("harmonics", "B − A",
            compare::fittedHarmonics(rows.distance_m, rows.error_mm, of_a, rows.capture));
  }
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    OverDistance rows;
    const auto wraps = [camera](const ComparedCapture& one) { return isWrapped(one.seen[camera]); };
    for (const ComparedCapture* one : unwrapped(captures, kSides[camera].name, wraps, all))
      rows.add(one->record.number, one->seen[camera].wall_range_m, one->seen[camera].wall_error_mm);
    if (rows.distance_m.empty()) continue;  // no wall, a pose by planes, or all wrapped: said elsewhere
    if (run.frequency_hz[camera].empty()) {
      all.untold(fmt::format("harmonics of {}: its frames say no modulation frequency", kSides[camera].name));
      continue;
    }
    const auto fitted =
        compare::fittedHarmonics(rows.distance_m, rows.error_mm, run.frequency_hz[camera], rows.capture);
    all.add({kHarmonicsOfWall, kSides[camera].name, rows.distance_m, rows.error_mm, rows.condition}, fitted);
  }
}

void addAmplitudeAndAmbient(const ComparedRun& run, TraitCollector& all) {
  if (const Captures captures = capturesOf(run, "exposure"); !captures.empty()) {
    all.add("error over amplitude", "B − A",
            compare::amplitudeTraits(column(captures, kSides[0].amplitude), differencesOf(captures)));
    for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
      const auto error = column(captures, [&](const auto& one) { return meanOf(one.seen[camera].wall_error_mm); });
      if (std::ranges::any_of(error, [](double e) { return std::isfinite(e); }))
        all.add("error over amplitude, against the plan's wall", kSides[camera].name,
                compare::amplitudeTraits(column(captures, kSides[camera].amplitude), error));
    }
  }
  const Captures captures = capturesOf(run, "ambient");
  if (captures.empty()) return;
  const auto light = column(captures, [](const auto& one) { return one.record.ambient_klx; });
  for (const Side& side : kSides) {
    all.add("ambient light", side.name,
            compare::ambientTraits(light, column(captures, side.range_mm), column(captures, side.noise_mm)));
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
