// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/captures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "calib/plan/place.h"
#include "sim/images/mix_bits.h"

namespace toftwin::plan {
namespace {

/// A drawn order in which nothing goes with time by more is good enough; else the best of so many.
constexpr double kGoodOrder = 0.2;
constexpr int kOrders = 500;

/// SplitMix64 (Steele, Lea, Flood 2014): the same on every machine, unlike std::shuffle.
class Draws {
 public:
  /// Of a block by its name, so that blocks before it change nothing.
  Draws(std::uint64_t seed, std::string_view name) : state_(seed) {
    for (const char c : name) state_ = (state_ ^ static_cast<unsigned char>(c)) * 0x100000001b3u;  // FNV-1a
    state_ ^= seed * 0x9e3779b97f4a7c15u;
  }
  std::uint64_t next() {
    return sim::mixBits(state_ += 0x9e3779b97f4a7c15u);
  }
  /// The bias of the remainder is below count / 2⁶⁴.
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(next() % count); }
  void shuffle(std::vector<std::size_t>& values) {
    for (std::size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[below(i)]);
  }

 private:
  std::uint64_t state_;
};

std::string nameOf(const BlockSpec& block, const PlannedCapture& one) {
  std::string name = block.name;
  const char* between = ": ";
  const auto add = [&](const std::string& part) {
    name += between + part;
    between = ", ";
  };
  if (one.pose) add(one.pose->name);
  if (block.exposures.size() > 1) add(fmt::format("{:.6g} us", one.exposure.in(microsecond)));
  if (block.ambients.size() > 1) add(fmt::format("{:.6g} klx", one.ambient.in(kilolux)));
  return name;
}

/// Poses × exposures × ambients, as written.
std::vector<PlannedCapture> conditionsOf(const Plan& plan, std::size_t at) {
  const BlockSpec& block = plan.blocks[at];
  const Target target = targetOf(plan, block);
  std::vector<std::optional<compare::PoseSpec>> poses;
  for (auto& pose : posesOf(plan, block)) poses.emplace_back(std::move(pose));
  if (poses.empty()) poses.emplace_back();
  const auto exposures = block.exposures.empty() ? std::vector{plan.exposure} : block.exposures;
  const auto ambients = block.ambients.empty() ? std::vector{plan.ambient} : block.ambients;
  std::vector<PlannedCapture> all;
  for (const auto& pose : poses) {
    for (const Duration exposure : exposures) {
      for (const Illuminance ambient : ambients) {
        const Sight sight = pose ? sightOf(target, *pose) : Sight{kNaN, kNaN};
        PlannedCapture one;
        one.block = at, one.condition = all.size(), one.pose = pose;
        one.distance_m = sight.distance_m, one.angle_deg = sight.angle_deg;
        one.exposure = exposure, one.ambient = ambient;
        one.frames = block.frames > 0 ? block.frames : plan.frames;
        one.is_locked = block.kind == Kind::Locked;
        one.name = nameOf(block, one);
        all.push_back(std::move(one));
      }
    }
  }
  return all;
}

/// How much anything that is set goes with time in that order.
double goesWithTime(const std::vector<PlannedCapture>& conditions, const std::vector<std::size_t>& order) {
  std::vector<double> time(order.size());
  std::iota(time.begin(), time.end(), 0.0);
  double most = 0.0;
  const auto look = [&](auto&& of) {
    std::vector<double> values;
    for (const std::size_t c : order) values.push_back(of(conditions[c]));
    most = std::max(most, std::abs(correlation(time, values)));
  };
  look([](const PlannedCapture& c) { return c.distance_m; });
  look([](const PlannedCapture& c) { return c.angle_deg; });
  look([](const PlannedCapture& c) { return std::log(std::max(1e-9, c.exposure.in(microsecond))); });
  look([](const PlannedCapture& c) { return c.ambient.in(kilolux); });
  return most;
}

/// Each repeat is a round through all conditions, in a new order. Orders are drawn until one keeps what is
/// set apart from time (restricted randomisation), since a short block has many that don't.
std::vector<std::size_t> orderOf(const BlockSpec& block, const std::vector<PlannedCapture>& conditions,
                                 Draws& draws) {
  const bool is_random =
      block.order == Order::Random && block.kind != Kind::BrightDark && block.kind != Kind::WarmUp;
  std::vector<std::size_t> best;
  double least = std::numeric_limits<double>::infinity();
  for (int attempt = 0; attempt < (is_random ? kOrders : 1) && least > kGoodOrder; ++attempt) {
    std::vector<std::size_t> order;
    for (int round = 0; round < block.repeats; ++round) {
      std::vector<std::size_t> once(conditions.size());
      std::iota(once.begin(), once.end(), std::size_t{0});
      if (is_random) draws.shuffle(once);
      order.insert(order.end(), once.begin(), once.end());
    }
    if (const double much = goesWithTime(conditions, order); much < least)
      least = much, best = std::move(order);
  }
  return best;
}

void lock(const BlockSpec& block, std::vector<PlannedCapture>& conditions, Draws& draws) {
  std::vector<std::size_t> drawn(conditions.size());
  std::iota(drawn.begin(), drawn.end(), std::size_t{0});
  draws.shuffle(drawn);
  for (std::size_t i = 0; i < static_cast<std::size_t>(block.locked); ++i)
    conditions[drawn[i]].is_locked = true;
}

/// Earlier captures whose conditions can be captured again: each condition once, at its first visit.
std::vector<std::size_t> repeatable(const Plan& plan, const BlockSpec& block, const Schedule& schedule) {
  std::vector<std::size_t> all;
  for (const PlannedCapture& one : schedule.captures) {
    const BlockSpec& of = plan.blocks[one.block];
    const bool is_named = std::ranges::find(block.of, of.name) != block.of.end();
    const bool stands_still = of.kind != Kind::BrightDark && of.kind != Kind::Moving && of.kind != Kind::Dark;
    if (one.is_locked || one.again || one.repeat > 0 || !one.pose) continue;
    if (block.of.empty() ? of.setup.empty() && stands_still : is_named) all.push_back(one.number);
  }
  return all;
}

Result<std::vector<PlannedCapture>> repeatsOf(const Plan& plan, std::size_t at, const Schedule& schedule,
                                              Draws& draws) {
  const BlockSpec& block = plan.blocks[at];
  auto from = repeatable(plan, block, schedule);
  const auto wanted = static_cast<std::size_t>(block.captures);
  if (from.size() < wanted) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("block \"{}\": captures = {}, but there are only {} earlier conditions to capture again "
                    "that are neither locked nor of a block with a setup; name blocks with of = […] or ask "
                    "for fewer",
                    block.name, wanted, from.size())};
  }
  draws.shuffle(from);
  std::vector<PlannedCapture> all;
  for (std::size_t i = 0; i < wanted; ++i) {
    PlannedCapture one = schedule.captures[from[i]];
    one.again = from[i], one.block = at, one.condition = i;
    one.frames = block.frames > 0 ? block.frames : plan.frames;
    one.name = fmt::format("{}: again {}", block.name, one.name);
    all.push_back(std::move(one));
  }
  return all;
}

void append(Schedule& schedule, PlannedCapture one, const Plan& plan, const Tempo& tempo) {
  const BlockSpec& block = plan.blocks[one.block];
  const bool begins_block = schedule.captures.empty() || schedule.captures.back().block != one.block;
  Duration start = schedule.total;
  if (begins_block && !block.setup.empty())
    start = start + plan.setup_time, schedule.setups = schedule.setups + plan.setup_time;
  if (!begins_block && schedule.captures.back().start + block.interval > start) {
    start = schedule.captures.back().start + block.interval;
  }
  one.number = schedule.captures.size();
  one.start = start;
  one.duration = plan.pose_time + static_cast<double>(one.frames) * (tempo.frame_a + tempo.frame_b);
  schedule.total = start + one.duration;
  schedule.captures.push_back(std::move(one));
}

}  // namespace

double correlation(const std::vector<double>& x, const std::vector<double>& y) {
  double mean_x = 0.0, mean_y = 0.0;
  const auto n = static_cast<double>(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) mean_x += x[i] / n, mean_y += y[i] / n;
  double xx = 0.0, yy = 0.0, xy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double dx = x[i] - mean_x, dy = y[i] - mean_y;
    xx += dx * dx, yy += dy * dy, xy += dx * dy;
  }
  // What does not change has only the rounding of its mean left.
  const bool is_constant =
      !(xx > 1e-18 * n * (1.0 + mean_x * mean_x)) || !(yy > 1e-18 * n * (1.0 + mean_y * mean_y));
  return is_constant ? 0.0 : xy / std::sqrt(xx * yy);
}

Result<Schedule> scheduleOf(const Plan& plan, const Tempo& tempo) {
  Schedule schedule;
  for (std::size_t at = 0; at < plan.blocks.size(); ++at) {
    const BlockSpec& block = plan.blocks[at];
    Draws draws{plan.seed, block.name};
    auto conditions = conditionsOf(plan, at);
    if (block.kind == Kind::Repeats) {
      auto again = repeatsOf(plan, at, schedule, draws);
      if (!again) return again.error();
      conditions = *std::move(again);
    }
    lock(block, conditions, draws);
    std::vector<int> visits(conditions.size(), 0);
    for (const std::size_t c : orderOf(block, conditions, draws)) {
      PlannedCapture one = conditions[c];
      one.repeat = visits[c]++;
      append(schedule, std::move(one), plan, tempo);
    }
  }
  return schedule;
}

}  // namespace toftwin::plan
