// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/light_images.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <type_traits>
#include <utility>

namespace toftwin::sim {

void LightImages::use(Channels channels, Channels indirect) {
  channels_ = std::move(channels);
  indirect_channels_ = std::move(indirect);
  direct_of_indirect_.clear();
  for (const std::size_t term : indirect_channels_.terms()) {
    const auto at = std::ranges::lower_bound(channels_.terms(), term);
    direct_of_indirect_.push_back(static_cast<std::size_t>(at - channels_.terms().begin()));
  }
}

void LightImages::resize(const TraceRequest& request) {
  const int w = request.camera.width, h = request.camera.height;
  const auto fit = [&](auto& image) {
    if (image.width() != w || image.height() != h) image = std::remove_reference_t<decltype(image)>(w, h);
  };
  light_.frequencies = request.frequencies;
  light_.harmonics = request.harmonics;
  light_.phasors.resize(request.frequencies.size() * static_cast<std::size_t>(request.harmonics));
  light_.variance.resize(request.frequencies.size());
  for (std::size_t term = 0; term < light_.phasors.size(); ++term) {
    if (std::ranges::find(channels_.shown(), term, &Channels::Shown::term) != channels_.shown().end()) {
      fit(light_.phasors[term]);
    } else {
      light_.phasors[term] = {};
    }
  }
  std::for_each(light_.variance.begin(), light_.variance.end(), fit);
  fit(light_.steady);
  fit(light_.ambient);
  fit(light_.truth.range_m);
  fit(light_.truth.normal);
  fit(light_.truth.albedo);
}

void LightImages::storeTruth(const Part& at, const TruthLanes& truth) {
  at.store(light_.truth.range_m, [&](std::size_t i, float) { return truth.range_m[i]; });
  at.store(light_.truth.albedo, [&](std::size_t i, float) { return truth.albedo[i]; });
  at.store(light_.truth.normal, [&](std::size_t i, Vec3f) { return truth.normal[i]; });
}

TOFTWIN_VECTOR
void LightImages::fold(LaneSums& sums) const {
  for (const Channels::Fold& fold : channels_.folds()) {
    const std::size_t from = channels_.lanes()[fold.phasor], to = channels_.lanes()[fold.first];
    const float a = fold.weight.real(), b = fold.weight.imag(), sign = fold.is_mirrored ? -1.0f : 1.0f;
    const Lanes<float> re = sums.re[from], im = sums.im[from];
    Lanes<float> first_re = sums.re[to], first_im = sums.im[to];
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      first_re[i] += a * re[i] - b * im[i];
      first_im[i] += sign * (a * im[i] + b * re[i]);
    }
    sums.re[to] = first_re;
    sums.im[to] = first_im;
  }
}

void LightImages::storeDirect(const Part& at, const LaneSums& sums) {
  storeSums(at, sums);
  for (Image<float>& variance : light_.variance) at.store(variance, [](std::size_t, float) { return 0.0f; });
}

void LightImages::storeSums(const Part& at, const LaneSums& sums) {
  at.copy(light_.steady, sums.steady);
  at.copy(light_.ambient, sums.ambient);
  for (const auto& [term, phasor] : channels_.shown()) {
    const std::size_t lanes = channels_.lanes()[phasor];
    at.copy(light_.phasors[term], sums.re[lanes], sums.im[lanes]);
  }
}

void LightImages::storeMeans(const LaneSums& sums, std::size_t first_lane, unsigned samples, Pixel pixel) {
  const auto [x, y] = pixel;
  const auto mean = [&](const Lanes<float>& lanes) {
    double sum = 0.0;
    for (std::size_t i = first_lane; i < first_lane + samples; ++i) sum += static_cast<double>(lanes[i]);
    return sum / samples;
  };
  light_.steady(x, y) = static_cast<float>(mean(sums.steady));
  light_.ambient(x, y) = static_cast<float>(mean(sums.ambient));
  for (const auto& [term, phasor] : channels_.shown()) {
    const std::size_t lanes = channels_.lanes()[phasor];
    light_.phasors[term](x, y) =
        std::complex<float>{std::complex<double>{mean(sums.re[lanes]), mean(sums.im[lanes])}};
  }
  for (std::size_t f = 0; f < light_.variance.size(); ++f) {
    const std::size_t first = channels_.lanes()[channels_.first(f)];
    const Lanes<float>&re = sums.re[first], &im = sums.im[first];
    Lanes<float> squares;
    for (std::size_t i = 0; i < kLaneCount; ++i) squares[i] = re[i] * re[i] + im[i] * im[i];
    const double spread = std::max(0.0, mean(squares) - std::norm(std::complex<double>{mean(re), mean(im)}));
    light_.variance[f](x, y) = static_cast<float>(spread / (2.0 * (samples - 1.0)));
  }
}

void LightImages::addSpread(const Part& at, const IndirectLight::Spread& spread) {
  const LaneSums& sums = spread.sums;
  at.store(light_.steady, [&](std::size_t i, float before) { return before + sums.steady[i]; });
  at.store(light_.ambient, [&](std::size_t i, float before) { return before + sums.ambient[i]; });
  for (std::size_t k = 0; k < indirect_channels_.terms().size(); ++k) {
    const std::size_t lanes = indirect_channels_.lanes()[k];
    const Lanes<float>&re = sums.re[lanes], &im = sums.im[lanes];
    at.store(light_.phasors[indirect_channels_.terms()[k]], [&](std::size_t i, std::complex<float> before) {
      return std::complex<float>{before.real() + re[i], before.imag() + im[i]};
    });
  }
  for (std::size_t f = 0; f < spread.variance.size(); ++f) {
    at.store(light_.variance[f], [&](std::size_t i, float before) { return before + spread.variance[f][i]; });
  }
}

void LightImages::storeWithSpread(const Part& at, const IndirectLight::Spread& spread, LaneSums& direct) {
  const auto add = [](const Lanes<float>& from, Lanes<float>& to) {
    for (std::size_t i = 0; i < kLaneCount; ++i) to[i] += from[i];
  };
  add(spread.sums.steady, direct.steady);
  add(spread.sums.ambient, direct.ambient);
  for (std::size_t k = 0; k < direct_of_indirect_.size(); ++k) {
    const std::size_t from = indirect_channels_.lanes()[k], to = channels_.lanes()[direct_of_indirect_[k]];
    add(spread.sums.re[from], direct.re[to]);
    add(spread.sums.im[from], direct.im[to]);
  }
  storeSums(at, direct);
  for (std::size_t f = 0; f < spread.variance.size(); ++f) at.copy(light_.variance[f], spread.variance[f]);
}

}  // namespace toftwin::sim
