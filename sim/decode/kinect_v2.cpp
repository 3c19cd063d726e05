// SPDX-License-Identifier: Apache-2.0
#include "sim/decode/kinect_v2.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <toftwin/nan.h>

#include "sim/decode/decode_steps.h"
#include "sim/decode/demodulate.h"
#include "sim/decode/unwrap.h"
#include "sim/images/rows.h"

namespace toftwin::sim {
namespace {

constexpr std::size_t kFrequencies = 3;

/// Holds what the steps hand on to each other.
class KinectDecoder {
 public:
  KinectDecoder(const Samples& samples, const DecodeSettings& settings, const DecodeRays& rays)
      : samples_(samples),
        settings_(settings),
        kinect_(settings.kinect),
        rays_(rays),
        width_(samples.width()),
        height_(samples.height()),
        steps_(samples.steps),
        zero_cycles_(zeroCycles(settings, kFrequencies)),
        // 80 MHz is three units of 240 MHz.
        unit_m_(settings.speed_of_light / (6.0 * samples.frequencies[0].in(hertz))),
        brightness_(width_, height_),
        is_edge_(width_, height_) {
    for (std::size_t f = 0; f < kFrequencies; ++f) {
      counts_[f] = kinect_.counts_per_electron * kinect_.amplitude_multipliers[f];
    }
    result_ = {.range_m = Image<float>{width_, height_},
               .amplitude = Image<float>{width_, height_},
               .ambient = Image<float>{width_, height_},
               .flags = Image<std::uint8_t>{width_, height_},
               .phasors = std::vector(kFrequencies, Image<std::complex<float>>{width_, height_})};
  }

  RangeImage decode() && {
    forRows(height_, [&](int first, int last) {
      for (int y = first; y < last; ++y) demodulate(y);
    });
    if (kinect_.bilateral_filter) {
      for (std::size_t f = 0; f < kFrequencies; ++f) filter(f);
    } else {
      filtered_ = result_.phasors;
    }
    forRows(height_, [&](int first, int last) {
      for (int y = first; y < last; ++y) measureRow(y);
    });
    if (kinect_.edge_filter) dropEdges();
    return std::move(result_);
  }

 private:
  void demodulate(int y) {
    const auto columns = static_cast<std::size_t>(width_);
    std::vector<float> unused(columns), amplitudes(columns);
    for (std::size_t f = 0; f < kFrequencies; ++f) {
      std::complex<float>* phasors = &result_.phasors[f](0, y);
      demodulateRow(samples_, steps_, f, y, phasors);
      takeOffPixelPhase(settings_, f, y, {phasors, columns});
      polarRow(phasors, columns, 0.0F, unused.data(), amplitudes.data());
      for (std::size_t x = 0; x < columns; ++x) {
        result_.amplitude(static_cast<int>(x), y) +=
            amplitudes[x] / static_cast<float>(kFrequencies);
      }
    }
    unmodulatedRow(samples_, y, &result_.ambient(0, y));
  }

  /// Saturated pixels have no phase that others could take.
  void filter(std::size_t f) {
    const auto least = static_cast<float>(kinect_.bilateral_threshold_counts / counts_[f]);
    Image<std::complex<float>> clean = result_.phasors[f];
    for (std::size_t i = 0; i < samples_.flags.size(); ++i) {
      if (has(samples_.flags[i], PixelFlag::Saturated)) clean[i] = 0.0F;
    }
    FilteredPhasors filtered = bilateralFilter(clean, least);
    for (std::size_t i = 0; i < is_edge_.size(); ++i) {
      if (filtered.unlikeness[i] >= static_cast<float>(kinect_.edge_unlikeness)) is_edge_[i] = 1;
    }
    filtered_.push_back(std::move(filtered.phasors));
  }

  void measureRow(int y) {
    const auto columns = static_cast<std::size_t>(width_);
    std::array<std::vector<float>, kFrequencies> cycles, amplitudes;
    for (std::size_t f = 0; f < kFrequencies; ++f) {
      cycles[f].resize(columns);
      amplitudes[f].resize(columns);
      polarRow(&filtered_[f](0, y), columns, zero_cycles_[f], cycles[f].data(),
               amplitudes[f].data());
      if (f < settings_.true_cycles.size() && settings_.true_cycles[f].size() > 1) {
        linearise(settings_.true_cycles[f], cycles[f]);
      }
    }
    for (std::size_t x = 0; x < columns; ++x) {
      std::array<double, kFrequencies> phase{}, counts{};
      for (std::size_t f = 0; f < kFrequencies; ++f) {
        phase[f] = static_cast<double>(cycles[f][x]);
        counts[f] = static_cast<double>(amplitudes[f][x]) * counts_[f];
      }
      const int column = static_cast<int>(x);
      std::uint8_t flags = samples_.flags.empty() ? std::uint8_t{0} : samples_.flags(column, y);
      const double range_m = measure(phase, counts, column, y, flags);
      if (std::isnan(range_m)) raise(flags, PixelFlag::Invalid);
      result_.range_m(column, y) = has(flags, PixelFlag::Invalid) ? kNaN : static_cast<float>(range_m);
      result_.flags(column, y) = flags;
      brightness_(column, y) = static_cast<float>(counts[0] + counts[1] + counts[2]);
    }
  }

  double measure(const std::array<double, kFrequencies>& cycles,
                 const std::array<double, kFrequencies>& counts, int x, int y,
                 std::uint8_t& flags) const {
    if (has(flags, PixelFlag::Saturated)) raise(flags, PixelFlag::Invalid);
    const double weakest = *std::min_element(counts.begin(), counts.end());
    const double strongest = *std::max_element(counts.begin(), counts.end());
    if (!(weakest > 0.0 && weakest >= kinect_.least_counts &&
          counts[0] + counts[1] + counts[2] >= kinect_.least_sum_counts)) {
      reject(flags, PixelFlag::LowAmplitude);
      return static_cast<double>(kNaN);
    }
    const Unwrapped joined = unwrapKinectV2(cycles[0], cycles[1], cycles[2], unit_m_);
    if (joined.deviation_rad > allowedDeviation(joined.deviation_rad, strongest)) {
      reject(flags, PixelFlag::UnwrapUnreliable);
    }
    const double ray_x = rays_.x.empty() ? 0.0 : static_cast<double>(rays_.x(x, y));
    const double range_m = rangeOfWay(joined.range_m, ray_x, settings_);
    const double depth_m = range_m * rayZ(x, y);
    if (!(depth_m >= settings_.nearest.in(metre) && depth_m <= settings_.farthest.in(metre))) {
      reject(flags, PixelFlag::OutOfRange);
    }
    return range_m;
  }

  /// The threshold lies between the two; only a deviation that does, too, is worth two
  /// transcendental functions.
  [[nodiscard]] double allowedDeviation(double deviation_rad, double strongest_counts) const {
    const double weak_rad = settings_.unwrap_threshold.in(radian);
    const double strong_rad = kinect_.strong_unwrap_threshold.in(radian);
    if (deviation_rad <= strong_rad || deviation_rad > weak_rad) return weak_rad;
    return kinectV2Threshold(strongest_counts, strong_rad, weak_rad);
  }

  [[nodiscard]] double rayZ(int x, int y) const {
    return rays_.z.empty() ? 1.0 : static_cast<double>(rays_.z(x, y));
  }

  void dropEdges() {
    Image<float> depth_m{width_, height_};
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x)
        depth_m(x, y) = result_.range_m(x, y) * static_cast<float>(rayZ(x, y));
    }
    const Image<std::uint8_t> drops = edgePixels(depth_m, is_edge_, brightness_);
    for (std::size_t i = 0; i < drops.size(); ++i) {
      if (drops[i] == 0) continue;
      reject(result_.flags[i], PixelFlag::Mixed);
      result_.range_m[i] = kNaN;
    }
  }

  const Samples& samples_;
  const DecodeSettings& settings_;
  const DecodeSettings::KinectV2& kinect_;
  const DecodeRays& rays_;
  int width_, height_;
  Steps steps_;
  std::vector<float> zero_cycles_;
  double unit_m_;
  std::array<double, kFrequencies> counts_{};  ///< of the device per electron of amplitude
  RangeImage result_;
  std::vector<Image<std::complex<float>>> filtered_;
  Image<float> brightness_;  ///< sum of the amplitudes in counts
  Image<std::uint8_t> is_edge_;
};

}  // namespace

double kinectV2Threshold(double counts, double strong_rad, double weak_rad) {
  // ln threshold = (ln counts · slope · log₁₀2 + offset) · log₂10
  constexpr double kSlope = -0.5330578, kOffset = 0.7694894;
  const double exponent = (std::log(counts) * kSlope * 0.301030 + kOffset) * 3.321928;
  return std::clamp(std::exp(exponent), strong_rad, std::max(strong_rad, weak_rad));
}

RangeImage decodeKinectV2(const Samples& samples, const DecodeSettings& settings,
                          const DecodeRays& rays) {
  return KinectDecoder{samples, settings, rays}.decode();
}

}  // namespace toftwin::sim
