// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/captures/pool_noise.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <toftwin/nan.h>

#include "calib/discover/campaign/captures/light_delay.h"
#include "calib/discover/campaign/captures/reading.h"
#include "calib/discover/campaign/rows/carriers.h"
#include "sim/images/box_mean.h"

namespace toftwin::discover {
namespace {

struct Bin {
  double like = 0.0, variance = 0.0;  ///< means
};

/// Bins of as many of the pixels each, which are in order of what they are alike in; of those that are the same in it
/// none is cut.
std::vector<Bin> binsOf(const std::vector<std::pair<float, float>>& ordered) {
  constexpr std::size_t kBins = 24;
  std::vector<Bin> bins;
  const std::size_t count = std::min(kBins, ordered.size());
  for (std::size_t b = 0, first = 0; b < count; ++b) {
    std::size_t last = std::max(first, (b + 1) * ordered.size() / count);
    while (last > 0 && last < ordered.size() && ordered[last].first == ordered[last - 1].first) ++last;
    if (last == first) continue;
    Bin bin;
    for (std::size_t i = first; i < last; ++i)
      bin.like += static_cast<double>(ordered[i].first), bin.variance += static_cast<double>(ordered[i].second);
    bin.like /= static_cast<double>(last - first), bin.variance /= static_cast<double>(last - first);
    bins.push_back(bin);
    first = last;
  }
  return bins;
}

double between(const std::vector<Bin>& bins, double like) {
  const auto above = std::ranges::upper_bound(bins, like, {}, &Bin::like);
  if (above == bins.begin()) return bins.front().variance;
  if (above == bins.end()) return bins.back().variance;
  const Bin &a = *(above - 1), &b = *above;
  const double share = (like - a.like) / (b.like - a.like);
  return a.variance + share * (b.variance - a.variance);
}

/// What the declared camera says of the brightness, times what it errs by about each pixel: 81 pixels' mean hardly
/// has the pixel's own noise.
Image<float> brightnessOf(const Image<float>& declared, const Image<float>& measured,
                          const Image<std::uint8_t>& is_edge) {
  constexpr int kReach = 4;
  if (measured.empty()) return declared;
  Image<float> off = measured;
  for (std::size_t i = 0; i < off.size(); ++i) off[i] = is_edge[i] != 0 ? kNaN : off[i] - declared[i];
  Image<float> brightness = sim::boxMean(off, kReach);
  for (std::size_t i = 0; i < brightness.size(); ++i) brightness[i] += declared[i];
  return brightness;
}

}  // namespace

Image<float> pooledOver(const Image<float>& variance, const Image<float>& like) {
  std::vector<std::pair<float, float>> ordered;
  for (std::size_t i = 0; i < variance.size(); ++i)
    if (std::isfinite(variance[i]) && std::isfinite(like[i])) ordered.emplace_back(like[i], variance[i]);
  std::ranges::sort(ordered, {}, &std::pair<float, float>::first);
  const std::vector<Bin> bins = binsOf(ordered);
  Image<float> pooled(variance.width(), variance.height(), kNaN);
  for (std::size_t i = 0; i < pooled.size(); ++i)
    if (std::isfinite(variance[i]) && std::isfinite(like[i]))
      pooled[i] = static_cast<float>(between(bins, static_cast<double>(like[i])));
  return pooled;
}

Result<> poolNoise(const Declared& declared, const std::vector<std::shared_ptr<const TracedCapture>>& traced,
                   std::vector<MeasuredCapture>& captures) {
  const auto camera = NoiselessCamera::make(declared.model, declaredEffects(declared), captures);
  if (!camera) return camera.error();
  for (std::size_t c = 0; c < captures.size(); ++c) {
    MeasuredCapture& capture = captures[c];
    const Image<float> like = brightnessOf(camera->read(capture, traced[c]->light).log_amplitude,
                                           capture.log_amplitude.mean, traced[c]->is_edge);
    const auto pool = [&](Repeated& of) {
      if (!of.own_variance.empty()) of.variance = pooledOver(of.own_variance, like);
    };
    pool(capture.range_m), pool(capture.log_amplitude);
    if (!capture.raw) continue;
    pool(capture.raw->range_m);
    for (Repeated& closure : capture.raw->closures) pool(closure);
  }
  return {};
}

}  // namespace toftwin::discover
