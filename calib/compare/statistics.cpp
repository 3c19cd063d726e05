// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/statistics.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <toftwin/nan.h>

namespace toftwin::compare {
namespace {

/// The largest clusteredError over blocks of 1, 2, 4, … in each direction of an image of that width.
double blockedError(std::span<const double> values, std::size_t width) {
  constexpr std::ptrdiff_t kFewestBlocks = 8, kFewestValues = 16;
  if (std::count_if(values.begin(), values.end(), [](double v) { return std::isfinite(v); }) <
      kFewestValues)
    return kNaN;
  const std::size_t height = width == 0 ? 0 : values.size() / width;
  double largest = kNaN;
  std::vector<std::uint32_t> block(values.size());
  for (std::size_t side = 1; side <= std::max(width, height); side *= 2) {
    const std::size_t across = (width + side - 1) / side;
    std::vector<bool> is_used(across * ((height + side - 1) / side));
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::size_t at = i / width / side * across + i % width / side;
      block[i] = static_cast<std::uint32_t>(at);
      if (std::isfinite(values[i])) is_used[at] = true;
    }
    if (std::count(is_used.begin(), is_used.end(), true) < kFewestBlocks) break;
    largest = std::fmax(largest, clusteredError(values, block));  // fmax: NaN gives way
  }
  return largest;
}

}  // namespace

double clusteredError(std::span<const double> values, std::span<const std::uint32_t> cluster) {
  std::vector<Running> clusters;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) continue;
    if (cluster[i] >= clusters.size()) clusters.resize(cluster[i] + std::size_t{1});
    clusters[cluster[i]].add(values[i]);
  }
  double n = 0.0, sum = 0.0, squares = 0.0, within = 0.0, free = 0.0;
  std::size_t used = 0;
  for (const Running& c : clusters) {
    if (c.n() == 0) continue;
    const auto size = static_cast<double>(c.n());
    ++used, n += size, sum += size * c.mean(), squares += size * size;
    if (c.n() > 1) within += (size - 1.0) * c.variance(), free += size - 1.0;
  }
  // Else what the smaller ones are off by, over how little of the mean they are, would make it more than the values.
  constexpr double kFewestEqual = 1.5;
  if (used < 2 || n * n < kFewestEqual * squares) return kNaN;
  // Analysis of variance: how clusters scatter, each weighted by its pixels, less what their pixels' own scatter
  // makes of it, which is most in those that are far away and have few of them.
  const double mean = sum / n, of_all = free > 0.0 ? within / free : 0.0;
  double between = 0.0, made_by_own = 0.0, own = 0.0;
  for (const Running& c : clusters) {
    if (c.n() == 0) continue;
    const double size = static_cast<double>(c.n()), variance = c.n() > 1 ? c.variance() : of_all;
    between += size * (c.mean() - mean) * (c.mean() - mean);
    made_by_own += (1.0 - size / n) * variance, own += size * variance / n;
  }
  const double of_clusters = std::max(0.0, between - made_by_own) / (n - squares / n);
  return std::sqrt(of_clusters * squares / (n * n) + own / n);
}

double blockedError(const Image<float>& field) {
  const std::vector<double> values(field.pixels().begin(), field.pixels().end());
  return blockedError(values, static_cast<std::size_t>(field.width()));
}

double blockedError(std::span<const double> series) { return blockedError(series, series.size()); }

double meanWithin(std::span<const double> values, double reach) {
  // Where the values scatter by a reach, each step leaves two thirds of the way; by two, nine tenths.
  constexpr int kSteps = 200;
  constexpr double kNear = 1e-5;
  double middle = 0.0;
  for (int step = 0; step < kSteps; ++step) {
    Running within;
    for (const double one : values) {
      if (std::abs(one - middle) <= reach) within.add(one);
    }
    const double before = std::exchange(middle, within.n() == 0 ? middle : within.mean());
    if (std::abs(middle - before) <= kNear * reach) break;
  }
  return middle;
}

double quantile(std::vector<double> values, double q) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return kNaN;
  const double place = std::clamp(q, 0.0, 1.0) * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(below);
  std::nth_element(values.begin(), at, values.end());
  const double low = *at;
  if (below + 1 >= values.size()) return low;
  const double high = *std::min_element(at + 1, values.end());
  return low + (place - static_cast<double>(below)) * (high - low);
}

Summary summarise(std::span<const double> values) {
  std::vector<double> kept, magnitudes;
  Running running;
  double squares = 0.0;
  for (const double v : values) {
    if (!std::isfinite(v)) continue;
    kept.push_back(v);
    magnitudes.push_back(std::abs(v));
    running.add(v);
    squares += v * v;
  }
  Summary s;
  s.n = kept.size();
  if (kept.empty()) {
    s.mean = s.sd = s.standard_error = s.rms = s.median = s.p95_abs = s.min = s.max = kNaN;
    return s;
  }
  const auto n = static_cast<double>(s.n);
  s.mean = running.mean();
  s.sd = s.n < 2 ? kNaN : std::sqrt(running.variance());
  s.standard_error = s.sd / std::sqrt(n);
  s.rms = std::sqrt(squares / n);
  const auto [min, max] = std::minmax_element(kept.begin(), kept.end());
  s.min = *min;
  s.max = *max;
  s.median = quantile(std::move(kept), 0.5);
  s.p95_abs = quantile(std::move(magnitudes), 0.95);
  return s;
}

Json toJson(const Summary& s, const char* unit) {
  Json json = Json::object();
  json.set("unit", unit).set("n", s.n).set("mean", s.mean).set("standard_error", s.standard_error);
  json.set("sd", s.sd).set("rms", s.rms).set("median", s.median).set("p95_abs", s.p95_abs);
  json.set("min", s.min).set("max", s.max);
  return json;
}

Explained explain(std::span<const double> measured_error, std::span<const double> predicted_error) {
  Running measured, residual;
  double measured_squares = 0.0, residual_squares = 0.0;
  for (std::size_t i = 0; i < measured_error.size(); ++i) {
    const double e = measured_error[i], left = e - predicted_error[i];
    if (!std::isfinite(e) || !std::isfinite(left)) continue;
    measured.add(e);
    residual.add(left);
    measured_squares += e * e;
    residual_squares += left * left;
  }
  Explained result;
  result.n = measured.n();
  const auto n = static_cast<double>(result.n);
  result.measured_rms = std::sqrt(measured_squares / n);
  result.residual_rms = std::sqrt(residual_squares / n);
  result.measured_sd = std::sqrt(measured.variance());
  result.residual_sd = std::sqrt(residual.variance());
  result.best_offset = residual.mean();
  result.fraction_raw = 1.0 - residual_squares / measured_squares;
  result.fraction_centred = 1.0 - residual.variance() / measured.variance();
  return result;
}

Json toJson(const Explained& e) {
  Json json = Json::object();
  json.set("n", e.n).set("measured_rms_mm", e.measured_rms).set("residual_rms_mm", e.residual_rms);
  json.set("measured_sd_mm", e.measured_sd).set("residual_sd_mm", e.residual_sd);
  json.set("best_offset_mm", e.best_offset).set("fraction_raw", e.fraction_raw);
  json.set("fraction_centred", e.fraction_centred);
  return json;
}

}  // namespace toftwin::compare
