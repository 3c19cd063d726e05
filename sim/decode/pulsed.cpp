// SPDX-License-Identifier: Apache-2.0
#include "sim/decode/pulsed.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/decode/decode_steps.h"
#include "sim/images/rows.h"

namespace toftwin::sim {
namespace {

/// What the gates of one pixel say.
struct Reading {
  double ratio, returned, ambient;
};

Reading readGates(const Samples& samples, PulseScheme scheme, int x, int y) {
  const auto charge = [&](int gate) { return static_cast<double>(samples.tap(0, gate, 0)(x, y)); };
  const bool has_ambient_gate = samples.steps > 2;
  const double ambient = has_ambient_gate ? charge(2) : 0.0;
  Reading reading{0.0, 0.0, has_ambient_gate ? ambient : 0.5 * (charge(0) + charge(1))};
  if (scheme == PulseScheme::ShortLong) {
    reading.returned = charge(1) - 2.0 * ambient;
    reading.ratio = 1.0 - (charge(0) - ambient) / reading.returned;
  } else {
    reading.returned = charge(0) + charge(1) - 2.0 * ambient;
    reading.ratio = (charge(1) - ambient) / reading.returned;
  }
  return reading;
}

double rangeOfRatio(double ratio, const DecodeSettings& settings) {
  const auto& table = settings.pulse_ranges_m;
  if (table.size() < 2)
    return 0.5 * settings.speed_of_light * settings.pulse_width.in(second)*ratio;
  const double at = ratio * static_cast<double>(table.size() - 1);
  const double below = std::clamp(std::floor(at), 0.0, static_cast<double>(table.size() - 2));
  const auto i = static_cast<std::size_t>(below);
  return std::lerp(table[i], table[i + 1], at - below);
}

double measure(const Reading& reading, const DecodeSettings& settings, double ray_x,
               std::uint8_t& flags) {
  if (has(flags, PixelFlag::Saturated)) raise(flags, PixelFlag::Invalid);
  if (!(reading.returned > 0.0 && reading.returned >= settings.minimum_amplitude)) {
    reject(flags, PixelFlag::LowAmplitude);
    return std::numeric_limits<double>::quiet_NaN();
  }
  const double range_m = rangeOfWay(rangeOfRatio(reading.ratio, settings), ray_x, settings);
  const bool is_inside = reading.ratio >= 0.0 && reading.ratio <= 1.0;
  if (!is_inside ||
      !(range_m >= settings.nearest.in(metre) && range_m <= settings.farthest.in(metre))) {
    reject(flags, PixelFlag::OutOfRange);
  }
  return range_m;
}

}  // namespace

RangeImage decodePulsed(const Samples& samples, const DecodeSettings& settings,
                        const DecodeRays& rays) {
  const int width = samples.width(), height = samples.height();
  RangeImage result{.range_m = Image<float>{width, height},
                    .amplitude = Image<float>{width, height},
                    .ambient = Image<float>{width, height},
                    .flags = Image<std::uint8_t>{width, height},
                    .phasors = {}};
  forRows(height, [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) {
      for (int x = 0; x < width; ++x) {
        const Reading reading = readGates(samples, settings.pulse_scheme, x, y);
        std::uint8_t flags = samples.flags.empty() ? std::uint8_t{0} : samples.flags(x, y);
        const double ray_x = rays.x.empty() ? 0.0 : static_cast<double>(rays.x(x, y));
        const double range_m = measure(reading, settings, ray_x, flags);
        if (std::isnan(range_m)) raise(flags, PixelFlag::Invalid);
        result.range_m(x, y) = has(flags, PixelFlag::Invalid)
                                   ? std::numeric_limits<float>::quiet_NaN()
                                   : static_cast<float>(range_m);
        result.amplitude(x, y) = static_cast<float>(reading.returned);
        result.ambient(x, y) = static_cast<float>(reading.ambient);
        result.flags(x, y) = flags;
      }
    }
  });
  return result;
}

}  // namespace toftwin::sim
