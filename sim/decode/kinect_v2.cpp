// SPDX-License-Identifier: Apache-2.0
#include "sim/decode/kinect_v2.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <toftwin/nan.h>

#include "sim/decode/decode_steps.h"
#include "sim/decode/demodulate.h"
#include "sim/decode/kinect_v2_rows.h"
#include "sim/decode/unwrap.h"
#include "sim/images/rows.h"

namespace toftwin::sim {
namespace {

constexpr std::size_t kFrequencies = 3;

}  // namespace

/// Holds what the steps hand on to each other.
class KinectV2Decoder::Impl {
 public:
  Impl(const Samples& shape, int width, int height, const DecodeSettings& settings, const DecodeRays& rays)
      : settings_(settings),
        kinect_(settings.kinect),
        rays_(rays),
        width_(width),
        height_(height),
        steps_(shape.steps),
        zero_cycles_(zeroCycles(settings, kFrequencies)),
        // 80 MHz is three units of 240 MHz.
        unit_m_(settings.speed_of_light / (6.0 * shape.frequencies[0].in(hertz))),
        flags_(width, height),
        brightness_(Image<float>::unset(width, height)),
        is_edge_(width, height) {
    for (std::size_t f = 0; f < kFrequencies; ++f) {
      counts_[f] = kinect_.counts_per_electron * kinect_.amplitude_multipliers[f];
    }
    result_ = {.range_m = Image<float>::unset(width_, height_),
               .amplitude = Image<float>{width_, height_},
               .ambient = Image<float>::unset(width_, height_),
               .flags = Image<std::uint8_t>::unset(width_, height_),
               .phasors = {}};
    for (std::size_t f = 0; f < kFrequencies; ++f)
      result_.phasors.push_back(Image<std::complex<float>>::unset(width_, height_));
    limits_ = limits();
  }

  void take(int top, const Samples& samples, int first, int last) {
    for (int y = first; y < last; ++y) demodulate(samples, y, top + y - first);
    if (!samples.flags.empty() && first < last)
      std::copy_n(&samples.flags(0, first), static_cast<std::ptrdiff_t>(last - first) * width_, &flags_(0, top));
  }

  RangeImage finish() {
    Rooms<Rows> rooms;
    forRows(height_, [&](int first, int last) {
      rooms.use([&] { return rowsToWorkIn(); },
                [&](Rows& rows) {
                  for (int y = first; y < last; ++y) {
                    if (kinect_.bilateral_filter) filter(y, rows);
                    measureRow(y, rows);
                  }
                });
    });
    if (kinect_.edge_filter) dropEdges();
    return std::move(result_);
  }

 private:
  /// A row's numbers on their way from phases to range.
  struct Rows {
    explicit Rows(std::size_t width)
        : unlikeness(width), zeros(width), ones(width, 1.0F), deviation(width), strongest(width), why(width) {
      for (std::size_t f = 0; f < kFrequencies; ++f) {
        filtered[f].resize(width);
        cycles[f].resize(width);
        amplitudes[f].resize(width);
      }
    }
    std::array<std::vector<std::complex<float>>, kFrequencies> filtered;
    std::vector<float> unlikeness;
    std::array<std::vector<float>, kFrequencies> cycles, amplitudes;
    std::vector<float> zeros, ones;
    std::vector<double> deviation, strongest;
    std::vector<std::uint32_t> why;
    std::vector<BilateralRows> filters;  ///< by frequency, if there is that filter
  };
  [[nodiscard]] Rows rowsToWorkIn() const {
    Rows rows{static_cast<std::size_t>(width_)};
    for (std::size_t f = 0; kinect_.bilateral_filter && f < kFrequencies; ++f) {
      const auto least = static_cast<float>(kinect_.bilateral_threshold_counts / counts_[f]);
      rows.filters.emplace_back(result_.phasors[f], least, flags_);
    }
    return rows;
  }

  void demodulate(const Samples& samples, int from, int y) {
    const auto columns = static_cast<std::size_t>(width_);
    for (std::size_t f = 0; f < kFrequencies; ++f) {
      std::complex<float>* phasors = &result_.phasors[f](0, y);
      demodulateRow(samples, steps_, f, from, phasors);
      takeOffPixelPhase(settings_, f, y, {phasors, columns});
      addAmplitudes(phasors, 1.0F / static_cast<float>(kFrequencies), columns, &result_.amplitude(0, y));
    }
    unmodulatedRow(samples, from, &result_.ambient(0, y));
  }

  /// Saturated pixels have no phase that others could take.
  void filter(int y, Rows& rows) {
    for (std::size_t f = 0; f < kFrequencies; ++f) {
      rows.filters[f].row(y, rows.filtered[f].data(), rows.unlikeness.data());
      markEdges(rows.unlikeness, static_cast<float>(kinect_.edge_unlikeness),
                {&is_edge_(0, y), rows.unlikeness.size()});
    }
  }

  [[nodiscard]] KinectLimits limits() const {
    const double baseline_m = settings_.baseline_length.in(metre);
    const bool is_exact = settings_.baseline == DecodeSettings::Baseline::Exact;
    return {.counts_per_electron = counts_,
            .least_counts = kinect_.least_counts,
            .least_sum_counts = kinect_.least_sum_counts,
            .unit_m = unit_m_,
            .strong_rad = kinect_.strong_unwrap_threshold.in(radian),
            .weak_rad = settings_.unwrap_threshold.in(radian),
            .nearest_m = settings_.nearest.in(metre),
            .farthest_m = settings_.farthest.in(metre),
            .baseline_m = baseline_m,
            .baseline_square = is_exact ? baseline_m * baseline_m : 0.0};
  }

  void measureRow(int y, Rows& rows) {
    const auto columns = static_cast<std::size_t>(width_);
    KinectSeen seen{.cycles = {},
                    .amplitudes = {},
                    .ray_x = rays_.x.empty() ? rows.zeros.data() : &rays_.x(0, y),
                    .ray_z = rays_.z.empty() ? rows.ones.data() : &rays_.z(0, y)};
    for (std::size_t f = 0; f < kFrequencies; ++f) {
      std::vector<float>& cycles = rows.cycles[f];
      const std::complex<float>* phasors =
          kinect_.bilateral_filter ? rows.filtered[f].data() : &result_.phasors[f](0, y);
      polarRow(phasors, columns, zero_cycles_[f], cycles.data(), rows.amplitudes[f].data());
      if (f < settings_.true_cycles.size() && settings_.true_cycles[f].size() > 1)
        linearise(settings_.true_cycles[f], cycles);
      seen.cycles[f] = cycles.data();
      seen.amplitudes[f] = rows.amplitudes[f].data();
    }
    const KinectFound found{&result_.range_m(0, y), &brightness_(0, y), rows.deviation.data(),
                            rows.strongest.data(), rows.why.data()};
    if (measureKinectRow(seen, limits_, columns, found)) settleDoubts(rows);
    judgeRow(&flags_(0, y), rows.why.data(), columns, &result_.range_m(0, y), &result_.flags(0, y));
  }

  /// A deviation so close to the threshold is worth two transcendental functions.
  void settleDoubts(Rows& rows) const {
    for (std::size_t x = 0; x < rows.why.size(); ++x) {
      std::uint32_t& why = rows.why[x];
      if ((why & kDoubtful) == 0) continue;
      why &= ~kDoubtful;
      if (rows.deviation[x] > kinectV2Threshold(rows.strongest[x], limits_.strong_rad, limits_.weak_rad))
        why |= kUnreliable;
    }
  }

  void dropEdges() {
    auto depth_m = Image<float>::unset(width_, height_);
    forRows(height_, [&](int first, int last) {
      for (int y = first; y < last; ++y) {
        for (int x = 0; x < width_; ++x)
          depth_m(x, y) = result_.range_m(x, y) * (rays_.z.empty() ? 1.0F : rays_.z(x, y));
      }
    });
    const Image<std::uint8_t> drops = edgePixels(depth_m, is_edge_, brightness_);
    forRows(height_, [&](int first, int last) {
      for (int y = first; y < last; ++y) {
        for (int x = 0; x < width_; ++x) {
          if (drops(x, y) == 0) continue;
          reject(result_.flags(x, y), PixelFlag::Mixed);
          result_.range_m(x, y) = kNaN;
        }
      }
    });
  }

  const DecodeSettings& settings_;
  const DecodeSettings::KinectV2& kinect_;
  const DecodeRays& rays_;
  int width_, height_;
  Steps steps_;
  std::vector<float> zero_cycles_;
  double unit_m_;
  std::array<double, kFrequencies> counts_{};  ///< of the device per electron of amplitude
  KinectLimits limits_{};
  RangeImage result_;
  Image<std::uint8_t> flags_;  ///< as the samples had them
  Image<float> brightness_;  ///< sum of the amplitudes in counts
  Image<std::uint8_t> is_edge_;
};

KinectV2Decoder::KinectV2Decoder(const Samples& shape, int width, int height, const DecodeSettings& settings,
                                 const DecodeRays& rays)
    : impl_(std::make_unique<Impl>(shape, width, height, settings, rays)) {}
KinectV2Decoder::~KinectV2Decoder() = default;
void KinectV2Decoder::take(int top, const Samples& samples, int first, int last) {
  impl_->take(top, samples, first, last);
}
RangeImage KinectV2Decoder::finish() { return impl_->finish(); }

double kinectV2Threshold(double counts, double strong_rad, double weak_rad) {
  return std::clamp(std::exp(kThresholdSlope * std::log(counts) + kThresholdLevel), strong_rad,
                    std::max(strong_rad, weak_rad));
}

RangeImage decodeKinectV2(const Samples& samples, const DecodeSettings& settings,
                          const DecodeRays& rays) {
  KinectV2Decoder decoder{samples, samples.width(), samples.height(), settings, rays};
  forRows(samples.height(), [&](int first, int last) { decoder.take(first, samples, first, last); });
  return decoder.finish();
}

}  // namespace toftwin::sim
