// SPDX-License-Identifier: Apache-2.0
// Steps of raw exposures, found in amplitudes of single frames.
#include <gmock/gmock.h>

#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>
#include <random>

#include "calib/discover/campaign/captures/sample_steps.h"

namespace toftwin::discover {
namespace {

constexpr std::uint64_t kStepSeed = 90;

/// Amplitudes of pixels with `noise` electrons in each raw exposure, which come in steps of `step` (0: none).
class SteppedCamera {
 public:
  SteppedCamera(std::size_t phase_steps, double step, double noise, std::uint64_t seed = kStepSeed)
      : phase_steps_(phase_steps), step_(step), noise_(noise), random_(seed) {
    std::printf("seed %lu\n", static_cast<unsigned long>(seed));
  }

  std::vector<AmplitudePair> pairs(std::size_t count) {
    std::vector<AmplitudePair> all;
    std::uniform_real_distribution<double> amplitude{300.0, 2000.0}, phase{0.0, 2.0 * std::numbers::pi};
    for (std::size_t i = 0; i < count; ++i) {
      const double a = amplitude(random_), phi = phase(random_), steady = 2.0 * a;
      const float before = read(a, phi, steady);
      all.push_back({before, read(a, phi, steady)});
    }
    return all;
  }

 private:
  float read(double amplitude, double phase, double steady) {
    std::complex<double> sum;
    for (std::size_t k = 0; k < phase_steps_; ++k) {
      const double theta =
          2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(phase_steps_);
      double sample = steady + amplitude * std::cos(phase - theta) + noise_ * normal_(random_);
      if (step_ > 0.0) sample = step_ * std::round(sample / step_);
      sum += sample * std::polar(1.0, -theta);
    }
    return static_cast<float>(2.0 / static_cast<double>(phase_steps_) * std::abs(sum));
  }

  std::size_t phase_steps_;
  double step_, noise_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_{};
};

void expectStep(std::size_t phase_steps, double step, double noise) {
  const auto found = sampleStepsOf(SteppedCamera{phase_steps, step, noise}.pairs(2000), phase_steps);
  ASSERT_TRUE(found) << phase_steps << " steps of " << step;
  EXPECT_NEAR(found->step, step, 4.0 * found->error) << "missed once in 16,000";
  EXPECT_LT(found->error, 1e-4 * step);
}

TEST(SampleSteps, AreFoundWhateverTheNoiseIs) {
  for (const double step : {5.0, 60.0, 120.0}) {
    expectStep(4, step, 60.0);
    expectStep(3, step, 60.0);
  }
  expectStep(4, 6.0, 6.0);  // single precision's own grid shows in the amplitudes
  expectStep(3, 60.0, 600.0);
}

TEST(SampleSteps, AreNotFoundWhereThereAreNone) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed)
    EXPECT_FALSE(sampleStepsOf(SteppedCamera(4, 0.0, 60.0, seed).pairs(500), 4)) << seed;
}

/// Frames that do not differ: each pixel says a number once, however often it is seen.
TEST(SampleSteps, AreFoundWithoutNoise) {
  expectStep(4, 60.0, 0.0);
  expectStep(3, 60.0, 0.0);
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const auto once = SteppedCamera(4, 0.0, 0.0, seed).pairs(50);
    std::vector<AmplitudePair> often;
    for (int times = 0; times < 20; ++times) often.insert(often.end(), once.begin(), once.end());
    EXPECT_FALSE(sampleStepsOf(often, 4)) << seed;
    EXPECT_FALSE(sampleStepsOf(SteppedCamera(4, 0.0, 0.0, seed).pairs(1000), 4)) << seed;
  }
}

TEST(SampleSteps, OfTheAmplitudeItselfAreNoSteps) {
  auto pairs = SteppedCamera{4, 17.0, 60.0}.pairs(2000);
  for (AmplitudePair& pair : pairs)
    for (float& amplitude : pair) amplitude = std::round(amplitude);
  EXPECT_FALSE(sampleStepsOf(pairs, 4));
}

TEST(SampleSteps, HaveNoKnownGridForOtherPhaseSteps) {
  EXPECT_FALSE(sampleStepsOf(SteppedCamera(5, 60.0, 60.0).pairs(2000), 5));
  EXPECT_FALSE(sampleStepsOf({}, 4));
}

TEST(SampleSteps, AreLookedForInTheDimmestPixels) {
  Image<float> before{20, 20}, after{20, 20};
  for (std::size_t i = 0; i < before.size(); ++i)
    before[i] = after[i] = static_cast<float>(i);  // the first is 0: no light
  std::vector<AmplitudePair> pairs;
  addDimmest(before, after, pairs);
  ASSERT_EQ(pairs.size(), 128U);
  for (const AmplitudePair& pair : pairs) EXPECT_LE(pair[0], 128.0F);
}

}  // namespace
}  // namespace toftwin::discover
