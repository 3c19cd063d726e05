// SPDX-License-Identifier: Apache-2.0
// Learned terms of the light that reaches the pixels.
#include <algorithm>
#include <cmath>
#include <complex>
#include <map>
#include <string>
#include <utility>

#include "sim/effects/between_pixels.h"
#include "sim/effects/learned/covariates.h"
#include "sim/effects/learned/learned.h"
#include "sim/effects/learned/sums.h"
#include "sim/effects/phasors.h"
#include "sim/effects/resample.h"
#include "sim/images/box_mean.h"

namespace toftwin::sim {
namespace {

using terms::Carrier;
using terms::ImageTerms;
using terms::Quantity;

/// Sums of terms in the pixels of one light, whose covariates are made once.
class LightSums {
 public:
  LightSums(const Light& light, const Conditions& now) : light_(light), now_(now) {}

  Image<float> of(const ImageTerms& terms) {
    std::vector<const Image<float>*> covariates;
    for (const std::string& name : terms.perPixel()) covariates.push_back(&imageOf(name));
    Image<float> sums{light_.width(), light_.height()};
    forRows(light_.height(), [&](int first_row, int last_row) {
      std::vector<double> row(static_cast<std::size_t>(light_.width()));
      for (int y = first_row; y < last_row; ++y) {
        std::ranges::fill(row, 0.0);
        terms.addRow(y, [&](std::size_t which, std::span<double> out) {
          std::ranges::copy_n(&(*covariates[which])(0, y), static_cast<std::ptrdiff_t>(out.size()), out.begin());
        }, row);
        std::ranges::transform(row, &sums(0, y), [](double sum) { return static_cast<float>(sum); });
      }
    });
    return sums;
  }

 private:
  const Image<float>& imageOf(const std::string& name) {
    const auto known = images_.find(name);
    if (known != images_.end()) return known->second;
    return images_.emplace(name, learnedCovariate(name)->of_light(light_, now_)).first->second;
  }

  const Light& light_;
  const Conditions& now_;
  std::map<std::string, Image<float>> images_;
};

/// P̃(p) = P(p + s e)
Light shifted(Light light, const Image<float>& outward_px, const Conditions& now) {
  return resampled(std::move(light), [&](int x, int y) {
    const double across = now.left + x - now.camera.cx, down = now.top + y - now.camera.cy;
    const double radius = std::hypot(across, down);
    const double share = radius > 0.0 ? static_cast<double>(outward_px(x, y)) / radius : 0.0;
    return std::pair{x + share * across, y + share * down};
  });
}

/// What a term's light is a share of, in each pixel.
template <class T>
Image<T> carriedLight(const Image<T>& source, const CarriedTerms& terms, const Conditions& now) {
  if (terms.carrier == Carrier::Row) return boxMean(source, source.width(), 0);
  if (terms.carrier == Carrier::Column) return boxMean(source, 0, source.height());
  const Image<T> mean = boxMean(source, static_cast<int>(terms.carried[0]));
  if (terms.carrier == Carrier::Square) return mean;
  const double across = 2.0 * (now.camera.cx + terms.carried[1] - now.left),
               along = 2.0 * (now.camera.cy + terms.carried[2] - now.top);
  Image<T> mirrored{source.width(), source.height()};
  for (int y = 0; y < source.height(); ++y)
    for (int x = 0; x < source.width(); ++x) mirrored(x, y) = lightAt(mean, across - x, along - y);
  return mirrored;
}

void addGain(Light& light, const Image<float>& by_percent) {
  const auto brightened = [&](auto& image) {
    for (std::size_t i = 0; i < image.size(); ++i) image[i] *= 1.0F + 0.01F * by_percent[i];
  };
  for (auto& phasors : light.phasors) brightened(phasors);
  brightened(light.steady);
}

/// P (1 + g) + Σ sₖ ⟨P⟩ₖ; the camera's own light alone has a gain.
void addLight(Light& light, const std::vector<CarriedTerms>& groups, LightSums& sums, const Conditions& now) {
  std::vector<std::pair<const CarriedTerms*, Image<float>>> shares;
  Image<float> gain;
  for (const CarriedTerms& group : groups) {
    if (group.carrier == Carrier::One) gain = sums.of(group.sum);
    else shares.emplace_back(&group, sums.of(group.sum));
  }
  const Light source = shares.empty() ? Light{} : light;
  if (!gain.empty()) addGain(light, gain);
  const auto add = [&]<class T>(Image<T>& image, const Image<T>& from) {
    if (from.empty()) return;
    for (const auto& [group, percent] : shares) {
      const Image<T> carried = carriedLight(from, *group, now);
      for (std::size_t i = 0; i < image.size(); ++i) image[i] += 0.01F * percent[i] * carried[i];
    }
  };
  for (std::size_t i = 0; i < source.phasors.size(); ++i) add(light.phasors[i], source.phasors[i]);
  add(light.steady, source.steady);
  add(light.ambient, source.ambient);
}

/// Pₙ → Pₙ exp(−i 4π n f t/c)
void delayBy(Light& light, const Image<float>& by_mm) {
  for (std::size_t f = 0; f < light.frequencies.size(); ++f) {
    const double turn_per_mm = phaseOfRange(1_mm, light.frequencies[f]);
    for (int n = 1; n <= light.harmonics; ++n) {
      auto& phasors = light.phasor(f, n);
      for (std::size_t i = 0; i < phasors.size(); ++i)
        phasors[i] *= std::complex<float>{std::polar(1.0, -n * turn_per_mm * static_cast<double>(by_mm[i]))};
    }
  }
}

}  // namespace

Light Learned::apply(Light light, const Conditions& now, const Random&) const {
  if (terms.list().empty() || stage() != terms::Stage::Light) return light;
  const auto of = [&](Quantity quantity) {
    return carriedTermsOf(terms.list(), quantity, light.width(), light.height(), now);
  };
  // Sums of the light as it came, before anything of it moves.
  LightSums sums{light, now};
  Image<float> outward_px, delay_mm;
  for (const CarriedTerms& group : of(Quantity::OutwardPx)) outward_px = sums.of(group.sum);
  for (const CarriedTerms& group : of(Quantity::DelayMm)) delay_mm = sums.of(group.sum);
  const std::vector<CarriedTerms> percent = of(Quantity::LightPercent);
  Light changed = light;
  if (!outward_px.empty()) changed = shifted(std::move(changed), outward_px, now);
  if (!percent.empty()) addLight(changed, percent, sums, now);
  if (!delay_mm.empty()) delayBy(changed, delay_mm);
  return changed;
}

}  // namespace toftwin::sim
