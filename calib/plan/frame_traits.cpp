// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/frame_traits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/clusters.h"
#include "calib/compare/traits/least_squares.h"
#include "calib/compare/traits/veil.h"

namespace toftwin::plan {
namespace {

using compare::TraitCollector;
constexpr const char* kLagOfFirst = "lag of the first frame recorded";
constexpr const char* kRangeLag = "range left behind";
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Captures ofKind(const ComparedRun& run, std::string_view kind) {
  Captures chosen;
  for (const ComparedCapture& one : run.captures) {
    if (one.record.kind == kind) chosen.push_back(&one);
  }
  for (const ComparedCapture& one : run.moving) {
    if (one.record.kind == kind) chosen.push_back(&one);
  }
  return chosen;
}

void append(std::vector<double>& to, const std::vector<double>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

/// A value of the cells of a camera's own wall at several distances, by their range. Cells where it is not
/// finite are left out.
class OverRange {
 public:
  OverRange(const Captures& walls, std::size_t camera,
            const std::function<double(const CameraSeen&, std::size_t)>& value_of) {
    std::map<long, compare::Running> bins;
    for (const ComparedCapture* one : walls) {
      const CameraSeen& seen = one->seen[camera];
      for (std::size_t i = 0; i < seen.wall_range_m.size(); ++i) {
        if (const double value = value_of(seen, i); std::isfinite(value))
          bins[std::lround(seen.wall_range_m[i] / kBin_m)].add(value);
      }
    }
    for (const auto& [bin, values] : bins)
      range_m_.push_back(kBin_m * static_cast<double>(bin)), mean_.push_back(values.mean());
  }
  /// Linear between bins; the nearest one's at most three bins beyond; NaN farther away.
  [[nodiscard]] double at(double range_m) const {
    const auto after = std::ranges::lower_bound(range_m_, range_m);
    const auto i = static_cast<std::size_t>(after - range_m_.begin());
    const auto isNear = [&](std::size_t k) { return std::abs(range_m_[k] - range_m) <= 3.0 * kBin_m; };
    const bool has_low = i > 0 && isNear(i - 1), has_high = i < range_m_.size() && isNear(i);
    if (has_low && has_high) {
      const double share = (range_m - range_m_[i - 1]) / (range_m_[i] - range_m_[i - 1]);
      return mean_[i - 1] + share * (mean_[i] - mean_[i - 1]);
    }
    return has_low ? mean_[i - 1] : has_high ? mean_[i] : kNaN;
  }
  [[nodiscard]] bool isKnown() const { return range_m_.size() > 1; }

 private:
  static constexpr double kBin_m = 0.025;
  std::vector<double> range_m_, mean_;
};

/// What a camera is off by at a range: corners and plates are judged beside it.
OverRange ownErrorOf(const Captures& walls, std::size_t camera) {
  return {walls, camera, [](const CameraSeen& seen, std::size_t i) { return seen.wall_error_mm[i]; }};
}

void addTiming(const ComparedRun& run, std::size_t camera, TraitCollector& all) {
  std::vector<std::vector<double>> series;
  for (const auto* captures : {&run.captures, &run.moving}) {
    for (const ComparedCapture& one : *captures) series.push_back(one.seen[camera].starts_s);
  }
  all.add("frame timing", kCameras[camera], compare::timingTraits(series));
}

/// Pixels of a capture wrap together: each capture is a row.
void addWraps(const Captures& walls, std::size_t camera, TraitCollector& all) {
  std::vector<double> shares;
  for (const ComparedCapture* one : walls) {
    const CameraSeen& seen = one->seen[camera];
    if (seen.wall_readings > 0.0) shares.push_back(seen.wall_wraps / seen.wall_readings);
  }
  all.add("wraps", kCameras[camera], compare::wrapTraits(shares));
}

/// A corner's errors in steps of the distance to its edge, each of one capture.
struct Steps {
  std::vector<double> place_m{}, error_mm{};
  std::vector<std::size_t> capture{};
};

/// Of all captures together: place and error of each step.
std::pair<std::vector<double>, std::vector<double>> meansOf(const Steps& steps) {
  std::map<double, compare::Running> all;
  for (std::size_t i = 0; i < steps.place_m.size(); ++i) all[steps.place_m[i]].add(steps.error_mm[i]);
  std::pair<std::vector<double>, std::vector<double>> means;
  for (const auto& [place, errors] : all) means.first.push_back(place), means.second.push_back(errors.mean());
  return means;
}

/// Means over bands of the distance to the edge: steps of one capture err alike, so a row is a capture's
/// mean.
void addBands(const std::string& name, const Steps& steps, std::size_t camera, TraitCollector& all) {
  constexpr std::array<std::pair<double, double>, 3> kBands{{{0.0, 0.1}, {0.1, 0.3}, {0.3, 0.9}}};
  std::vector<compare::Trait> traits;
  for (const auto& [from, to] : kBands) {
    std::vector<double> within;
    std::vector<std::size_t> captures;
    for (std::size_t i = 0; i < steps.place_m.size(); ++i) {
      if (steps.place_m[i] >= from && steps.place_m[i] < to)
        within.push_back(steps.error_mm[i]), captures.push_back(steps.capture[i]);
    }
    if (!within.empty())
      traits.push_back(compare::meanTrait(fmt::format("{:g} to {:g} m from the edge", from, to), "mm",
                                          compare::clusterMeans(within, captures)));
  }
  if (traits.empty()) {
    all.untold(fmt::format("{} of {}: no wall is seen where the plan puts it (within 300 mm)", name,
                           kCameras[camera]));
    return;
  }
  all.add(name, kCameras[camera], traits);
}

/// Distances to the edge in steps of 2.5 cm: pixels of one step are not independent rows.
void addCorners(const ComparedRun& run, const OverRange& own, std::size_t camera, TraitCollector& all) {
  constexpr double kStep_m = 0.025;
  std::map<std::string, Steps> blocks;
  for (const ComparedCapture* one : ofKind(run, "corner")) {
    if (isPoseFromPlanes(one->record)) continue;
    const CameraSeen& seen = one->seen[camera];
    std::map<long, compare::Running> steps;
    for (std::size_t i = 0; i < seen.corner_place_m.size(); ++i) {
      const double usual = own.isKnown() ? own.at(seen.corner_range_m[i]) : 0.0;
      if (std::isfinite(usual))
        steps[std::lround(seen.corner_place_m[i] / kStep_m)].add(seen.corner_error_mm[i] - usual);
    }
    for (const auto& [step, errors] : steps) {
      if (errors.n() < 4) continue;
      Steps& of = blocks[one->record.block];
      of.place_m.push_back(kStep_m * static_cast<double>(step)), of.error_mm.push_back(errors.mean());
      of.capture.push_back(one->record.number);
    }
  }
  for (const auto& [name, steps] : blocks) {
    addBands(name, steps, camera, all);
    // The fall from the edge as one exponential, where it is one: at the very edge both ways are equally
    // long. Of each step over all captures.
    const auto [place, error] = meansOf(steps);
    if (const auto fall = compare::cornerTraits(place, error)) all.add(name, kCameras[camera], fall);
  }
}

/// All captures below each other, a row of nothing between them: what looks along rows takes them for one
/// image.
Image<float> belowEachOther(const Captures& captures, std::size_t camera) {
  int width = 1, height = 0;
  for (const ComparedCapture* one : captures) {
    const Image<float>& image = one->seen[camera].over_split;
    width = std::max(width, image.width()), height += image.height() + 1;
  }
  Image<float> together(width, std::max(1, height), std::numeric_limits<float>::quiet_NaN());
  int top = 0;
  for (const ComparedCapture* one : captures) {
    const Image<float>& image = one->seen[camera].over_split;
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) together(x, top + y) = image(x, y);
    }
    top += image.height() + 1;
  }
  return together;
}

/// A wall by itself: what a camera is off by at a range, and by how much a veil of 1 would move it there.
/// Both of the same cells: where one is not known, as that of a cell without an amplitude, the other does not
/// count.
class WallAlone {
 public:
  WallAlone(const Captures& walls, std::size_t camera, std::size_t frequencies)
      : error_{walls, camera, [](const CameraSeen& seen, std::size_t i) {
                 return isWhole(seen, i) ? seen.wall_error_mm[i] : kNaN;
               }} {
    for (std::size_t f = 0; f < frequencies; ++f) {
      veil_.emplace_back(walls, camera, [f](const CameraSeen& seen, std::size_t i) {
        return isWhole(seen, i) ? seen.wall_veil_mm[f][i] : kNaN;
      });
    }
  }
  /// NaN at ranges at which no wall was seen; 0 where none was seen at all.
  [[nodiscard]] double error_mm(double range_m) const { return error_.isKnown() ? error_.at(range_m) : 0.0; }
  [[nodiscard]] double veil_mm(std::size_t f, double range_m) const {
    return error_.isKnown() ? veil_[f].at(range_m) : 0.0;
  }

 private:
  static bool isWhole(const CameraSeen& seen, std::size_t i) {
    return std::isfinite(seen.wall_error_mm[i]) &&
           std::ranges::all_of(seen.wall_veil_mm, [i](const auto& of) { return std::isfinite(of[i]); });
  }
  OverRange error_;
  std::vector<OverRange> veil_{};
};

/// Errors of the wall beside the plate and what a veil would do to them, both less what they are at the same
/// range before the wall alone: what goes with the range is the camera's own error, and the wall's light
/// veils it, too.
void addScatter(const Captures& plates, const Captures& walls, const std::vector<double>& frequency_hz,
                std::size_t camera, TraitCollector& all) {
  const WallAlone alone{walls, camera, frequency_hz.size()};
  std::vector<double> error_mm;
  std::vector<std::vector<double>> veil_mm(frequency_hz.size());
  std::vector<std::size_t> capture;
  for (const ComparedCapture* one : plates) {
    const CameraSeen& seen = one->seen[camera];
    for (std::size_t i = 0; i < seen.wall_range_m.size(); ++i) {
      const double range_m = seen.wall_range_m[i];
      error_mm.push_back(seen.wall_error_mm[i] - alone.error_mm(range_m));
      for (std::size_t f = 0; f < veil_mm.size(); ++f)
        veil_mm[f].push_back(seen.wall_veil_mm[f][i] - alone.veil_mm(f, range_m));
      capture.push_back(one->record.number);
    }
  }
  all.add("lens scatter", kCameras[camera], compare::veilTraits(veil_mm, error_mm, frequency_hz, capture));
}

void addPlates(const ComparedRun& run, std::size_t camera, TraitCollector& all) {
  const Captures captures = ofKind(run, "foreground");
  if (captures.empty()) return;
  std::vector<double> place, value;
  for (const ComparedCapture* one : captures) {
    const CameraSeen& seen = one->seen[camera];
    append(place, seen.edge_place_px), append(value, seen.edge_value);
  }
  const Image<float> together = belowEachOther(captures, camera);
  all.add("flying pixels", kCameras[camera], compare::flyingTraits(together));
  all.add("emitter shadow", kCameras[camera], compare::shadowTraits(together, 1.0));
  all.add("edge in the amplitude", kCameras[camera], compare::edgeTraits(place, value));
}

/// Before a dark wall a plate's light is far more beside the wall's own; a bright wall is the next best.
Captures platesForScatter(const ComparedRun& run) {
  Captures plates = ofKind(run, "scatter");
  if (plates.empty()) plates = ofKind(run, "foreground");
  std::erase_if(plates, [](const auto* one) { return isPoseFromPlanes(one->record); });
  return plates;
}

/// The first frame after each turn from bright to dark or back, against the frames that follow.
void addLag(const ComparedRun& run, std::size_t camera, TraitCollector& all) {
  const Captures captures = ofKind(run, "bright_dark");
  if (captures.empty()) return;
  std::vector<double> first, rest, before;
  double previous = kNaN;
  for (const ComparedCapture* one : captures) {
    const auto& values = one->seen[camera].brightness;
    if (values.size() < 3) continue;
    compare::Running later;
    for (std::size_t i = 2; i < values.size(); ++i) later.add(values[i]);
    first.push_back(values.front()), rest.push_back(later.mean()), before.push_back(previous);
    previous = later.mean();
  }
  all.add(kLagOfFirst, kCameras[camera], compare::afterImageTraits(first, rest, before));
}

/// The same of the range, where the camera was moved: of a filter over frames in the range itself, which
/// leaves amplitudes as they are. Captures of one block follow each other in one scene.
void addRangeLag(const ComparedRun& run, std::size_t camera, TraitCollector& all) {
  std::vector<double> first, rest, before;
  const ComparedCapture* previous = nullptr;
  double there = kNaN;
  for (const ComparedCapture& one : run.captures) {
    const auto& values = one.seen[camera].middle_range_m;
    const bool follows = previous != nullptr && previous->record.block == one.record.block &&
                         previous->record.number + 1 == one.record.number;
    const double then = std::exchange(there, kNaN);
    previous = &one;
    if (values.size() < 3) continue;
    compare::Running later;
    for (std::size_t i = 2; i < values.size(); ++i) later.add(values[i]);
    there = later.mean();
    if (!follows || !(std::abs(then - there) > 0.1 * there)) continue;
    first.push_back(values.front()), rest.push_back(there), before.push_back(then);
  }
  if (first.size() < 2) {
    all.untold(
        fmt::format("{} of {}: {}: it takes two captures of a block by which the range in the image's "
                    "middle changes by a tenth, and three frames of each",
                    kLagOfFirst, kCameras[camera], kRangeLag));
    return;
  }
  all.add(kLagOfFirst, kCameras[camera], compare::afterImageTraits(first, rest, before, kRangeLag));
}

/// A plate's path: its middle over time; speeds are differences of two frames, each of which is in one of
/// them.
void addMotion(const ComparedRun& run, std::size_t camera, TraitCollector& all) {
  const Captures captures = ofKind(run, "moving");
  std::vector<double> speed, turn;
  for (const ComparedCapture* one : captures) {
    const CameraSeen& seen = one->seen[camera];
    for (std::size_t i = 1; i < seen.plate_time_s.size(); i += 2) {
      const double passed = seen.plate_time_s[i] - seen.plate_time_s[i - 1];
      if (!(passed > 0.0)) continue;
      speed.push_back((seen.plate_place_m[i] - seen.plate_place_m[i - 1]) / passed);
      turn.push_back(0.5 * (seen.plate_turn_mm[i] + seen.plate_turn_mm[i - 1]));
    }
  }
  if (captures.empty()) return;
  if (speed.empty()) {
    all.untold(fmt::format("motion of {}: in none of {} captures do two frames with a time of their own show the plate whole",
                           kCameras[camera], captures.size()));
    return;
  }
  all.add("motion, right end − left end", kCameras[camera], compare::motionTraits(speed, turn));
}

/// Independent values by their intervals: weights 1/h². A's places, which stand for the path, err as B's do:
/// √2. Where the parts scatter more than that, they err by more than each knows: by Student over the parts
/// (R. T. Birge, Phys. Rev. 40 (1932) 207).
compare::Trait together(const std::vector<compare::Trait>& parts) {
  double weights = 0.0, sum = 0.0;
  compare::Trait all{.name = parts.front().name, .unit = parts.front().unit};
  const auto halfOf = [](const compare::Trait& one) { return std::max(1e-9, 0.5 * (one.high - one.low)); };
  for (const compare::Trait& one : parts) {
    const double weight = 1.0 / (halfOf(one) * halfOf(one));
    weights += weight, sum += weight * one.value, all.n += one.n;
  }
  all.value = sum / weights;
  double half = std::sqrt(2.0 / weights), squares = 0.0;
  for (const compare::Trait& one : parts) squares += std::pow((one.value - all.value) / halfOf(one), 2);
  if (parts.size() > 1) {
    const double degrees = static_cast<double>(parts.size() - 1);
    half = std::max(half, compare::studentT(degrees) * std::sqrt(squares / degrees / weights));
  }
  all.low = all.value - half, all.high = all.value + half;
  return all;
}

/// The plate as a camera sees it, over all captures. Its speed is of three frames in a row:
///   v² = Σ (d₁² + d₂² + 4 d₁d₂) / Σ (t₁² + t₂² + 4 t₁t₂)
/// The middle one's error is in both steps with other signs, so that errors σ of the places, 2σ² of each
/// square and −σ² of the product, cancel on the mean. Squares alone would rise with them.
struct PlateSeen {
  compare::Running width_m{};
  double pixel_m = 0.0;
  double speed_m_per_s = 0.0;  ///< root mean square; 0 where its places' errors hide it

  PlateSeen(const Captures& captures, std::size_t camera) {
    double path = 0.0, time = 0.0;
    for (const ComparedCapture* one : captures) {
      const CameraSeen& seen = one->seen[camera];
      pixel_m = std::max(pixel_m, seen.plate_pixel_m);
      for (const double width : seen.plate_width_m) width_m.add(width);
      for (std::size_t i = 2; i < seen.plate_time_s.size(); ++i) {
        const double t1 = seen.plate_time_s[i - 1] - seen.plate_time_s[i - 2],
                     t2 = seen.plate_time_s[i] - seen.plate_time_s[i - 1];
        if (!(t1 > 0.0 && t2 > 0.0) || std::max(t1, t2) > 2.0 * std::min(t1, t2)) continue;  // it was away
        const double d1 = seen.plate_place_m[i - 1] - seen.plate_place_m[i - 2],
                     d2 = seen.plate_place_m[i] - seen.plate_place_m[i - 1];
        path += d1 * d1 + d2 * d2 + 4.0 * d1 * d2, time += t1 * t1 + t2 * t2 + 4.0 * t1 * t2;
      }
    }
    if (path > 0.0) speed_m_per_s = std::sqrt(path / time);
  }
};

/// What one camera sees less of the plate may lie at one of its ends: by half of it its middle is elsewhere.
/// A least-squares delay is then off by that over the root mean square of the speed at most (Cauchy,
/// Schwarz). Over two pixels the cameras see different plates.
void heedWidths(const PlateSeen& a, const PlateSeen& b, compare::Trait& latency) {
  const double less_m = std::abs(a.width_m.mean() - b.width_m.mean());
  if (less_m > 2.0 * std::max(a.pixel_m, b.pixel_m)) {
    latency.doubt = fmt::format(
        "the plate is {:.0f} mm wide in A's frames and {:.0f} mm in B's, so that where its middle is "
        "hangs on what each sees of it",
        1e3 * a.width_m.mean(), 1e3 * b.width_m.mean());
  }
  if (!(less_m > 0.0)) return;
  const double speed = std::min(a.speed_m_per_s, b.speed_m_per_s);
  if (!(speed > 0.0)) {
    if (latency.doubt.empty())
      latency.doubt = "the plate's places err by more than it moves from frame to frame";
    return;
  }
  const double late_ms = 1e3 * 0.5 * less_m / speed;
  latency.low -= late_ms, latency.high += late_ms;
}

/// How much later B sees the plate where A saw it, where both say the scene's own time: of simulated cameras.
void addLatency(const ComparedRun& run, TraitCollector& all) {
  std::vector<compare::Trait> rows;
  std::string why_not;
  const Captures captures = ofKind(run, "moving");
  bool is_shared = !captures.empty();
  for (const ComparedCapture* one : captures) {
    const CameraSeen &a = one->seen[0], &b = one->seen[1];
    is_shared = is_shared && a.is_simulated && b.is_simulated;
    const auto traits =
        compare::latencyTraits(b.plate_time_s, b.plate_place_m, a.plate_time_s, a.plate_place_m);
    if (traits)
      rows.push_back(traits->front());
    else
      why_not = traits.error().message;
  }
  if (captures.empty()) return;
  if (!is_shared) {
    all.untold(
        "latency: the two cameras are captured one after the other, and where a real plate was meanwhile nobody "
        "recorded. It is told of two simulated cameras, whose frames say the time at which the scene was so");
  } else if (rows.empty()) {
    all.untold(fmt::format("{} ({} captures of the moving plate, of which none tells it)", why_not,
                           captures.size()));
  } else {
    compare::Trait latency = together(rows);
    heedWidths({captures, 0}, {captures, 1}, latency);
    all.add("latency", "B − A", std::vector{std::move(latency)});
  }
}

}  // namespace

void addFrameTraits(const ComparedRun& run, TraitCollector& all) {
  Captures walls = ofKind(run, "distance");
  if (walls.empty()) walls = ofKind(run, "warm_up");
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    addTiming(run, camera, all);
    if (!walls.empty()) addWraps(walls, camera, all);
    addCorners(run, ownErrorOf(walls, camera), camera, all);
    addPlates(run, camera, all);
    if (const Captures plates = platesForScatter(run); !plates.empty())
      addScatter(plates, walls, run.frequency_hz[camera], camera, all);
    addLag(run, camera, all);
    addRangeLag(run, camera, all);
    addMotion(run, camera, all);
  }
  addLatency(run, all);
}

}  // namespace toftwin::plan
