// SPDX-License-Identifier: Apache-2.0
#include "drivers/clock_fit.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

namespace toftwin::drivers {
namespace {

constexpr double kTuning = 4.685;
constexpr double kSdPerMad = 1.4826;  // of a normal distribution
constexpr double kLeastNoise_ns = 1.0;
constexpr int kReweightings = 20;
constexpr int kBehindIsAStep = 8;
constexpr double kMostDrift =
    1e-3 * 1e9;  // ns per s: no crystal is worse; frames that came in one burst would say more
/// Stamps beyond are damaged: so much that sums of two of them, and of what they are shifted by, are numbers.
constexpr std::int64_t kFarthest_ns =
    4'300'000'000'000'000'000;  ///< 136 years: seconds since 1970 in 32 bits
constexpr std::int64_t kFarthestBack_ns = -200'000'000'000'000'000;
constexpr double kEarlySds = 6.0;  // a normal arrival is so early once in a thousand million

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Line {
  double a = 0.0, b = 0.0;
  [[nodiscard]] double at(double x) const { return a + b * x; }
};
using Values = std::vector<double>;

/// The median of the slopes between points half a window apart, and of what that line leaves.
Line startingLine(const Values& x, const Values& y) {
  const std::size_t half = x.size() / 2;
  Values slopes, rest;
  for (std::size_t i = 0; i + half < x.size(); ++i) {
    const double dx = x[i + half] - x[i];
    if (dx > 0.0) slopes.push_back((y[i + half] - y[i]) / dx);
  }
  Line line;
  if (!slopes.empty()) line.b = std::clamp(median(std::move(slopes)), -kMostDrift, kMostDrift);
  for (std::size_t i = 0; i < x.size(); ++i) rest.push_back(y[i] - line.b * x[i]);
  line.a = median(std::move(rest));
  return line;
}

double noiseOf(const Line& line, const Values& x, const Values& y) {
  Values deviations;
  for (std::size_t i = 0; i < x.size(); ++i) deviations.push_back(std::abs(y[i] - line.at(x[i])));
  return std::max(kLeastNoise_ns, kSdPerMad * median(std::move(deviations)));
}

/// One step of iteratively reweighted least squares.
Line reweighted(const Line& line, double s, const Values& x, const Values& y) {
  double w = 0.0, wx = 0.0, wy = 0.0, wxx = 0.0, wxy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double u = (y[i] - line.at(x[i])) / (kTuning * s);
    if (std::abs(u) >= 1.0) continue;
    const double weight = (1.0 - u * u) * (1.0 - u * u);
    w += weight;
    wx += weight * x[i];
    wy += weight * y[i];
    wxx += weight * x[i] * x[i];
    wxy += weight * x[i] * y[i];
  }
  const double determinant = w * wxx - wx * wx;
  if (!(determinant > 0.0)) return line;
  const double b = std::clamp((w * wxy - wx * wy) / determinant, -kMostDrift, kMostDrift);
  return {(wy - b * wx) / w, b};
}

struct Spread {
  double a, b;  // standard deviations
};
Spread spreadOf(const Line& line, double s, const Values& x, const Values& y) {
  const auto n = static_cast<double>(x.size());
  double psi_squared = 0.0, psi_slope = 0.0, sum = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    sum += x[i];
    squares += x[i] * x[i];
    const double u = (y[i] - line.at(x[i])) / s, v = u / kTuning;
    if (std::abs(v) >= 1.0) continue;
    const double within = 1.0 - v * v;
    psi_squared += u * u * within * within * within * within;
    psi_slope += within * (1.0 - 5.0 * v * v);
  }
  const double mean = sum / n, spread = squares - n * mean * mean;
  const double slope = std::max(psi_slope / n, 0.1);  // below: hardly a majority agrees
  const double k = s * std::sqrt(psi_squared / (n - 2.0)) / slope;
  return {k * std::sqrt(1.0 / n + mean * mean / spread), k / std::sqrt(spread)};
}

}  // namespace

void ClockFit::add(DeviceTime device, std::int64_t host_ns) {
  points_.push_back({device.ns, host_ns - device.ns});
  if (points_.size() > window_) points_.pop_front();
}

std::optional<ClockFit::Estimate> ClockFit::estimate() const {
  if (points_.size() < kFewest || points_.back().device_ns <= points_.front().device_ns) {
    return std::nullopt;
  }
  // Relative to the newest point, so that doubles hold the nanoseconds of any epoch.
  const Point newest = points_.back();
  Values x, y;
  for (const Point& point : points_) {
    x.push_back(static_cast<double>(point.device_ns - newest.device_ns) * 1e-9);
    y.push_back(static_cast<double>(point.host_minus_device_ns - newest.host_minus_device_ns));
  }
  Line line = startingLine(x, y);
  const double s = noiseOf(line, x, y);
  for (int i = 0; i < kReweightings; ++i) line = reweighted(line, s, x, y);
  const Spread spread = spreadOf(line, s, x, y);
  return Estimate{.host_minus_device_ns = newest.host_minus_device_ns + std::llround(line.a),
                  .offset_sd_ns = spread.a,
                  .drift = line.b * 1e-9,
                  .drift_sd = spread.b * 1e-9,
                  .noise_ns = s};
}

DeviceTime DeviceClock::read(std::int64_t stamp_ns, SteadyTime arrived) {
  const std::int64_t arrived_ns =
      std::chrono::duration_cast<std::chrono::nanoseconds>(arrived.time_since_epoch()).count();
  stamp_ns = std::clamp(stamp_ns, kFarthestBack_ns, kFarthest_ns);
  Reading reading{.time_ns = stamp_ns + shift_ns_};
  if (last_) {
    reading = continued(stamp_ns, arrived_ns);
    reading.time_ns = std::max(reading.time_ns, last_->ns + 1);
  }
  last_ = DeviceTime{reading.time_ns};
  if (reading.is_ordinary) {
    fit_.add(*last_, arrived_ns);
    last_arrived_ns_ = arrived_ns;
  }
  return *last_;
}

DeviceClock::Reading DeviceClock::continued(std::int64_t stamp_ns, std::int64_t arrived_ns) {
  const auto fitted = fit_.estimate();
  const std::int64_t expected = predictedStamp(arrived_ns, fitted);
  if (const std::int64_t period = options_.wraps_after_ns; period > 0) {
    // The turn of the counter in which the stamp comes nearest to what is expected.
    const double turns = static_cast<double>(expected - stamp_ns - shift_ns_) / static_cast<double>(period);
    shift_ns_ += std::llround(turns) * period;
  }
  const std::int64_t time_ns = stamp_ns + shift_ns_, ahead = time_ns - expected;
  const bool is_settling = settling_ > 0;
  // After a step it may be that the frame before had too late a time, and no second step.
  const bool is_back = time_ns <= last_->ns && !(is_settling && ahead >= -tolerance_ns_);
  settling_ -= is_settling ? 1 : 0;
  // A frame may come late, but never early: a stamp from the future is a clock that was set. One
  // from the past is that if it stays so.
  if (ahead > tolerance_ns_ && options_.follows_steps_ahead && time_ns < kFarthest_ns) {
    // A single stamp may be damaged, and device time could never come back.
    const bool is_like_before = ahead_by_ns_ && std::abs(ahead - *ahead_by_ns_) < tolerance_ns_;
    ahead_by_ns_ = ahead;
    if (!is_like_before) return {expected};
    fit_.clear();
    step(0);
    return {time_ns};
  }
  ahead_by_ns_.reset();
  if (is_settling && fitted && static_cast<double>(ahead) > kEarlySds * fitted->noise_ns) {
    // So much too late, then, was the frame that the step was measured by.
    shift_ns_ -= ahead;
    behind_ = 0;
    return {expected};
  }
  if (ahead > tolerance_ns_ || is_back) {
    step(-ahead);
    return {expected};
  }
  if (ahead >= -tolerance_ns_) {
    behind_ = 0;
    return {time_ns};
  }
  const bool is_like_before = behind_ > 0 && std::abs(ahead - behind_by_ns_) < tolerance_ns_;
  if (!is_like_before) behind_since_ns_ = arrived_ns;
  behind_ = is_like_before ? behind_ + 1 : 1;
  behind_by_ns_ = ahead;
  // Frames that waited in a queue come all at once.
  const bool stays_so = behind_ >= kBehindIsAStep && arrived_ns - behind_since_ns_ >= tolerance_ns_;
  if (!stays_so) return {time_ns, false};
  step(-ahead);
  return {expected};
}

/// Continuous device time of a frame that arrives then, if nothing is out of the ordinary.
std::int64_t DeviceClock::predictedStamp(std::int64_t arrived_ns,
                                         const std::optional<ClockFit::Estimate>& fitted) const {
  if (!fitted) return last_->ns + (arrived_ns - last_arrived_ns_);
  // host = device + offset + drift · (device − newest), solved for device to first order.
  const auto since = static_cast<double>(arrived_ns - last_arrived_ns_);
  return arrived_ns - fitted->host_minus_device_ns - std::llround(since * fitted->drift);
}

void DeviceClock::step(std::int64_t by_ns) {
  shift_ns_ += by_ns;
  ++steps_;
  behind_ = 0;
  ahead_by_ns_.reset();
  settling_ = by_ns == 0 ? 0 : options_.window;
}

ClockRelation DeviceClock::relation(Duration delay, Duration delay_sd) const {
  const auto fitted = fit_.estimate();
  if (!fitted) return {};
  // The relation of the host's two clocks, now: device + offset is steady time.
  const ClockRelation steady_to_wall = relateToHost({0}, SteadyTime{});
  const double sd = std::hypot(fitted->offset_sd_ns, delay_sd.in(nanosecond),
                               static_cast<double>(steady_to_wall.uncertainty_ns));
  return {.host_minus_device_ns = fitted->host_minus_device_ns +
                                  steady_to_wall.host_minus_device_ns -
                                  std::llround(delay.in(nanosecond)),
          .uncertainty_ns = std::llround(std::ceil(sd))};
}

}  // namespace toftwin::drivers
