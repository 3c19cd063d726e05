// SPDX-License-Identifier: Apache-2.0
// Errors of light in real time against 262,144 samples of the unbiased tracer, and beside the camera's noise.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <numeric>
#include <utility>

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

/// Two runs that share nothing but scene and camera: what they differ by is √2 times one's own error.
class Pair {
 public:
  Pair(const Files& files, std::uint64_t seed, std::uint64_t other)
      : a{files, seed}, b{files, other}, quiet_(withoutNoise(a.model)) {}

  /// Traces up to and including that frame.
  void traceUntil(std::uint64_t frame) {
    for (; next_ <= frame; ++next_) {
      a.frame = b.frame = next_;
      a.trace();
      b.trace();
    }
  }
  /// Differences of the present frame's ranges, NaN where either is invalid: of the light alone, and with the
  /// camera's noise.
  [[nodiscard]] std::vector<double> lightApart() const { return apart(quiet_); }
  [[nodiscard]] std::vector<double> allApart() const { return apart(a.model); }

  Kinect a, b;

 private:
  [[nodiscard]] std::vector<double> apart(const SensorModel& model) const {
    const auto x = a.readOut(model, a.collect(model), a.frame).range.range_m;
    const auto y = b.readOut(model, b.collect(model), b.frame).range.range_m;
    std::vector<double> differences;
    for (std::size_t p = 0; p < x.size(); ++p)
      differences.push_back(static_cast<double>(x[p]) - static_cast<double>(y[p]));
    return differences;
  }

  SensorModel quiet_;
  std::uint64_t next_ = 0;
};

/// How the noise of successive frames goes together, by pairs of runs and times. One of them says little: of so many
/// pixels chance alone makes 0.0024.
struct Correlations {
  std::vector<double> light, whole;

  void addUntil(std::uint64_t frame, Pair& pair) {
    pair.traceUntil(frame - 1);
    const auto light_before = pair.lightApart(), all_before = pair.allApart();
    pair.traceUntil(frame);
    light.push_back(correlation(light_before, pair.lightApart()));
    whole.push_back(correlation(all_before, pair.allApart()));
  }
};

double meanOf(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Where the light's own noise is below the camera's.
Bar compareWithCamera(const Pair& pair) {
  const Image<float> noise = cameraNoise(pair.a);
  const auto light_apart = pair.lightApart();
  double below = 0.0, seen = 0.0;
  std::vector<double> own, cameras;
  for (std::size_t p = 0; p < noise.size(); ++p) {
    // Cycles that differ are the light's own noise, and far above the camera's.
    if (!(noise[p] > 0.0f) || std::isnan(light_apart[p])) continue;
    seen += 1.0;
    own.push_back(std::abs(light_apart[p]) / std::numbers::sqrt2 * 1e3);
    cameras.push_back(1e3 * static_cast<double>(noise[p]));
    below += own.back() < cameras.back() ? 1.0 : 0.0;
  }
  const std::string share = fmt::format("{:.2f} %", 100.0 * below / seen);
  fmt::print(
      "| the camera's noise in the range: median σ | {:.2f} mm |\n| the light's own: median, 99 % of pixels "
      "| {:.2f}, {:.2f} mm |\n| pixels where the light's own is below the camera's | {} |\n",
      median(cameras), median(own), quantile(own, 0.99), share);
  return {"pixels where the light's own noise is below the camera's", share, "≥ 99 %", below >= 0.99 * seen};
}

}  // namespace

Bars errors(const Files& files) {
  // The sphere turns back at the first of them, and half a second later is in the middle of its way.
  constexpr std::uint64_t kTurning = 90, kPassing = 105;
  constexpr std::pair<std::uint64_t, std::uint64_t> kSeeds[]{{1, 77}, {153, 229}, {305, 381}};
  Correlations correlations;
  Judged judged;
  Bar below;
  fmt::print("\nErrors after three seconds and half a second later, 80 MHz:\n\n| what | |\n| --- | --- |\n");
  for (const auto& [seed, other] : kSeeds) {
    const bool is_judged = seed == kSeeds[0].first;
    Pair pair{files, seed, other};
    correlations.addUntil(kTurning, pair);
    if (is_judged) judge({&pair.a, &pair.b}, judged);
    if (is_judged) below = compareWithCamera(pair);
    correlations.addUntil(kPassing, pair);
    if (is_judged) judge({&pair.a, &pair.b}, judged);
  }
  Bars bars = barsOf(judged);
  const double whole = meanOf(correlations.whole);
  fmt::print("| correlation of successive frames, light alone: three pairs of seeds, both times | {:.3f} |\n",
             fmt::join(correlations.light, ", "));
  fmt::print("| the same of whole frames; mean | {:.4f}; {:.4f} |\n", fmt::join(correlations.whole, ", "), whole);
  bars.push_back(below);
  bars.push_back({"noise of successive frames in real time, correlation", fmt::format("{:.4f}", whole), "< 0.01",
                  std::abs(whole) < 0.01});
  return bars;
}

}  // namespace toftwin::bench
