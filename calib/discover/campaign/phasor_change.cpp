// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/phasor_change.h"

#include <cmath>
#include <numbers>

#include <toftwin/nan.h>

namespace toftwin::discover {

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

Phasors shareOf(const Phasors& z, const std::function<std::complex<float>(std::size_t)>& change) {
  Phasors share(z.width(), z.height());
  for (std::size_t i = 0; i < z.size(); ++i) {
    const std::complex<float> of = change(i) / z[i];
    if (std::isfinite(of.real()) && std::isfinite(of.imag())) share[i] = of;
  }
  return share;
}

}  // namespace toftwin::discover
