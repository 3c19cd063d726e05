// SPDX-License-Identifier: Apache-2.0
// How noisy a pixel is, pixels that are alike tell together; which are alike its own noise must not say.
#include "calib/discover/campaign/captures/pool_noise.h"

#include <cmath>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>
#include <toftwin/nan.h>

#include "calib/discover/campaign/captures/reading.h"
#include "tests/discover/simulated_run.h"

namespace toftwin::discover {
namespace {

/// Variances of 1 + x/10 in columns x, each known from eight differences: 125 pixels of a bin know theirs to
/// √(2/8/125) = 4.5 %, and lines between the middles of bins are as straight as what is sought. Five of that
/// are passed by one of 950 columns in 5e-4 of all seeds. Before the first bin's middle, 21, and behind the last it is
/// theirs.
TEST(PooledOver, IsWhatPixelsThatAreAlikeSayTogether) {
  constexpr int kWidth = 1000, kEnd = 25;
  std::mt19937 random{7};
  std::gamma_distribution<double> of_eight(4.0, 0.25);
  Image<float> variance(kWidth, 3), like(kWidth, 3);
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < kWidth; ++x)
      variance(x, y) = static_cast<float>((1.0 + 0.1 * x) * of_eight(random)), like(x, y) = static_cast<float>(x);
  variance(500, 1) = kNaN, like(501, 1) = kNaN;
  const Image<float> pooled = pooledOver(variance, like);
  for (int x = kEnd; x < kWidth - kEnd; ++x)
    EXPECT_NEAR(static_cast<double>(pooled(x, 0)) / (1.0 + 0.1 * x), 1.0, 5.0 * std::sqrt(2.0 / 8.0 / 125.0)) << x;
  EXPECT_TRUE(std::isnan(pooled(500, 1)));
  EXPECT_TRUE(std::isnan(pooled(501, 1)));
}

/// Also where a camera tells amplitudes in whole numbers.
TEST(PooledOver, IsTheMeanOfAllThatAreTheSame) {
  Image<float> variance(100, 1), same(100, 1, 7.0F), two(100, 1);
  for (int x = 0; x < 100; ++x) variance(x, 0) = static_cast<float>(x), two(x, 0) = x % 4 == 0 ? 1.0F : 2.0F;
  const Image<float> alike = pooledOver(variance, same), pooled = pooledOver(variance, two);
  for (const float one : alike.pixels()) EXPECT_FLOAT_EQ(one, 49.5F);
  for (int x = 0; x < 100; ++x) EXPECT_FLOAT_EQ(pooled(x, 0), x % 4 == 0 ? 48.0F : 50.0F);
}

TEST(PooledOver, TakesWhatThereIs) {
  EXPECT_TRUE(pooledOver({}, {}).empty());
  EXPECT_TRUE(std::isnan(pooledOver(Image<float>(1, 1, kNaN), Image<float>(1, 1, 2.0F))[0]));
  EXPECT_EQ(pooledOver(Image<float>(1, 1, 3.0F), Image<float>(1, 1, 2.0F))[0], 3.0F);
}

struct Seen {
  sim::SensorModel model;
  sim::Scene scene;
  MeasuredCapture capture{};
  std::shared_ptr<const TracedCapture> traced{};
  Image<float> log_amplitude{};  ///< as declared
};

Seen seen() {
  const auto model = sim::SensorModel::parse(smallCamera(), "camera.toml");
  const auto scene = sim::Scene::parse(smallScene(), "scene.toml");
  if (!model || !scene) throw std::runtime_error("the camera or the scene is wrong");
  Seen seen{*model, *scene};
  seen.capture.moment.world_from_camera = Transform<World, Camera>{};
  seen.capture.moment.exposures = model->exposures({});
  const Declared declared{seen.model, seen.scene};
  const auto all = traceAll(declared, {seen.capture}, {.samples_per_pixel = 16, .max_surfaces = 1});
  const auto camera = NoiselessCamera::make(*model, effectsWithoutNoise(*model), {seen.capture});
  if (!all || !camera) throw std::runtime_error("nothing is seen");
  seen.traced = all->front();
  seen.log_amplitude = camera->read(seen.capture, seen.traced->light).log_amplitude;
  return seen;
}

/// Noise of 3 % of the brightest pixel's amplitude: 20 to 30 % of the dark strip's. Pooled as measured, a pixel that
/// noise made brighter counts more, and the mean is 2σ² too bright, more where noise lifts a pixel out of its bin. Seed
/// 11; of 50 such captures the mean must be 0 within four standard errors (false alarms: 6e-5).
TEST(PoolNoise, APixelsOwnNoiseDoesNotChooseItsWeight) {
  const Seen seen_once = seen();
  const Image<float>& log = seen_once.log_amplitude;
  float brightest = -1e30F;
  for (std::size_t i = 0; i < log.size(); ++i)
    if (std::isfinite(log[i])) brightest = std::max(brightest, log[i]);
  std::mt19937 random{11};
  std::normal_distribution<float> normal;
  double sum = 0.0, weights = 0.0, sum_as_measured = 0.0, weights_as_measured = 0.0;
  for (int k = 0; k < 50; ++k) {
    MeasuredCapture capture = seen_once.capture;
    capture.log_amplitude.mean = capture.log_amplitude.own_variance = log;
    for (std::size_t i = 0; i < log.size(); ++i) {
      const float sigma = 0.03F * std::exp(brightest - log[i]);
      capture.log_amplitude.mean[i] += sigma * normal(random);
      capture.log_amplitude.own_variance[i] = sigma * sigma;
    }
    const Image<float> as_measured = pooledOver(capture.log_amplitude.own_variance, capture.log_amplitude.mean);
    std::vector<MeasuredCapture> captures{capture};
    ASSERT_TRUE(poolNoise({seen_once.model, seen_once.scene}, {seen_once.traced}, captures));
    for (std::size_t i = 0; i < log.size(); ++i) {
      const auto off = static_cast<double>(capture.log_amplitude.mean[i] - log[i]);
      const auto weight = 1.0 / static_cast<double>(captures[0].log_amplitude.variance[i]);
      if (seen_once.traced->is_edge[i] != 0 || !std::isfinite(off * weight)) continue;
      sum += weight * off, weights += weight;
      const auto chosen = 1.0 / static_cast<double>(as_measured[i]);
      sum_as_measured += chosen * off, weights_as_measured += chosen;
    }
  }
  EXPECT_NEAR(sum / weights, 0.0, 4.0 / std::sqrt(weights));
  EXPECT_GT(sum_as_measured / weights_as_measured, 10.0 / std::sqrt(weights)) << "there is something to see";
}

}  // namespace
}  // namespace toftwin::discover
