// SPDX-License-Identifier: Apache-2.0
#include "sim/decode/decode.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include <toftwin/frame.h>

#include "sim/decode/demodulate.h"
#include "sim/decode/unwrap.h"
#include "sim/images/rows.h"

namespace toftwin::sim {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr bool has(std::uint8_t flags, PixelFlag flag) {
  return (flags & static_cast<unsigned>(flag)) != 0;
}
constexpr void raise(std::uint8_t& flags, PixelFlag flag) {
  flags = static_cast<std::uint8_t>(flags | static_cast<unsigned>(flag));
}

constexpr void reject(std::uint8_t& flags, PixelFlag why) {
  raise(flags, PixelFlag::Invalid);
  raise(flags, why);
}

/// Half the length of the light's way → range, for an emitter at distance L along x from the lens.
/// With s the whole way and u the ray's x component, |r u⃗ − L x⃗| = s − r gives
///     r = (s² − L²) / (2 (s − L u))
/// and libfreenect2 drops L² in it.
double rangeOfWay(double half_way_m, double ray_x, const DecodeSettings& settings) {
  const double baseline_m = settings.baseline_length.in(metre);
  if (baseline_m == 0.0) return half_way_m;
  const double way_m = 2.0 * half_way_m;
  const double square =
      settings.baseline == DecodeSettings::Baseline::Exact ? baseline_m * baseline_m : 0.0;
  return (way_m * way_m - square) / (2.0 * (way_m - baseline_m * ray_x));
}

/// The cycles, in [0, 1), that the factory's table gives for those seen.
void linearise(const std::vector<float>& true_cycles, std::span<float> cycles) {
  const auto last = static_cast<float>(true_cycles.size() - 1);
  for (float& seen : cycles) {
    if (std::isnan(seen)) continue;
    const float at = std::clamp(seen, 0.0F, 1.0F) * last;
    const float below = std::min(std::floor(at), last - 1.0F);
    const auto i = static_cast<std::size_t>(below);
    const float true_value = std::lerp(true_cycles[i], true_cycles[i + 1], at - below);
    seen = true_value - std::floor(true_value);
  }
}

/// Decodes row by row; holds what all rows share.
class Decoder {
 public:
  Decoder(const Samples& samples, const DecodeSettings& settings, const Image<float>& ray_x,
          RangeImage& result)
      : samples_(samples),
        settings_(settings),
        ray_x_(ray_x),
        result_(result),
        steps_(samples.steps),
        unwrap_(samples.frequencies, settings.speed_of_light),
        zero_cycles_(samples.frequencies.size(), 0.0F) {
    for (std::size_t f = 0; f < std::min(settings.zero_phase.size(), zero_cycles_.size()); ++f) {
      const double zero = settings.zero_phase[f].in(radian) / (2.0 * std::numbers::pi);
      zero_cycles_[f] = static_cast<float>(zero - std::floor(zero));
    }
    // 80 MHz is three units of 240 MHz.
    if (isKinect()) unit_m_ = settings.speed_of_light / (6.0 * samples.frequencies[0].in(hertz));
  }

  void row(int y) const {
    const std::size_t frequencies = samples_.frequencies.size();
    const auto width = static_cast<std::size_t>(samples_.width());
    std::vector<float> cycles(frequencies * width), amplitudes(frequencies * width),
        asymmetry(width);
    for (std::size_t f = 0; f < frequencies; ++f) {
      demodulateRow(samples_, steps_, f, y, &result_.phasors[f](0, y));
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
  [[nodiscard]] bool isKinect() const {
    return settings_.algorithm == DecodeSettings::Algorithm::KinectV2;
  }

  void pixel(const std::vector<double>& cycles, const std::vector<double>& amplitudes,
             double mean_amplitude, double asymmetry, int x, int y) const {
    std::uint8_t flags = samples_.flags.empty() ? std::uint8_t{0} : samples_.flags(x, y);
    if (asymmetry > settings_.asymmetry_threshold * mean_amplitude)
      raise(flags, PixelFlag::Asymmetric);
    const double range_m = measure(cycles, amplitudes, x, y, flags);
    if (std::isnan(range_m)) raise(flags, PixelFlag::Invalid);
    result_.range_m(x, y) = has(flags, PixelFlag::Invalid) ? kNan : static_cast<float>(range_m);
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
      return static_cast<double>(kNan);
    }
    const Unwrapped joined = isKinect() ? unwrapKinectV2(cycles[0], cycles[1], cycles[2], unit_m_)
                                        : unwrap_(cycles, amplitudes);
    if (joined.deviation_rad > allowedDeviation(joined.deviation_rad, weakest)) {
      reject(flags, PixelFlag::UnwrapUnreliable);
    }
    const double ray_x = ray_x_.empty() ? 0.0 : static_cast<double>(ray_x_(x, y));
    const double range_m = rangeOfWay(joined.range_m, ray_x, settings_);
    if (!(range_m >= settings_.nearest.in(metre) && range_m <= settings_.farthest.in(metre))) {
      reject(flags, PixelFlag::OutOfRange);
    }
    return range_m;
  }

  [[nodiscard]] double allowedDeviation(double deviation_rad, double weakest) const {
    const double weak_rad = settings_.unwrap_threshold.in(radian);
    const double strong_rad = settings_.strong_unwrap_threshold.in(radian);
    // The threshold lies between the two; only a deviation that does, too, is worth two
    // transcendental functions.
    if (!isKinect() || deviation_rad <= strong_rad || deviation_rad > weak_rad) return weak_rad;
    return kinectV2Threshold(weakest * settings_.counts_per_electron, strong_rad, weak_rad);
  }

  const Samples& samples_;
  const DecodeSettings& settings_;
  const Image<float>& ray_x_;
  RangeImage& result_;
  Steps steps_;
  Unwrapper unwrap_;
  std::vector<float> zero_cycles_;  ///< in [0, 1)
  double unit_m_ = 0.0;
};

}  // namespace

double kinectV2Threshold(double counts, double strong_rad, double weak_rad) {
  // ln threshold = (ln counts · slope · log₁₀2 + offset) · log₂10
  constexpr double kSlope = -0.5330578, kOffset = 0.7694894;
  const double exponent = (std::log(counts) * kSlope * 0.301030 + kOffset) * 3.321928;
  return std::clamp(std::exp(exponent), strong_rad, std::max(strong_rad, weak_rad));
}

RangeImage decode(const Samples& samples, const DecodeSettings& settings,
                  const Image<float>& ray_x) {
  const int width = samples.width(), height = samples.height();
  RangeImage result{.range_m = Image<float>{width, height},
                    .amplitude = Image<float>{width, height},
                    .ambient = Image<float>{width, height},
                    .flags = Image<std::uint8_t>{width, height},
                    .phasors = std::vector(samples.frequencies.size(),
                                           Image<std::complex<float>>{width, height})};
  const Decoder decoder{samples, settings, ray_x, result};
  forRows(height, [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) decoder.row(y);
  });
  return result;
}

}  // namespace toftwin::sim
