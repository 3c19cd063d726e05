// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/answer/judge.h"

#include <algorithm>
#include <cmath>

#include <toftwin/nan.h>

#include "calib/compare/statistics.h"
#include "calib/discover/campaign/answer/explained.h"
#include "calib/discover/campaign/captures/reading.h"

namespace toftwin::discover {
namespace {

/// Errors of one capture's pixels.
struct Errors {
  Image<float> each_mm{};          ///< NaN: none, or a gross one
  std::vector<double> all_mm{};    ///< where depth does not jump
  double agree = 0.0, looked_at = 0.0;
  double neighbours = 0.0, squares = 0.0;
};
Errors errorsOf(const MeasuredCapture& capture, const TracedCapture& traced, const Reading& simulated,
                double offset_mm) {
  Errors errors;
  const int width = simulated.range_m.width(), height = simulated.range_m.height();
  Image<float> left(width, height, kNaN);
  errors.each_mm = left;
  double mean = 0.0;
  for (std::size_t i = 0; i < left.size(); ++i) {
    const bool measured = capture.valid_share[i] >= 0.5F,
               said = std::isfinite(simulated.range_m[i]);
    errors.agree += measured == said ? 1.0 : 0.0, errors.looked_at += 1.0;
    float error = capture.range_m.mean[i] - simulated.range_m[i];
    for (std::size_t way = 0; way < traced.stood.size(); ++way)
      error += static_cast<float>(traced.stood[way]) * traced.range_m[way][i];
    if (!std::isfinite(error) || std::abs(error) > kGross_m) continue;
    errors.each_mm[i] = 1e3F * error - static_cast<float>(offset_mm);
    if (traced.is_edge[i] != 0) continue;
    left[i] = error;
    errors.all_mm.push_back(1e3 * static_cast<double>(error) - offset_mm);
    mean += static_cast<double>(error);
  }
  mean /= std::max<double>(1.0, static_cast<double>(errors.all_mm.size()));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x + 1 < width; ++x) {
      const double a = static_cast<double>(left(x, y)) - mean,
                   b = static_cast<double>(left(x + 1, y)) - mean;
      if (std::isfinite(a + b)) errors.neighbours += a * b, errors.squares += 0.5 * (a * a + b * b);
    }
  }
  return errors;
}

/// Pixels of a capture that have an error before and after.
void addPixels(const MeasuredCapture& capture, const TracedCapture& traced, const Reading& simulated, const Errors& then,
               const Errors& now, std::vector<JudgedPixel>& pixels) {
  const int width = then.each_mm.width(), height = then.each_mm.height();
  const float middle_x = 0.5F * static_cast<float>(width - 1), middle_y = 0.5F * static_cast<float>(height - 1);
  const float half_diagonal = std::hypot(middle_x, middle_y);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float before = then.each_mm(x, y), after = now.each_mm(x, y);
      if (!std::isfinite(before + after)) continue;
      const float radius = std::hypot(static_cast<float>(x) - middle_x, static_cast<float>(y) - middle_y);
      const Image<float>& log_amplitude = capture.log_amplitude.mean;
      pixels.push_back({.before_mm = before,
                        .after_mm = after,
                        .range_m = simulated.range_m(x, y),
                        .log_amplitude = log_amplitude.empty() ? kNaN : log_amplitude(x, y),
                        .variance_mm2 = 1e6F * capture.range_m.variance(x, y),
                        .radius = half_diagonal > 0.0F ? radius / half_diagonal : 0.0F,
                        .is_edge = traced.is_edge(x, y) != 0});
    }
  }
}

/// The mean over captures of each pixel.
class Mean {
 public:
  void add(const Image<float>& each) {
    if (sum_.empty()) sum_ = Image<float>(each.width(), each.height()), count_ = sum_;
    for (std::size_t i = 0; i < each.size(); ++i)
      if (std::isfinite(each[i])) sum_[i] += each[i], count_[i] += 1.0F;
  }
  [[nodiscard]] Image<float> take() {
    for (std::size_t i = 0; i < sum_.size(); ++i) sum_[i] /= count_[i];  // 0/0: none
    return std::move(sum_);
  }

 private:
  Image<float> sum_{}, count_{};
};

struct Totals {
  std::vector<double> all_mm{};
  double agree = 0.0, looked_at = 0.0, neighbours = 0.0, squares = 0.0;
  void add(const Errors& one) {
    all_mm.insert(all_mm.end(), one.all_mm.begin(), one.all_mm.end());
    agree += one.agree, looked_at += one.looked_at, neighbours += one.neighbours,
        squares += one.squares;
  }
  void into(RangeErrors& errors) const {
    const compare::Summary summary = compare::summarise(all_mm);
    errors.pixels = summary.n, errors.bias_mm = summary.mean, errors.rms_mm = summary.rms;
    errors.p95_mm = summary.p95_abs;
    errors.masks_agree = agree / std::max(1.0, looked_at);
    errors.neighbour_correlation = squares > 0.0 ? neighbours / squares : 0.0;
  }
};

}  // namespace

Result<Judgement> judge(const JudgedCampaign& judged, const JudgedCampaign& open,
                        const JudgedModels& models) {
  const auto& [before, with_zero, after] = models;
  const auto camera_before =
      NoiselessCamera::make(judged.declared.model, before.effects, judged.lit.captures);
  if (!camera_before) return camera_before.error();
  const auto camera_with_zero =
      NoiselessCamera::make(judged.declared.model, with_zero.effects, judged.lit.captures);
  if (!camera_with_zero) return camera_with_zero.error();
  const auto camera_after =
      NoiselessCamera::make(judged.declared.model, after.effects, judged.lit.captures);
  if (!camera_after) return camera_after.error();
  Judgement judgement;
  Totals all_raw, all_before, all_with_zero, all_after;
  std::vector<JudgedPixel> pixels;
  Mean mean_before, mean_after;
  for (std::size_t c = 0; c < judged.lit.captures.size(); ++c) {
    const MeasuredCapture& capture = judged.lit.captures[c];
    const TracedCapture& traced = *judged.lit.traced[c];
    const sim::Light& varied = *judged.lit.varied[c];
    const auto readingBy = [&](const NoiselessCamera& camera) {
      return readingOf(*camera_before, camera, capture, traced.light, varied);
    };
    const auto errors = [&](const NoiselessCamera& camera, double offset_mm) {
      return errorsOf(capture, traced, readingBy(camera), offset_mm);
    };
    const Reading declared = readingBy(*camera_before);
    const Errors then = errorsOf(capture, traced, declared, before.offset_mm), now = errors(*camera_after, after.offset_mm);
    all_raw.add(errorsOf(capture, traced, declared, 0.0));
    all_before.add(then), all_after.add(now);
    addPixels(capture, traced, declared, then, now, pixels);
    mean_before.add(then.each_mm), mean_after.add(now.each_mm);
    all_with_zero.add(errors(*camera_with_zero, with_zero.offset_mm));
    const compare::Summary s = compare::summarise(then.all_mm), t = compare::summarise(now.all_mm);
    judgement.captures.push_back({capture.record.name, capture.record.block, s.mean, t.mean, s.rms,
                                  t.rms, capture.record.a.since_power_on_s,
                                  capture.record.distance_m});
  }
  all_raw.into(judgement.raw), all_before.into(judgement.before), all_after.into(judgement.after);
  all_with_zero.into(judgement.with_zero);
  judgement.regions = regionsOf(pixels);
  judgement.mean = {mean_before.take(), mean_after.take()};
  if (judged.lit.captures.empty()) return judgement;
  if (auto added = addExplained(judged, open, models, judgement); !added) return added.error();
  return judgement;
}

}  // namespace toftwin::discover
