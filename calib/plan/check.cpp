// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/plan/covariates.h"

namespace toftwin::plan {
namespace {

using Columns = std::vector<std::vector<double>>;

/// Captures at a pose: only they have a distance and an angle.
std::vector<std::size_t> posed(const Schedule& schedule) {
  std::vector<std::size_t> which;
  for (const PlannedCapture& one : schedule.captures) {
    if (one.pose) which.push_back(one.number);
  }
  return which;
}

std::vector<std::size_t> ofBlock(const Schedule& schedule, std::size_t block) {
  std::vector<std::size_t> which;
  for (const std::size_t number : posed(schedule)) {
    if (schedule.captures[number].block == block) which.push_back(number);
  }
  return which;
}

/// What of a block goes with time by more than the limit.
struct TimeLike {
  std::string covariate, of_time;
  double r = 0.0;
};

/// Captures of repeats and locked ones are held against others, and no curve is fitted to them.
bool isFitted(Kind kind) { return kind != Kind::Repeats && kind != Kind::Locked && kind != Kind::WarmUp; }

std::vector<TimeLike> timeLike(const Plan& plan, const Schedule& schedule, std::size_t block, double limit) {
  std::vector<TimeLike> found;
  if (!isFitted(plan.blocks[block].kind)) return found;
  const auto all = covariatesOf(plan, schedule, ofBlock(schedule, block));
  for (const Covariate& one : all) {
    if (one.is_time || one.values.empty() || !changes(one)) continue;
    TimeLike worst;
    for (const Covariate& time : all) {
      if (!time.is_time) continue;
      const double r = correlation(time.values, one.values);
      if (std::abs(r) > std::abs(worst.r)) worst = {one.name, time.name, r};
    }
    if (std::abs(worst.r) > limit) found.push_back(worst);
  }
  return found;
}

/// The least change of a block after which it passes, in words that can be typed; empty if none was found.
std::string mendOf(const Plan& plan, std::size_t block, double limit) {
  const auto passes = [&](const Plan& mended) {
    const auto schedule = scheduleOf(mended);
    return schedule && timeLike(mended, *schedule, block, limit).empty();
  };
  Plan mended = plan;
  mended.blocks[block].order = Order::Random;
  if (passes(mended)) return "order = \"random\"";
  for (int repeats = plan.blocks[block].repeats + 1; repeats <= plan.blocks[block].repeats + 9; ++repeats) {
    mended.blocks[block].repeats = repeats;
    if (!passes(mended)) continue;
    const bool was_random = plan.blocks[block].order == Order::Random;
    return fmt::format("repeats = {}{}", repeats, was_random ? "" : " and order = \"random\"");
  }
  return {};
}

void checkBlocks(const Plan& plan, const Schedule& schedule, const Limits& limits,
                 std::vector<Remark>& remarks) {
  for (std::size_t block = 0; block < plan.blocks.size(); ++block) {
    for (const TimeLike& found : timeLike(plan, schedule, block, limits.goes_with_time)) {
      const std::string mend = mendOf(plan, block, limits.goes_with_time);
      remarks.push_back(
          {true,
           fmt::format(
               "block \"{}\": {} goes with {} (r = {:.2f}, at most ±{:.2g}): a drift would look like an "
               "effect of {}",
               plan.blocks[block].name, found.covariate, found.of_time, found.r, limits.goes_with_time,
               found.covariate),
           mend.empty()
               ? fmt::format("give the block more conditions, or more repeats of them in random order")
               : fmt::format("write {} in this block", mend)});
    }
  }
}

/// In a short plan warming up is a straight line over time, and what it bends by is less than any error: one
/// column, not two. At most this much of it, r², may be time itself.
constexpr double kIsTimeItself = 0.95;

/// The columns that change. Time and warming up are not held against each other: the block of kind warm_up
/// tells them apart.
std::vector<std::size_t> columnsFor(const std::vector<Covariate>& all, std::size_t own) {
  constexpr std::size_t kTime = 0, kWarmUp = 1;
  const double r = correlation(all[kTime].values, all[kWarmUp].values);
  std::vector<std::size_t> which;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].values.empty() || !changes(all[i])) continue;
    if (i != own && all[own].is_time && all[i].is_time) continue;
    if (i == kWarmUp && i != own && r * r > kIsTimeItself) continue;
    which.push_back(i);
  }
  return which;
}

double inflationOf(const std::vector<Covariate>& all, std::size_t own) {
  Columns columns;
  std::size_t place = 0;
  for (const std::size_t i : columnsFor(all, own)) {
    if (i == own) place = columns.size();
    columns.push_back(all[i].values);
  }
  return plan::inflationOf(columns)[place];
}

CovariateRow rowOf(const std::vector<Covariate>& all, std::size_t own) {
  const Covariate& one = all[own];
  CovariateRow row{.name = one.name, .unit = one.unit, .inflation = std::numeric_limits<double>::quiet_NaN()};
  if (one.values.empty()) return row;
  std::tie(row.min, row.max) = std::pair{std::ranges::min(one.shown), std::ranges::max(one.shown)};
  std::set<long long> different;
  for (const double value : one.values) different.insert(std::llround(value * 1e6));
  row.values = different.size();
  if (!changes(one)) return row;
  row.with_time = correlation(all[0].values, one.values);
  row.inflation = inflationOf(all, own);
  double most = 0.0;
  for (const std::size_t i : columnsFor(all, own)) {
    const double r = i == own ? 0.0 : correlation(all[i].values, one.values);
    if (std::abs(r) > most) most = std::abs(r), row.closest = all[i].name;
  }
  return row;
}

/// Which blocks change a covariate within themselves, and in which of these another stays as it is.
struct BlocksThatChange {
  std::vector<std::string> all{}, alone{};
};
BlocksThatChange blocksThatChange(const Plan& plan, const Schedule& schedule, const std::string& name,
                                  const std::string& other) {
  BlocksThatChange blocks;
  for (std::size_t block = 0; block < plan.blocks.size(); ++block) {
    const auto covariates = covariatesOf(plan, schedule, ofBlock(schedule, block));
    const auto isChanged = [&](const std::string& which) {
      const auto found = std::ranges::find(covariates, which, &Covariate::name);
      return found != covariates.end() && !found->values.empty() && changes(*found);
    };
    if (!isChanged(name)) continue;
    blocks.all.push_back(fmt::format("\"{}\"", plan.blocks[block].name));
    if (!isChanged(other)) blocks.alone.push_back(blocks.all.back());
  }
  return blocks;
}

std::string mendOf(const Plan& plan, const Schedule& schedule, const CovariateRow& row, bool is_like_time) {
  if (is_like_time) {
    return fmt::format(
        "come back to it: add a block of kind \"repeats\" at the end that captures earlier "
        "conditions again, or take the values of {} in one block in random order instead of one "
        "block after the other",
        row.name);
  }
  const BlocksThatChange blocks = blocksThatChange(plan, schedule, row.name, row.closest);
  if (blocks.alone.size() > 1)
    return fmt::format("let {}, which change {} while {} stays as it is, cover the same values of it",
                       fmt::join(blocks.alone, " and "), row.name, row.closest);
  return fmt::format("add a block that changes {} while {} stays as it is{}", row.name, row.closest,
                     blocks.all.empty() ? " (no block changes it within itself)"
                                        : fmt::format(" (it changes in {})", fmt::join(blocks.all, ", ")));
}

void checkWhole(const Plan& plan, const Schedule& schedule, const Limits& limits, Check& result) {
  const auto all = covariatesOf(plan, schedule, posed(schedule));
  for (std::size_t i = 0; i < all.size(); ++i) {
    result.covariates.push_back(rowOf(all, i));
    const CovariateRow& row = result.covariates.back();
    if (all[i].is_time || !(row.inflation > limits.inflation)) continue;
    const bool is_like_time = row.closest == "time" || row.closest == "warm-up";
    const std::string much =
        std::isinf(row.inflation)
            ? "it is a combination of the other covariates"
            : fmt::format("variance inflation {:.1f}, at most {:.2g}", row.inflation, limits.inflation);
    result.remarks.push_back(
        {true,
         fmt::format("over the whole plan {} cannot be told from the other covariates, most of "
                     "all {} ({})",
                     row.name, row.closest, much),
         mendOf(plan, schedule, row, is_like_time)});
  }
}

/// What a plan without a block of some kind cannot tell. The correlations are between what two effects do to
/// all captures of a plan of 106, once without such a block (only distances) and once with it, in a trial of
/// ours.
struct Blind {
  Kind kind;
  const char* what;
};
constexpr std::array kBlind{
    Blind{Kind::WarmUp, "warm_up: a drift after power-on is not seen as a curve"},
    Blind{Kind::Distance, "distance: errors that go with distance (wiggling, scale) are not seen"},
    Blind{Kind::Exposure,
          "exposure: a constant stray light and an offset of the taps look alike (0.99; 0.89 with it)"},
    Blind{Kind::Ambient, "ambient: what ambient light does is not seen"},
    Blind{Kind::Checkerboard, "checkerboard: errors that go with amplitude look like errors of distance"},
    Blind{Kind::BrightDark, "bright_dark: what a frame leaves to the next one is not seen"},
    Blind{Kind::Foreground, "foreground: scatter in the lens and vignetting look alike (0.96; 0.47 with it)"},
    Blind{Kind::Scatter,
          "scatter: the share of light that a lens scatters is known badly, of several frequencies hardly at "
          "all"},
    Blind{Kind::Corner, "corner: light over several surfaces is not seen"},
    Blind{Kind::Tilt, "tilt: errors that go with the angle of incidence are not seen"},
    Blind{Kind::Moving, "moving: what motion within a frame does is not seen"},
    Blind{
        Kind::Dark,
        "dark: stray light and an offset of the taps look alike (0.88 with the best other block; 0 with it)"},
    Blind{Kind::NearField, "near_field: the emitter's place and a delay along the columns look alike (1.00)"},
    Blind{Kind::Repeats, "repeats: whether the camera came back to where it began is not known"}};

/// Of the lowest frequencies that cameras are modulated at, a period is 10 m.
constexpr double kLongestPeriod_m = 10.0;

/// Cameras of one frequency have this one or so (an O3D303's); cameras of higher ones have several.
constexpr double kLowestSingle_MHz = 30.0;

/// Errors that go once or twice per period of the modulation are told over a whole one only, and what is
/// beyond one wraps; the plan does not know its cameras.
void noteSpan(const Plan& plan, const Schedule& schedule, std::vector<Remark>& remarks) {
  std::vector<double> distance_m;
  for (const PlannedCapture& one : schedule.captures) {
    if (plan.blocks[one.block].kind == Kind::Distance && one.pose && !one.is_locked)
      distance_m.push_back(one.distance_m);
  }
  if (distance_m.empty()) return;
  const auto [nearest, farthest] = std::ranges::minmax(distance_m);
  constexpr double kHalfLight_m_MHz = unambiguousRange(1_MHz).in(metre);
  if (const double f = kHalfLight_m_MHz / farthest; f < kLowestSingle_MHz) {
    remarks.push_back(
        {false,
         fmt::format(
             "distances up to {:.3g} m are beyond c/2f of {:.3g} MHz and more: the ranges of a camera of one "
             "such frequency, or of several that have no lower one in common, begin anew there, and what "
             "wraps is told as wraps and left out of waves over distance",
             farthest, f),
         fmt::format("for such a camera end before {:.3g} m (c/2f of 30 MHz)",
                     kHalfLight_m_MHz / kLowestSingle_MHz)});
  }
  if (!(farthest > nearest) || farthest - nearest >= kLongestPeriod_m) return;
  remarks.push_back(
      {false,
       fmt::format("distances of {:.3g} to {:.3g} m are a whole period of {:.0f} MHz or more: of lower "
                   "frequencies of "
                   "modulation, waves of error of one or two per period may not be told",
                   nearest, farthest, std::ceil(kHalfLight_m_MHz / (farthest - nearest))),
       fmt::format("go on to {:.3g} m for 16 MHz (a Kinect v2), {:.3g} m for 30 MHz: c/2f beyond the nearest",
                   nearest + kHalfLight_m_MHz / 16.0, nearest + kHalfLight_m_MHz / 30.0)});
}

void note(const Plan& plan, const Schedule& schedule, std::vector<Remark>& remarks) {
  for (const Blind& blind : kBlind) {
    const bool is_there =
        std::ranges::any_of(plan.blocks, [&](const BlockSpec& b) { return b.kind == blind.kind; });
    if (!is_there) remarks.push_back({false, fmt::format("there is no block of kind {}", blind.what)});
  }
  const auto locked = std::ranges::count_if(schedule.captures, &PlannedCapture::is_locked);
  if (locked == 0) {
    remarks.push_back(
        {false, "no capture is locked: there will be none to judge a model on that was not fitted to it",
         "write locked = … in the blocks, about a fifth of their conditions"});
  }
  noteSpan(plan, schedule, remarks);
}

/// What rounding leaves of a unit vector that is a combination of others.
constexpr double kNothing = 1e-6;

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}
double norm(const std::vector<double>& a) { return std::sqrt(dot(a, a)); }

/// Without its mean, of length 1.
std::vector<double> standardised(std::vector<double> column) {
  const double mean = std::accumulate(column.begin(), column.end(), 0.0) / static_cast<double>(column.size());
  for (double& value : column) value -= mean;
  const double length = norm(column);
  for (double& value : column) value /= length;
  return column;
}

/// What is left of a column beside orthonormal directions; twice, for the rounding of the first time.
std::vector<double> beside(const Columns& directions, std::vector<double> column) {
  for (int pass = 0; pass < 2; ++pass) {
    for (const auto& direction : directions) {
      const double along = dot(direction, column);
      for (std::size_t i = 0; i < column.size(); ++i) column[i] -= along * direction[i];
    }
  }
  return column;
}

}  // namespace

bool Check::passes() const { return std::ranges::none_of(remarks, &Remark::refuses); }

Check check(const Plan& plan, const Schedule& schedule, const Limits& limits) {
  Check result;
  checkBlocks(plan, schedule, limits, result.remarks);
  checkWhole(plan, schedule, limits, result);
  note(plan, schedule, result.remarks);
  return result;
}

std::vector<double> inflationOf(const Columns& columns) {
  std::vector<double> inflation;
  for (std::size_t own = 0; own < columns.size(); ++own) {
    Columns directions;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (i == own) continue;
      auto rest = beside(directions, standardised(columns[i]));
      const double length = norm(rest);
      if (length < kNothing) continue;  // a combination of those before
      for (double& value : rest) value /= length;
      directions.push_back(std::move(rest));
    }
    const double left = norm(beside(directions, standardised(columns[own])));  // √(1 − R²)
    inflation.push_back(left < kNothing ? std::numeric_limits<double>::infinity() : 1.0 / (left * left));
  }
  return inflation;
}

}  // namespace toftwin::plan
