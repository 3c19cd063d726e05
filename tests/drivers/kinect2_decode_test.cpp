// SPDX-License-Identifier: Apache-2.0
// A simulated Kinect v2's raw frames, sent as the real one sends them, are decoded to the same ranges.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <random>

#include <toftwin/frame.h>

#include "drivers/kinect2/samples.h"
#include "emulated_kinect2.h"
#include "sim/sensor/sensor_model.h"
#include "tests/sim/synthetic_light.h"

namespace toftwin::test {
namespace {

using namespace drivers::kinect2;

constexpr double kCountsPerElectron = 0.00257;  // of the preset

/// The preset, with a sine at 16 MHz instead of a clipped one: what the factory measures of the waveform the
/// simulated camera's decoder knows, and the real one's files do not have.
sim::SensorModel simulatedKinect() {
  std::string text = *sim::SensorModel::presetText("kinect_v2");
  const auto replace = [&](std::string_view what, std::string_view with) {
    const auto at = text.find(what);
    ASSERT_NE(at, std::string::npos) << what;
    text.replace(at, what.size(), with);
  };
  replace("emitted = \"clipped_sine\"", "emitted = \"sine\"");
  replace("emitted_clip", "# emitted_clip");
  auto model = sim::SensorModel::parse(text, "kinect_v2.toml");
  EXPECT_TRUE(model.ok());
  return *std::move(model);
}

double wallRange_m(int x, int y) { return (x > 300 ? 1.2 : 2.0) + 0.002 * x + 0.001 * y; }

/// A slanted wall with a step, brighter to one side, too near and bright in a corner.
sim::SensorModel::Exposed exposeWall(const sim::SensorModel& model) {
  const auto request = model.traceRequest();
  const sim::Light light =
      sim::syntheticLight(kWidth, kHeight, request.frequencies, request.harmonics, [&](int x, int y) {
        const double r = wallRange_m(x, y);
        const double radiance = (x < 40 && y < 40 ? 8.0 : 0.05) * (1.0 + 0.001 * x) / (r * r);
        // Half of the way there and back whose range the decoder's formula makes r (decode_steps.h, without
        // L²).
        const double root = std::sqrt(r * r - 2.0 * r * 0.045 * static_cast<double>(model.rays().x(x, y)));
        return std::vector<sim::Way>{{radiance, 0.5 * (r + root)}};
      });
  return model.expose(light, Moment{}, 5, 1);
}

std::span<const std::byte> used(const Bytes& images) {
  return std::span{images}.first(kUsedImages * kImageBytes);
}

template <class T>
bool sameBits(const Image<T>& a, const Image<T>& b) {
  return a.size() == b.size() && std::memcmp(a.pixels().data(), b.pixels().data(), a.size() * sizeof(T)) == 0;
}

class Kinect2Decode : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    model_ = std::make_unique<sim::SensorModel>(simulatedKinect());
    exposed_ = std::make_unique<sim::SensorModel::Exposed>(exposeWall(*model_));
  }
  static void TearDownTestSuite() {
    model_.reset();
    exposed_.reset();
  }
  static inline std::unique_ptr<sim::SensorModel> model_;
  static inline std::unique_ptr<sim::SensorModel::Exposed> exposed_;
};

TEST_F(Kinect2Decode, OfASimulatedFrameThatWentOverTheWireIsThatOfItsCountsBitForBit) {
  // In whole counts, as the chip's converter gives them; one tap. The outer columns have no code.
  sim::Samples counts{.frequencies = {80_MHz, 16_MHz, 120_MHz}, .steps = 3, .taps = 1};
  counts.electrons.assign(kUsedImages, Image<float>{kWidth, kHeight});
  counts.flags = exposed_->samples.flags;
  for (std::size_t f = 0; f < 3; ++f) {
    for (int k = 0; k < 3; ++k) {
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 1; x < kWidth - 1; ++x) {
          const double electrons = static_cast<double>(exposed_->samples.tap(f, k, 0)(x, y)) -
                                   static_cast<double>(exposed_->samples.tap(f, k, 1)(x, y));
          const bool is_saturated = (counts.flags(x, y) & static_cast<unsigned>(PixelFlag::Saturated)) != 0;
          counts.tap(f, k, 0)(x, y) = is_saturated
                                          ? countsOf(kSaturatedCode)
                                          : static_cast<float>(std::round(electrons * kCountsPerElectron));
        }
      }
    }
  }
  for (int y = 0; y < kHeight; ++y) counts.flags(0, y) = counts.flags(kWidth - 1, y) = 0;
  const sim::RangeImage expected = sim::decode(counts, decodeSettings(), model_->rays());

  const Bytes images = imagesOf(exposed_->samples, kCountsPerElectron);
  const sim::Samples received = samplesOf(used(images));
  EXPECT_EQ(received.electrons, counts.electrons);
  const sim::RangeImage range = sim::decode(received, decodeSettings(), model_->rays());
  EXPECT_TRUE(sameBits(range.range_m, expected.range_m));
  EXPECT_TRUE(sameBits(range.amplitude, expected.amplitude));
  EXPECT_TRUE(sameBits(range.flags, expected.flags));
}

// The simulator decodes electrons with the file's settings, the driver counts with its own: that both agree
// shows that the settings are the same. Float's rounding: charge of two taps of up to 1.2e6 electrons is
// stored to 2⁻⁴ (half of an ulp, 0.0625 each), so a phasor of A electrons turns by 0.15 / A rad at most,
// which is 110.5 mm times that and the sum over three frequencies: below 0.02 mm for A of 3000 electrons and
// more.
TEST_F(Kinect2Decode, OfASimulatedFrameIsWhatTheSimulatorDecodedFromIt) {
  // Without what acts on ranges after decoding, which the wire does not carry.
  const sim::RangeImage expected = sim::decode(
      exposed_->samples,
      [] {
        auto settings = decodeSettings();
        settings.kinect.counts_per_electron = kCountsPerElectron;
        return settings;
      }(),
      model_->rays());
  const Bytes images = imagesOf(exposed_->samples, kCountsPerElectron);
  const sim::RangeImage range = sim::decode(samplesOf(used(images)), decodeSettings(), model_->rays());
  std::size_t valid = 0, differ = 0;
  double worst_m = 0.0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 2; x < kWidth - 2; ++x) {
      const float a = range.range_m(x, y), b = expected.range_m(x, y);
      if (std::isnan(a) != std::isnan(b)) {
        ++differ;  // a threshold that lies between the two
        continue;
      }
      if (std::isnan(a)) continue;
      ++valid;
      worst_m = std::max(worst_m, std::abs(static_cast<double>(a) - static_cast<double>(b)));
    }
  }
  EXPECT_GT(valid, kPixels * 8 / 10);
  EXPECT_LT(differ, 10u);
  EXPECT_LT(worst_m, 2e-5);
}

TEST_F(Kinect2Decode, KnowsTheWallThatWasExposed) {
  const Bytes images = imagesOf(exposed_->samples, kCountsPerElectron);
  const sim::RangeImage range = sim::decode(samplesOf(used(images)), decodeSettings(), model_->rays());
  std::vector<double> errors_m;
  for (int y = 50; y < kHeight; y += 3) {
    for (int x = 50; x < 290; x += 3) {
      if (std::isnan(range.range_m(x, y))) continue;
      errors_m.push_back(static_cast<double>(range.range_m(x, y)) - wallRange_m(x, y));
    }
  }
  ASSERT_GT(errors_m.size(), 8000u);
  std::ranges::nth_element(errors_m, errors_m.begin() + static_cast<std::ptrdiff_t>(errors_m.size() / 2));
  // Pixels scatter by less than 6 mm; the median of 8000 by 1.25 · 6 / √8000 = 0.08 mm, of which four.
  EXPECT_NEAR(errors_m[errors_m.size() / 2], 0.0, 0.34e-3);
  // Saturated where it is too bright.
  EXPECT_NE(range.flags(10, 10) & static_cast<unsigned>(PixelFlag::Saturated), 0u);
}

// The camera's samples are cos(φ + 2πk/3 + …): the tables' sign is known by libfreenect2's formula,
//   a = Σ cos(−p + θₖ) mₖ,  b = −Σ sin(−p + θₖ) mₖ,  phase = atan2(b, a),  p = 0.000031 π × table
TEST(Kinect2PhaseTables, AreTakenOffAsLibfreenect2DoesIt) {
  PhaseTables tables;
  std::mt19937 random{4};  // NOLINT(cert-msc51-cpp)
  for (auto& table : tables) {
    table.resize(kPixels);
    for (auto& entry : table) entry = static_cast<std::uint16_t>(random());
  }
  Bytes images(kImages * kImageBytes);
  for (std::byte& b : images) b = static_cast<std::byte>(random());
  const sim::Samples samples = samplesOf(used(images));
  sim::DecodeSettings settings = decodeSettings();
  settings.kinect.bilateral_filter = false;
  settings.pixel_turns = turnsOf(tables);
  const sim::RangeImage decoded = sim::decode(samples, settings);
  double worst = 0.0;
  for (std::size_t i = 1000; i < kPixels; i += 997) {
    if (i % kWidth == 0 || i % kWidth == kWidth - 1) continue;
    for (std::size_t f = 0; f < 3; ++f) {
      double a = 0.0, b = 0.0;
      for (int image = 0; image < 3; ++image) {
        const double theta =
            2.0 * std::numbers::pi * image / 3.0 - 0.000031 * std::numbers::pi * tables[f][i];
        const auto m = static_cast<double>(samples.tap(f, stepOfImage(image), 0)[i]);
        a += std::cos(theta) * m;
        b -= std::sin(theta) * m;
      }
      // Phasors are A e^(−iφ); a pixel's turn of 2π is none.
      const std::complex<double> ours{decoded.phasors[f][i]};
      const std::complex<double> theirs = 2.0 / 3.0 * std::complex<double>{a, -b};
      worst = std::max(worst, std::abs(ours - theirs) / 16'320.0);
    }
  }
  // Float: three samples and a turn, each rounded to 6e-8 of up to 16320 counts.
  EXPECT_LT(worst, 1e-6);
}

TEST(Kinect2PhaseTables, OfZerosChangeNoBit) {
  const Bytes images = imagesOfWall({365, 365, 255, 205, 0.09, -0.27, 0, 0, 0.1}, 1.5);
  const sim::Samples samples = samplesOf(used(images));
  sim::DecodeSettings settings = decodeSettings();
  const sim::RangeImage without = sim::decode(samples, settings);
  settings.pixel_turns = turnsOf({std::vector<std::uint16_t>(kPixels), std::vector<std::uint16_t>(kPixels),
                                  std::vector<std::uint16_t>(kPixels)});
  EXPECT_TRUE(sameBits(sim::decode(samples, settings).range_m, without.range_m));
}

TEST(Kinect2Wall, IsFlatAfterTheBaselineIsTakenOff) {
  const Lens lens{365.86, 365.86, 254.5, 205.25, 0.0964, -0.2758, 0, 0, 0.0921};
  const sim::DecodeRays rays = raysOf(cameraOf(lens));
  const Bytes images = imagesOfWall(lens, 2.0, 2000.0);
  const sim::RangeImage range = sim::decode(samplesOf(used(images)), decodeSettings(), rays);
  // Steps of 8 at 2000 counts: each sample is off by 4 at most, a phasor by 2/3 · 4 · 2, its phase by that
  // over 2000; at all three frequencies at once, times 110.5 mm: 0.9 mm. The filter cannot make it worse
  // where it looks to both sides.
  std::size_t valid = 0;
  for (int y = 1; y < kHeight - 1; ++y) {
    for (int x = 2; x < kWidth - 2; ++x) {
      const float depth_m = range.range_m(x, y) * rays.z(x, y);
      if (std::isnan(depth_m)) continue;
      ++valid;
      ASSERT_NEAR(depth_m, 2.0F, 0.9e-3F) << x << ", " << y;
    }
  }
  EXPECT_EQ(valid, std::size_t{kWidth - 4} * (kHeight - 2));
}

}  // namespace
}  // namespace toftwin::test
