// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/image_filters.h"

#include <cmath>
#include <utility>

#include "sim/effects/bilateral_filter.h"
#include "sim/effects/median_filter.h"
#include "sim/effects/neighbours.h"
#include "sim/effects/temporal_filter.h"

namespace toftwin::drivers::simulator {
namespace {

using Picture = Image<float>;
using Spatial = FilterSettings::Spatial;
using Temporal = FilterSettings::Temporal;

constexpr Length kNoLimit = 1e12_m;  // amplitudes of any difference are alike

/// An effect on ranges, of any image.
template <class Effect>
Picture byEffect(const Effect& effect, Picture picture, const Picture* before = nullptr) {
  sim::RangeImage image, last;
  image.range_m = std::move(picture);
  const Moment moment;
  const CameraInfo camera;
  sim::Conditions now{.moment = moment, .camera = camera};
  if (before != nullptr) {
    last.range_m = *before;
    now.before.range = &last;
  }
  return effect.apply(std::move(image), now, sim::Random{0, 0, 0}).range_m;  // none draws
}

Picture meanOfWindow(const Picture& picture, int reach) {
  Picture mean = picture;
  sim::replaceRanges(mean, [&](int x, int y) {
    float sum = 0.0F, count = 0.0F;
    sim::forValidAround(picture, x, y, reach, [&](float value, int, int) {
      sum += value;
      count += 1.0F;
    });
    return sum / count;
  });
  return mean;
}

Picture overTheImage(const FilterSettings& settings, Picture picture, Length alike) {
  switch (settings.spatial) {
    case Spatial::None:
      break;
    case Spatial::Median:
      return byEffect(sim::MedianFilter{.reach = settings.reach}, std::move(picture));
    case Spatial::Mean:
      return meanOfWindow(picture, settings.reach);
    case Spatial::Bilateral:
      // It reaches two sigma far.
      return byEffect(sim::BilateralFilter{.sigma = 0.5 * settings.reach, .sigma_range = alike},
                      std::move(picture));
  }
  return picture;
}

/// `of` says which image of a frame. Where a pixel was invalid before, that frame does not count.
Picture meanOfFrames(Picture picture, const std::deque<sim::RangeImage>& before,
                     Picture sim::RangeImage::*of) {
  const Picture now = picture;
  sim::replaceRanges(picture, [&](int x, int y) {
    float sum = now(x, y), count = 1.0F;
    for (const sim::RangeImage& one : before) {
      if (std::isnan(one.range_m(x, y))) continue;
      sum += (one.*of)(x, y);
      count += 1.0F;
    }
    return sum / count;
  });
  return picture;
}

}  // namespace

void ImageFilters::apply(const FilterSettings& settings, sim::RangeImage& image) {
  if (!settings.areOn()) return before_.clear();
  if (settings.of_range)
    image.range_m = overTheImage(settings, std::move(image.range_m), sim::BilateralFilter{}.sigma_range);
  if (settings.of_amplitude) image.amplitude = overTheImage(settings, std::move(image.amplitude), kNoLimit);
  if (settings.temporal == Temporal::None) return before_.clear();
  const std::size_t others =
      settings.temporal == Temporal::Mean ? static_cast<std::size_t>(settings.images) - 1 : 1;
  while (before_.size() > others) before_.pop_front();
  sim::RangeImage kept;
  kept.range_m = image.range_m;
  kept.amplitude = image.amplitude;
  if (settings.temporal == Temporal::Mean) {
    if (settings.of_range)
      image.range_m = meanOfFrames(std::move(image.range_m), before_, &sim::RangeImage::range_m);
    if (settings.of_amplitude)
      image.amplitude = meanOfFrames(std::move(image.amplitude), before_, &sim::RangeImage::amplitude);
  } else if (!before_.empty()) {
    const sim::RangeImage& last = before_.back();
    if (settings.of_range)
      image.range_m = byEffect(sim::TemporalFilter{}, std::move(image.range_m), &last.range_m);
    if (settings.of_amplitude) {
      image.amplitude =
          byEffect(sim::TemporalFilter{.jump = kNoLimit}, std::move(image.amplitude), &last.amplitude);
    }
  }
  if (settings.temporal == Temporal::Exponential) {
    kept.range_m = image.range_m;
    kept.amplitude = image.amplitude;
  }
  before_.push_back(std::move(kept));
  if (before_.size() > others) before_.pop_front();
}

}  // namespace toftwin::drivers::simulator
