// SPDX-License-Identifier: Apache-2.0
#include "sim/decode/decode.h"

#include <algorithm>
#include <cmath>

#include <toftwin/frame.h>
#include <toftwin/nan.h>

#include "sim/decode/decode_steps.h"
#include "sim/decode/demodulate.h"
#include "sim/decode/kinect_v2.h"
#include "sim/decode/pulsed.h"
#include "sim/decode/unwrap.h"
#include "sim/images/rows.h"

namespace toftwin::sim {
namespace {

/// Decodes row by row; holds what all rows share.
class Decoder {
 public:
  Decoder(const Samples& samples, const DecodeSettings& settings, const DecodeRays& rays,
          RangeImage& result)
      : samples_(samples),
        settings_(settings),
        rays_(rays),
        result_(result),
        steps_(samples.steps),
        unwrap_(samples.frequencies, settings.speed_of_light),
        zero_cycles_(zeroCycles(settings, samples.frequencies.size())) {}

  void row(int y) const {
    const std::size_t frequencies = samples_.frequencies.size();
    const auto width = static_cast<std::size_t>(samples_.width());
    std::vector<float> cycles(frequencies * width), amplitudes(frequencies * width),
        asymmetry(width);
    for (std::size_t f = 0; f < frequencies; ++f) {
      demodulateRow(samples_, steps_, f, y, &result_.phasors[f](0, y));
      takeOffPixelPhase(settings_, f, y, {&result_.phasors[f](0, y), width});
      polarRow(&result_.phasors[f](0, y), width, zero_cycles_[f], &cycles[f * width],
               &amplitudes[f * width]);
      if (f < settings_.true_cycles.size() && settings_.true_cycles[f].size() > 1) {
        linearise(settings_.true_cycles[f], {&cycles[f * width], width});
      }
    }
    unmodulatedRow(samples_, y, &result_.ambient(0, y));
    asymmetryRow(samples_, y, asymmetry.data());
    std::vector<double> pixel_cycles(frequencies), pixel_amplitudes(frequencies);
    for (std::size_t x = 0; x < width; ++x) {
      double sum = 0.0;
      for (std::size_t f = 0; f < frequencies; ++f) {
        pixel_cycles[f] = static_cast<double>(cycles[f * width + x]);
        pixel_amplitudes[f] = static_cast<double>(amplitudes[f * width + x]);
        sum += pixel_amplitudes[f];
      }
      pixel(pixel_cycles, pixel_amplitudes, sum / static_cast<double>(frequencies),
            static_cast<double>(asymmetry[x]), static_cast<int>(x), y);
    }
  }

 private:
  void pixel(const std::vector<double>& cycles, const std::vector<double>& amplitudes,
             double mean_amplitude, double asymmetry, int x, int y) const {
    std::uint8_t flags = samples_.flags.empty() ? std::uint8_t{0} : samples_.flags(x, y);
    if (asymmetry > settings_.asymmetry_threshold * mean_amplitude)
      raise(flags, PixelFlag::Asymmetric);
    const double range_m = measure(cycles, amplitudes, x, y, flags);
    if (std::isnan(range_m)) raise(flags, PixelFlag::Invalid);
    result_.range_m(x, y) = has(flags, PixelFlag::Invalid) ? kNaN : static_cast<float>(range_m);
    result_.amplitude(x, y) = static_cast<float>(mean_amplitude);
    result_.flags(x, y) = flags;
  }

  /// The range, and the flags that say why it is not to be trusted.
  [[nodiscard]] double measure(const std::vector<double>& cycles,
                               const std::vector<double>& amplitudes, int x, int y,
                               std::uint8_t& flags) const {
    const double weakest = *std::min_element(amplitudes.begin(), amplitudes.end());
    if (has(flags, PixelFlag::Saturated)) raise(flags, PixelFlag::Invalid);
    if (!(weakest > 0.0 && weakest >= settings_.minimum_amplitude)) {
      reject(flags, PixelFlag::LowAmplitude);
      return static_cast<double>(kNaN);
    }
    const Unwrapped joined = unwrap_(cycles, amplitudes);
    if (joined.deviation_rad > settings_.unwrap_threshold.in(radian)) {
      reject(flags, PixelFlag::UnwrapUnreliable);
    }
    const double ray_x = rays_.x.empty() ? 0.0 : static_cast<double>(rays_.x(x, y));
    const double range_m = rangeOfWay(joined.range_m, ray_x, settings_);
    if (!(range_m >= settings_.nearest.in(metre) && range_m <= settings_.farthest.in(metre))) {
      reject(flags, PixelFlag::OutOfRange);
    }
    return range_m;
  }

  const Samples& samples_;
  const DecodeSettings& settings_;
  const DecodeRays& rays_;
  RangeImage& result_;
  Steps steps_;
  Unwrapper unwrap_;
  std::vector<float> zero_cycles_;  ///< in [0, 1)
};

}  // namespace

RangeImage decode(const Samples& samples, const DecodeSettings& settings,
                  const DecodeRays& rays) {
  if (settings.algorithm == DecodeSettings::Algorithm::KinectV2) {
    return decodeKinectV2(samples, settings, rays);
  }
  if (settings.algorithm == DecodeSettings::Algorithm::Pulsed)
    return decodePulsed(samples, settings, rays);
  const int width = samples.width(), height = samples.height();
  RangeImage result{.range_m = Image<float>{width, height},
                    .amplitude = Image<float>{width, height},
                    .ambient = Image<float>{width, height},
                    .flags = Image<std::uint8_t>{width, height},
                    .phasors = std::vector(samples.frequencies.size(),
                                           Image<std::complex<float>>{width, height})};
  const Decoder decoder{samples, settings, rays, result};
  forRows(height, [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) decoder.row(y);
  });
  return result;
}

}  // namespace toftwin::sim
