// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/harmonic_traits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/compare/characteristics.h"
#include "calib/compare/gross.h"
#include "calib/plan/range_steps.h"

namespace toftwin::plan {
namespace {

using compare::TraitCollector;
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

/// The condition in all of whose captures an error is the same: where the pose was seen, and of two simulated cameras,
/// whose traced light has the same grain each time.
std::optional<CaptureRecord::Condition> sharedBy(const ComparedCapture& one) {
  const bool is_grain = one.seen[0].is_simulated && one.seen[1].is_simulated;
  return is_grain ? one.record.conditionInRun() : sharedPoseOf(one.record);
}

/// The first of the captures that share this one's error. Others have their own.
std::size_t clusterOf(const Captures& captures, const CaptureRecord& record) {
  const auto isIt = [&](const auto* one) { return one->record.number == record.number; };
  const auto own = std::ranges::find_if(captures, isIt);
  const auto condition = own == captures.end() ? std::nullopt : sharedBy(**own);
  if (!condition) return record.number;
  const auto first = std::ranges::find(captures, condition, [](const auto* one) { return sharedBy(*one); });
  return (*first)->record.number;
}

/// Errors over distance: steps of a wall's range, in clusters of captures that share an error.
class OverDistance {
 public:
  explicit OverDistance(const Captures& captures) : captures_(captures) {}

  void add(const CaptureRecord& record, const RangeSteps& steps, double pose_error_mm) {
    Cluster& cluster = clusters_[clusterOf(captures_, record)];
    cluster.steps.add(steps);
    cluster.shared_mm = std::max(cluster.shared_mm, pose_error_mm);
    are_seen_ = are_seen_ || record.pose_half_widths.has_value();
  }
  [[nodiscard]] bool isEmpty() const { return clusters_.empty(); }
  [[nodiscard]] Result<compare::FittedTraits> fitted(std::span<const double> frequency_hz,
                                                     std::size_t least_orders = 0) const {
    const Rows all = rows();
    return compare::fittedHarmonics(all.distance_m, all.error_mm, frequency_hz,
                                    {.of = all.cluster,
                                     .pixels = all.pixels,
                                     .shared_mm = all.shared_mm,
                                     .are_turned = are_seen_,
                                     .what = are_seen_ ? "poses that were seen" : "captures"},
                                    least_orders);
  }
  /// For a plot. Rows of the same cluster and step are of the same condition.
  [[nodiscard]] compare::NamedRows drawn(const char* what, const char* of) const {
    Rows all = rows();
    return {what, of, std::move(all.distance_m), std::move(all.error_mm), std::move(all.condition)};
  }

 private:
  struct Cluster {
    RangeSteps steps{};
    double shared_mm = 0.0;
  };
  struct Rows {
    std::vector<double> distance_m{}, error_mm{}, pixels{}, shared_mm{};
    std::vector<std::size_t> cluster{}, condition{};
  };
  static constexpr std::size_t kMostSteps = 1'000'000;  ///< 25 km of them
  static constexpr double kFewest = 0.01;  ///< of all pixels: fewer are beside the wall, or wrapped

  [[nodiscard]] Rows rows() const {
    Rows all;
    for (const auto& [number, cluster] : clusters_) {
      for (const auto& [step, sums] : cluster.steps.steps()) {
        if (sums.pixels < kFewest * cluster.steps.pixels()) continue;
        all.distance_m.push_back(sums.range_m / sums.pixels);
        all.error_mm.push_back(sums.error_mm / sums.pixels);
        all.pixels.push_back(sums.pixels), all.shared_mm.push_back(cluster.shared_mm);
        all.cluster.push_back(number);
        all.condition.push_back(kMostSteps * number + static_cast<std::size_t>(step));
      }
    }
    return all;
  }

  const Captures& captures_;
  std::map<std::size_t, Cluster> clusters_{};
  bool are_seen_ = false;
};

/// B − A of a capture's compared pixels over the range to the plan's wall, of those that see it; where no
/// pose tells that, over what both cameras read.
RangeSteps differenceSteps(const ComparedCapture& one) {
  const Image<float> difference = compare::comparedDifference_mm(one.thinned);
  const double of_b = 1.0 - compare::weightOfA(one.noise_a_mm, one.noise_b_mm);
  RangeSteps steps;
  for (std::size_t i = 0; i < difference.size(); ++i) {
    const auto d_mm = static_cast<double>(difference[i]);
    const double read_mm = static_cast<double>(one.thinned.range_a_mm[i]) + of_b * d_mm;
    const double wall_mm =
        one.wall_range_m.empty() ? read_mm : 1e3 * static_cast<double>(one.wall_range_m[i]);
    // About 0 even where noise is large: that of read_mm does not go with that of d_mm, which the cut leaves
    // as it is.
    if (std::abs(read_mm - wall_mm) <= compare::kGross_mm) steps.add(1e-3 * wall_mm, d_mm);
  }
  if (difference.empty()) steps.add(1e-3 * one.range_a_mm, one.difference_mm);
  return steps;
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
  OverDistance rows{captures};
  const auto eitherWraps = [](const ComparedCapture& one) {
    return std::ranges::any_of(one.seen, isWrapped);
  };
  const Captures used = unwrapped(captures, "B − A", eitherWraps, all);
  for (const ComparedCapture* one : used)
    rows.add(one->record, differenceSteps(*one), std::hypot(one->pose_error_mm[0], one->pose_error_mm[1]));
  const auto without = std::ranges::count_if(used, [](const auto* one) { return one->wall_range_m.empty(); });
  if (without > 0) {
    all.untold(
        fmt::format("how far the wall was at {} of {} captures (harmonics of B − A): no pose is known; they "
                    "are over the mean of "
                    "what A and B read, each weighted by 1/σ² of its noise",
                    without, used.size()));
  }
  const auto fitted = rows.fitted(of_a);
  all.add("harmonics", "B − A", fitted);
  // Whichever waves they are, that there are any is certain.
  if (fitted && fitted->together) all.add("harmonics", "B − A", std::vector{*fitted->together});
}

/// What each camera errs by over the range to the plan's wall.
void addHarmonicsOfWall(const ComparedRun& run, const Captures& captures, TraitCollector& all) {
  std::array<OverDistance, 2> rows{OverDistance{captures}, OverDistance{captures}};
  std::array<compare::HarmonicFit, 2> fits;
  std::array<bool, 2> are_told{};
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    const auto wraps = [camera](const ComparedCapture& one) { return isWrapped(one.seen[camera]); };
    for (const ComparedCapture* one : unwrapped(captures, kCameras[camera], wraps, all)) {
      const RangeSteps& steps = one->seen[camera].wall_steps;
      if (steps.pixels() > 0.0) rows[camera].add(one->record, steps, one->pose_error_mm[camera]);
    }
    if (rows[camera].isEmpty()) continue;  // no wall, a pose by planes, or all wrapped: said elsewhere
    are_told[camera] = !run.frequency_hz[camera].empty();
    if (!are_told[camera])
      all.untold(fmt::format("harmonics of {}: its frames say no modulation frequency", kCameras[camera]));
    fits[camera] = [&of = rows[camera], &f = run.frequency_hz[camera]](std::size_t least) {
      return of.fitted(f, least);
    };
  }
  const auto add = [&](std::size_t camera, const Result<compare::FittedTraits>& fitted) {
    all.add(rows[camera].drawn(kHarmonicsOfWall, kCameras[camera]), fitted);
  };
  if (are_told[0] && are_told[1] && areTheSame(run.frequency_hz[0], run.frequency_hz[1])) {
    const auto [of_a, of_b] = compare::withTheSameWaves(fits);
    add(0, of_a), add(1, of_b);
    return;
  }
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    if (are_told[camera]) add(camera, fits[camera](0));
  }
}

}  // namespace

void addHarmonics(const ComparedRun& run, TraitCollector& all) {
  const Captures captures = capturesOf(run, nameOf(Kind::Distance));
  if (captures.empty()) return;
  addHarmonicsOfDifference(run, captures, all);
  addHarmonicsOfWall(run, captures, all);
}

}  // namespace toftwin::plan
