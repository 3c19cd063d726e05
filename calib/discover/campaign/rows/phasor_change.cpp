// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/rows/phasor_change.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <toftwin/nan.h>

namespace toftwin::discover {

std::size_t highestOf(const sim::Light& light) {
  return static_cast<std::size_t>(std::ranges::max_element(light.frequencies) - light.frequencies.begin());
}

Reading changeBy(const Phasors& share, double period_m) {
  Reading change{Image<float>(share.width(), share.height()), {}};
  change.log_amplitude = change.range_m;
  const auto metres = static_cast<float>(period_m / (2.0 * std::numbers::pi));
  for (std::size_t i = 0; i < share.size(); ++i) {
    change.range_m[i] = -metres * share[i].imag();
    change.log_amplitude[i] = share[i].real();
  }
  return change;
}

Phasors phasorOf(const Reading& reading, double period_m) {
  Phasors z(reading.range_m.width(), reading.range_m.height(), {kNaN, kNaN});
  for (std::size_t i = 0; i < z.size(); ++i) {
    const double phase = 2.0 * std::numbers::pi * static_cast<double>(reading.range_m[i]) / period_m;
    const double size = std::exp(static_cast<double>(reading.log_amplitude[i]));
    if (std::isfinite(phase) && std::isfinite(size))
      z[i] = {static_cast<float>(size * std::cos(phase)), static_cast<float>(-size * std::sin(phase))};
  }
  return z;
}

Phasors withUnread(Phasors z, const Image<std::complex<float>>& light) {
  const auto isRead = [&](std::size_t i) { return std::isfinite(std::norm(z[i])) && std::isfinite(std::norm(light[i])); };
  std::complex<double> products{};
  double squares = 0.0;
  for (std::size_t i = 0; i < z.size(); ++i) {
    if (!isRead(i)) continue;
    products += std::complex<double>{z[i]} * std::conj(std::complex<double>{light[i]});
    squares += std::norm(std::complex<double>{light[i]});
  }
  if (!(squares > 0.0)) return z;
  const std::complex<float> per_light{products / squares};
  for (std::size_t i = 0; i < z.size(); ++i)
    if (!isRead(i)) z[i] = per_light * light[i];
  return z;
}

Phasors shareOf(const Phasors& z, const std::function<std::complex<float>(std::size_t)>& change) {
  Phasors share(z.width(), z.height());
  for (std::size_t i = 0; i < z.size(); ++i) {
    const std::complex<float> of = change(i) / z[i];
    if (std::isfinite(of.real()) && std::isfinite(of.imag())) share[i] = of;
  }
  return share;
}

}  // namespace toftwin::discover
