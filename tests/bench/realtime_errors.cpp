// SPDX-License-Identifier: Apache-2.0
// Errors of light in real time against 262,144 samples of the unbiased tracer, and beside the camera's noise.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>

#include "tests/bench/realtime.h"

namespace toftwin::bench {
namespace {

/// The same camera without noise and filters that hide it.
SensorModel withoutNoise(const SensorModel& model) {
  std::vector<AnyEffect> effects;
  for (const AnyEffect& effect : model.effects()) {
    if (std::holds_alternative<ShotNoise>(effect) || std::holds_alternative<ReadNoise>(effect) ||
        std::holds_alternative<RangeNoise>(effect) || std::holds_alternative<Companding>(effect)) {
      continue;
    }
    effects.push_back(effect);
  }
  return model.withEffects(std::move(effects));
}

/// Samples of the reference: of 65,536 the noise (1.0 mm, median) would count as the error's.
constexpr int kReference = 262'144;

/// Ranges that differ by more are of different cycles.
constexpr double kUnwrappedAlike_m = 0.1;

double rangeApart(std::complex<float> a, std::complex<float> b, Frequency f) {
  const double phase = std::arg(std::complex<double>{a} * std::conj(std::complex<double>{b}));
  return std::abs(phase) * kSpeedOfLight_m_per_s / (4.0 * std::numbers::pi * f.in(hertz)) * 1e3;
}

double millimetresOf(double variance, std::complex<float> phasor, Frequency f) {
  return std::sqrt(variance) / static_cast<double>(std::abs(phasor)) * kSpeedOfLight_m_per_s /
         (4.0 * std::numbers::pi * f.in(hertz)) * 1e3;
}

/// What light in real time is judged by, in millimetres of range at the first frequency, pixel by pixel.
struct Judged {
  std::vector<double> errors, without, sigmas, references, deviations;
};

/// Adds runs' present frame, all of the same scene at the same time, at pixels spread over the image.
void judge(std::initializer_list<const Kinect*> runs, Judged& judged) {
  const Kinect& any = **runs.begin();
  TraceRequest what = any.request;
  what.samples_per_pixel = kReference;
  what.region_width = what.region_height = 1;
  TraceRequest direct = what;
  direct.max_surfaces = 1;
  direct.samples_per_pixel = 64;
  const Frequency f = what.frequencies[0];
  const Scene posed = any.scene.at(any.time());
  for (what.region_y = 9; what.region_y < what.camera.height; what.region_y += 37) {
    for (what.region_x = 7; what.region_x < what.camera.width; what.region_x += 41) {
      const int x = direct.region_x = what.region_x, y = direct.region_y = what.region_y;
      const Light reference = trace(posed, what);
      const std::complex<float> exact = reference.phasors[0][0];
      judged.without.push_back(rangeApart(trace(posed, direct).phasors[0][0], exact, f));
      judged.references.push_back(millimetresOf(static_cast<double>(reference.variance[0][0]), exact, f));
      for (const Kinect* run : runs) {
        const std::complex<float> seen = run->light->phasors[0](x, y);
        judged.errors.push_back(rangeApart(seen, exact, f));
        judged.sigmas.push_back(millimetresOf(static_cast<double>(run->light->variance[0](x, y)), seen, f));
        judged.deviations.push_back(judged.errors.back() / std::hypot(judged.sigmas.back(), judged.references.back()));
      }
    }
  }
}

Bars barsOf(const Judged& judged) {
  const auto share = [&](double below) {
    return 100.0 * static_cast<double>(std::ranges::count_if(judged.deviations, [&](double v) { return v < below; })) /
           static_cast<double>(judged.deviations.size());
  };
  fmt::print("| multipath's error, {} pixels: median, 90 % | {:.2f}, {:.2f} mm |\n", judged.errors.size(),
             median(judged.errors), quantile(judged.errors, 0.9));
  fmt::print("| without multipath: median | {:.2f} mm |\n", median(judged.without));
  fmt::print("| the reference's own σ: median, largest | {:.2f}, {:.2f} mm |\n", median(judged.references),
             quantile(judged.references, 1.0));
  fmt::print("| σ as stated with the frame: median, 90 % | {:.2f}, {:.2f} mm |\n", median(judged.sigmas),
             quantile(judged.sigmas, 0.9));
  fmt::print("| error within 1, 2, 3 σ as stated | {:.0f}, {:.0f}, {:.0f} % |\n", share(1.0), share(2.0), share(3.0));
  const double error_mm = median(judged.errors);
  return {{"multipath in real time behind a moving object, median error", fmt::format("{:.2f} mm", error_mm),
           "≤ 2 mm", error_mm <= 2.0},
          {"the light's error as stated in every frame holds: within 3 σ", fmt::format("{:.0f} %", share(3.0)),
           "≥ 99 %", share(3.0) >= 99.0}};
}

/// Pixel by pixel over a few readings: the standard deviation of the range that the camera's noise makes.
Image<float> cameraNoise(const Kinect& kinect) {
  constexpr int kReadings = 24;
  const Samples samples = kinect.collect(kinect.model);
  Image<float> sum{512, 424}, squares{512, 424};
  for (int i = 0; i < kReadings; ++i) {
    const auto exposed = kinect.readOut(kinect.model, samples, 1000 + static_cast<std::uint64_t>(i));
    for (std::size_t p = 0; p < sum.size(); ++p) {
      const float range = exposed.range.range_m[p];
      sum[p] += range;
      squares[p] += range * range;
    }
  }
  Image<float> sigma{512, 424};
  for (std::size_t p = 0; p < sum.size(); ++p) {
    const double mean = static_cast<double>(sum[p]) / kReadings,
                 square = static_cast<double>(squares[p]) / kReadings;
    sigma[p] =
        static_cast<float>(std::sqrt(std::max(0.0, square - mean * mean) * kReadings / (kReadings - 1)));
  }
  return sigma;
}

/// Of pixels that are valid in all frames and unwrapped alike.
double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double aa = 0.0, bb = 0.0, ab = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!(std::abs(a[i]) < kUnwrappedAlike_m && std::abs(b[i]) < kUnwrappedAlike_m)) continue;
    aa += a[i] * a[i];
    bb += b[i] * b[i];
    ab += a[i] * b[i];
  }
  return ab / std::sqrt(aa * bb);
}

}  // namespace

Bars errors(const Files& files) {
  Kinect a{files, 1}, b{files, 77};
  const SensorModel quiet = withoutNoise(a.model);
  const auto traceUntil = [&](std::uint64_t frame) {
    for (; a.frame < frame; ++a.frame, ++b.frame) {
      a.trace();
      b.trace();
    }
  };
  traceUntil(89);
  // What two runs differ by that share nothing but scene and camera is √2 times one's own error.
  std::vector<std::vector<double>> light_apart, all_apart;
  for (int i = 0; i < 2; ++i) {
    if (i > 0) ++a.frame, ++b.frame;
    a.trace();
    b.trace();
    const auto apart = [&](const SensorModel& model) {
      const auto x = a.readOut(model, a.collect(model), a.frame).range.range_m;
      const auto y = b.readOut(model, b.collect(model), b.frame).range.range_m;
      std::vector<double> differences;
      for (std::size_t p = 0; p < x.size(); ++p) {
        differences.push_back(static_cast<double>(x[p]) -
                              static_cast<double>(y[p]));  // NaN where either is invalid
      }
      return differences;
    };
    light_apart.push_back(apart(quiet));
    all_apart.push_back(apart(a.model));
  }
  const Image<float> noise = cameraNoise(a);
  // The sphere turns back here, and half a second later is in the middle of its way.
  Judged judged;
  judge({&a, &b}, judged);
  ++a.frame, ++b.frame;
  traceUntil(105);
  a.trace();
  b.trace();
  judge({&a, &b}, judged);
  fmt::print("\nErrors after three seconds and half a second later, two seeds, 80 MHz:\n\n| what | |\n| --- | --- |\n");
  Bars bars = barsOf(judged);
  double below = 0.0, seen = 0.0;
  std::vector<double> own, cameras;
  for (std::size_t p = 0; p < noise.size(); ++p) {
    // Cycles that differ are the light's own noise, and far above the camera's.
    if (!(noise[p] > 0.0f) || std::isnan(light_apart[1][p])) continue;
    seen += 1.0;
    own.push_back(std::abs(light_apart[1][p]) / std::numbers::sqrt2 * 1e3);
    cameras.push_back(1e3 * static_cast<double>(noise[p]));
    below += own.back() < cameras.back() ? 1.0 : 0.0;
  }
  fmt::print(
      "| the camera's noise in the range: median σ | {:.2f} mm |\n| the light's own: median, 99 % of pixels "
      "| {:.2f}, {:.2f} mm |\n"
      "| pixels where the light's own is below the camera's | {:.2f} % |\n"
      "| correlation of successive frames: light alone, whole frames | {:.3f}, {:.4f} |\n",
      median(cameras), median(own), quantile(own, 0.99), 100.0 * below / seen,
      correlation(light_apart[0], light_apart[1]), correlation(all_apart[0], all_apart[1]));
  const double whole = correlation(all_apart[0], all_apart[1]);
  bars.push_back({"pixels where the light's own noise is below the camera's",
                  fmt::format("{:.2f} %", 100.0 * below / seen), "≥ 99 %", below >= 0.99 * seen});
  bars.push_back({"noise of successive frames in real time, correlation", fmt::format("{:.4f}", whole),
                  "< 0.01", std::abs(whole) < 0.01});
  return bars;
}

}  // namespace toftwin::bench
