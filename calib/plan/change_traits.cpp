// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/change_traits.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/least_squares.h"
#include "protocol/types/counted.h"

namespace toftwin::plan {
namespace {

using compare::TraitCollector;
constexpr const char* kLagOfFirst = "lag of the first frame recorded";
constexpr const char* kRangeLag = "range left behind";

/// The first frame after each turn from bright to dark or back, against the frames that follow.
void addLag(const ComparedRun& run, std::size_t camera, TraitCollector& all) {
  const Captures captures = allCapturesOf(run, "bright_dark");
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
  const Captures captures = allCapturesOf(run, "moving");
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
    const std::string where =
        captures.size() == 1 ? "its one capture no" : fmt::format("none of {} captures do", captures.size());
    all.untold(fmt::format("motion of {}: in {} two frames with a time of their own show the plate whole",
                           kCameras[camera], where));
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

/// Why the two saw nothing of one motion: scenes move by their cameras' own clocks, and one may have run before.
std::string whyNothingShared(const CameraSeen& a, const CameraSeen& b) {
  if (a.plate_time_s.empty() || b.plate_time_s.empty()) return "";
  const auto &at_a = a.plate_time_s, &at_b = b.plate_time_s;
  if (at_a.front() < at_b.back() && at_b.front() < at_a.back()) return "";
  return fmt::format(
      "latency: A shows the plate from {:.4g} to {:.4g} s of its scene's time, B from {:.4g} to {:.4g} s: at no time "
      "that both show. It is told where the daemons of both were started anew",
      at_a.front(), at_a.back(), at_b.front(), at_b.back());
}

}  // namespace

void addChangeTraits(const ComparedRun& run, std::size_t camera, TraitCollector& all) {
  addLag(run, camera, all);
  addRangeLag(run, camera, all);
  addMotion(run, camera, all);
}

void addLatency(const ComparedRun& run, TraitCollector& all) {
  std::vector<compare::Trait> rows;
  std::string why_not;
  const Captures captures = allCapturesOf(run, "moving");
  bool is_shared = !captures.empty();
  for (const ComparedCapture* one : captures) {
    const CameraSeen &a = one->seen[0], &b = one->seen[1];
    is_shared = is_shared && a.is_simulated && b.is_simulated;
    const auto traits =
        compare::latencyTraits(b.plate_time_s, b.plate_place_m, a.plate_time_s, a.plate_place_m);
    if (traits)
      rows.push_back(traits->front());
    else if (std::string apart = whyNothingShared(a, b); !apart.empty())
      why_not = std::move(apart);
    else
      why_not = traits.error().message;
  }
  if (captures.empty()) return;
  if (!is_shared) {
    all.untold(
        "latency: the two cameras are captured one after the other, and where a real plate was meanwhile nobody "
        "recorded. It is told of two simulated cameras, whose frames say the time at which the scene was so");
  } else if (rows.empty()) {
    all.untold(fmt::format("{} ({} of the moving plate, of which none tells it)", why_not,
                           counted(captures.size(), "capture")));
  } else {
    compare::Trait latency = together(rows);
    heedWidths({captures, 0}, {captures, 1}, latency);
    all.add("latency", "B − A", std::vector{std::move(latency)});
  }
}

}  // namespace toftwin::plan
