// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/run_traits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include <fmt/format.h>

#include "calib/compare/live_report.h"
#include "calib/compare/statistics.h"
#include "calib/plan/frame_traits.h"

namespace toftwin::plan {
namespace {

using compare::Trait;
using Captures = std::vector<const ComparedCapture*>;

/// Rows for each parameter of a fit; fewer tell little more than themselves.
constexpr std::size_t kRowsPerParameter = 3;

/// Which kind of block tells what; docs/characteristics.md has the same.
struct Feeds {
  const char* kind;
  const char* what;
};
constexpr std::array kFeeds{Feeds{"warm_up", "drift"},
                            Feeds{"distance", "harmonics"},
                            Feeds{"distance", "wraps"},
                            Feeds{"distance", "noise of frames"},
                            Feeds{"exposure", "error over amplitude"},
                            Feeds{"ambient", "ambient light"},
                            Feeds{"bright_dark", "lag"},
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

const char* nameOf(compare::DriftModel model) {
  switch (model) {
    case compare::DriftModel::Constant:
      return "none";
    case compare::DriftModel::Ramp:
      return "ramp";
    case compare::DriftModel::OneExponential:
      return "one exponential";
    case compare::DriftModel::TwoExponentials:
      return "two exponentials";
    case compare::DriftModel::Step:
      return "step";
  }
  return "";
}

void addDrift(const ComparedRun& run, TraitCollector& all) {
  const Captures captures = capturesOf(run, "warm_up");
  if (captures.empty()) return;
  for (const Side& side : kSides) {
    const auto drift =
        compare::driftTraits(column(captures, side.since_power_on_s), column(captures, side.range_mm));
    if (drift) {
      all.add("drift", side.name, drift->traits, nameOf(drift->model));
    } else {
      all.add("drift", side.name, drift.error());
    }
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

/// As many of four, three, two and one wave per period as the rows allow: cameras of four and three steps
/// have the first of these.
void addWaves(const std::string& what, const char* of, const std::vector<double>& distance_m,
              const std::vector<double>& error_mm, const std::vector<double>& frequency_hz, TraitCollector& all) {
  std::vector<int> orders;
  for (const int order : {4, 3, 2, 1}) {
    const std::size_t parameters = 2 + 2 * frequency_hz.size() * (orders.size() + 1);
    if (distance_m.size() >= kRowsPerParameter * parameters) orders.push_back(order);
  }
  if (!orders.empty()) {
    all.add(what, of, compare::harmonicTraits(distance_m, error_mm, frequency_hz, orders));
    return;
  }
  all.untold(fmt::format("{} of {}: {} captures over distance for {} frequencies; {} are needed", what, of,
                         distance_m.size(), frequency_hz.size(),
                         kRowsPerParameter * (2 + 2 * frequency_hz.size())));
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
    const auto distance = column(captures, [](const auto& one) { return one.range_a_mm / 1000.0; });
    addWaves("harmonics", "B − A", distance, differencesOf(captures), of_a, all);
  }
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    const auto at = column(captures, [&](const auto& one) { return meanOf(one.seen[camera].wall_range_m); });
    const auto error = column(captures, [&](const auto& one) { return meanOf(one.seen[camera].wall_error_mm); });
    if (run.frequency_hz[camera].empty() || std::ranges::none_of(error, [](double e) { return std::isfinite(e); }))
      continue;
    addWaves("harmonics, against the plan's wall", kSides[camera].name, at, error, run.frequency_hz[camera], all);
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

void addNoiseLaw(const ComparedRun& run, TraitCollector& all) {
  Captures captures = capturesOf(run, "");
  // Other light makes noise of its own.
  std::erase_if(captures, [](const ComparedCapture* one) { return one->record.ambient_klx > 0.0; });
  for (const Side& side : kSides) {
    const auto amplitude = column(captures, side.amplitude);
    if (std::ranges::none_of(amplitude, [](double a) { return std::isfinite(a); }))
      continue;  // it gives none
    all.add("noise law", side.name, compare::noiseLawTraits(amplitude, column(captures, side.noise_mm)));
  }
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

}  // namespace

RunTraits traitsOf(const ComparedRun& run) {
  TraitCollector all;
  addDrift(run, all);
  addHarmonics(run, all);
  addAmplitudeAndAmbient(run, all);
  addNoiseLaw(run, all);
  addMasks(run, all);
  addFrameTraits(run, all);
  sayWhatPlanesHide(run, all);
  for (const Feeds& one : kFeeds) {
    const auto isIt = [&](const ComparedCapture& capture) { return capture.record.kind == one.kind; };
    if (std::ranges::none_of(run.captures, isIt) && std::ranges::none_of(run.moving, isIt))
      all.untold(fmt::format("{}: the run has no block of kind {}", one.what, one.kind));
  }
  return std::move(all).found();
}

compare::TableBlock traitTable(const RunTraits& traits) {
  compare::TableBlock table{
      "Characteristics, with the intervals that are to hold them with 95 % and, behind a #, the number of rows, frames or "
      "blocks they are from: see docs/characteristics.md",
      {"characteristic", "number", "unit", "A", "B", "B − A, or both"},
      {}};
  std::vector<std::pair<std::string, std::string>> keys;
  for (const auto& [what, detail, of, trait] : traits.traits) {
    const std::pair key{what, trait.name};
    auto row = static_cast<std::size_t>(std::ranges::find(keys, key) - keys.begin());
    if (row == keys.size()) {
      keys.push_back(key);
      table.rows.push_back({what, trait.name, trait.unit, "", "", ""});
    }
    table.rows[row][of == "A" ? 3 : of == "B" ? 4 : 5] =
        fmt::format("{:.4g} ({:.4g} to {:.4g}) #{}{}{}", trait.value, trait.low, trait.high, trait.n,
                    detail.empty() ? "" : ", ", detail);
  }
  return table;
}

std::vector<std::string> feedsOf(std::string_view kind) {
  std::vector<std::string> told;
  for (const Feeds& one : kFeeds) {
    if (one.kind == kind) told.emplace_back(one.what);
  }
  return told;
}

compare::Json toJson(const RunTraits& traits) {
  compare::Json rows = compare::Json::array(), untold = compare::Json::array();
  for (const auto& [what, detail, of, trait] : traits.traits) {
    compare::Json row = compare::Json::object();
    row.set("characteristic", what).set("detail", detail).set("of", of).set("name", trait.name).set("unit", trait.unit);
    row.set("value", trait.value).set("low", trait.low).set("high", trait.high).set("n", trait.n);
    rows.push(std::move(row));
  }
  for (const std::string& text : traits.untold) untold.push(text);
  compare::Json json = compare::Json::object();
  json.set("rows", std::move(rows)).set("untold", std::move(untold));
  return json;
}

}  // namespace toftwin::plan
