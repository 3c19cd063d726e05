// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/captures/light_noise.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <toftwin/nan.h>

#include "calib/compare/stack.h"
#include "sim/images/box_mean.h"

namespace toftwin::discover {

void LightNoise::add(const Frame& frame) {
  const Plane* plane = frame.find(PlaneKind::LightSigma);
  const bool is_first = frames_++ == 0;
  if (is_first) {
    for (const Exposure& one : frame.moment.exposures)
      most_per_m_ = std::max(most_per_m_, 4.0 * std::numbers::pi * one.modulation.in(hertz) / kSpeedOfLight_m_per_s);
    // Of a pulsed camera's light nobody knows.
    is_hidden_ = frame.provenance.kind == FrameKind::Simulated && plane == nullptr && most_per_m_ > 0.0;
  }
  if (plane == nullptr || plane->type != ElementType::F32) {
    is_same_ = false;
    return;
  }
  if (!is_first) {
    is_same_ = is_same_ && std::ranges::equal(plane->data.bytes(), sigma_.data.bytes());
    return;
  }
  sigma_ = *plane;
}

/// The highest frequency's, as of what is traced for comparison: it decides over the range.
void LightNoise::putInto(MeasuredCapture& capture) const {
  capture.hides_light_noise = is_hidden_;
  if (frames_ == 0 || !is_same_) return;
  Image<float> variance_m2(sigma_.width, sigma_.height, kNaN);
  const auto sigma_m = sigma_.as<float>();
  bool is_known = false;
  for (std::size_t i = 0; i < sigma_m.size(); ++i) {
    if (!std::isfinite(sigma_m[i])) continue;
    float& here = variance_m2[i % variance_m2.size()];
    here = std::isfinite(here) ? std::min(here, sigma_m[i] * sigma_m[i]) : sigma_m[i] * sigma_m[i];
    is_known = true;
  }
  if (!is_known) return;
  capture.light_variance = variance_m2;
  for (float& relative : capture.light_variance.pixels()) relative *= static_cast<float>(most_per_m_ * most_per_m_);
  capture.light_variance_m2 = std::move(variance_m2);
}

/// Over squares of pixels without edges, for the reasons given where light is traced (trace_captures.cpp).
void shareLightNoise(const std::vector<std::shared_ptr<const TracedCapture>>& traced,
                     std::vector<MeasuredCapture>& captures) {
  constexpr int kReach = 4;
  const auto isBeside = [](const MeasuredCapture& a, const MeasuredCapture& b) {
    return compare::samePose(*a.moment.world_from_camera, *b.moment.world_from_camera);
  };
  const std::vector<std::size_t> stands = standsOf(captures);
  for (std::size_t c = 0; c < captures.size(); ++c) {
    MeasuredCapture& capture = captures[c];
    if (capture.light_variance.empty()) continue;
    std::set<std::size_t> beside;
    capture.light_captures = 0;
    for (std::size_t other = 0; other < captures.size(); ++other)
      if (isBeside(capture, captures[other])) ++capture.light_captures, beside.insert(stands[other]);
    capture.light_stands = beside.size();
    const auto alike = static_cast<float>(capture.light_captures);
    for (Image<float>* image : {&capture.light_variance_m2, &capture.light_variance}) {
      for (std::size_t i = 0; i < image->size(); ++i)
        (*image)[i] = traced[c]->is_jump[i] != 0 ? kNaN : alike * (*image)[i];
      *image = sim::boxMean(*image, kReach);
    }
  }
}

std::vector<MeasuredCapture> eachByItself(std::vector<MeasuredCapture> captures) {
  for (MeasuredCapture& capture : captures) {
    const auto alike = static_cast<float>(capture.light_captures);
    for (Image<float>* image : {&capture.light_variance_m2, &capture.light_variance})
      for (float& variance : image->pixels()) variance /= alike;
    capture.light_captures = capture.light_stands = 1;
  }
  return captures;
}

}  // namespace toftwin::discover
