// SPDX-License-Identifier: Apache-2.0
// Surroundings, pictures on surfaces and motion by themselves, without a tracer.
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "sim/tracer/environment.h"
#include "sim/tracer/motion.h"
#include "sim/tracer/texture.h"

namespace toftwin::sim {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr unsigned kSeed = 20261121;
const Environment::Sun kNoSun{{0, -1, 0}, 0.0};

Image<float> noisyMap(int width, int height) {
  std::mt19937 generator{kSeed};
  std::uniform_real_distribution<float> uniform{0.0f, 2.0f};
  Image<float> map{width, height};
  for (float& value : map.pixels()) value = uniform(generator) < 1.0f ? 0.0f : uniform(generator);
  map(5, 3) = 400.0f;
  return map;
}

/// Up is −y and ahead is +z: the middle column is ahead, a quarter to its right is +x, the top is up.
TEST(Environment, LiesRoundTheSceneAsItSays) {
  Image<float> map{8, 4};
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 8; ++x) map(x, y) = static_cast<float>(10 * y + x);
  }
  const Environment surroundings{map, {0, -1, 0}, {0, 0, 1}, kNoSun};
  EXPECT_EQ(surroundings.radiance(normalised(Vec3d{0.1, -0.1, 1})), 14.0);
  EXPECT_EQ(surroundings.radiance(normalised(Vec3d{-0.1, 0.1, 1})), 23.0);
  EXPECT_EQ(surroundings.radiance(normalised(Vec3d{1, -0.1, -0.1})), 16.0);
  EXPECT_EQ(surroundings.radiance(normalised(Vec3d{-1, -0.1, 0.1})), 12.0);
  EXPECT_EQ(surroundings.radiance(normalised(Vec3d{0.01, -1, 0.1})), 4.0);
  EXPECT_EQ(surroundings.radiance(normalised(Vec3d{0.01, 1, 0.1})), 34.0);
}

/// Directions are drawn with density ∝ radiance: radiance/density is the same for all, the map's integral,
/// and both functions agree on it. Without the map's darkness: no direction of zero radiance is drawn.
TEST(Environment, DrawsDirectionsByTheirRadiance) {
  const Image<float> map = noisyMap(32, 16);
  double whole = 0.0;
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 32; ++x) {
      whole += static_cast<double>(map(x, y)) * 2.0 * kPi / 32.0 *
               (std::cos(kPi * y / 16) - std::cos(kPi * (y + 1) / 16));
    }
  }
  const Vec3d up = normalised(Vec3d{0.2, -1.0, 0.3}), ahead = normalised(cross(up, Vec3d{1, 0, 0}));
  const Environment surroundings{map, up, ahead, kNoSun};
  std::mt19937 generator{kSeed};
  std::uniform_real_distribution<double> uniform;
  int in_bright_pixel = 0;
  constexpr int kDraws = 20'000;
  for (int i = 0; i < kDraws; ++i) {
    const auto drawn = surroundings.drawPicture(uniform(generator), uniform(generator));
    ASSERT_GT(drawn.density, 0.0);
    EXPECT_NEAR(norm(drawn.direction), 1.0, 1e-12);
    EXPECT_NEAR(drawn.radiance / drawn.density, whole, 1e-9 * whole);
    const auto seen = surroundings.seen(drawn.direction);
    in_bright_pixel += drawn.radiance == 400.0 ? 1 : 0;
    EXPECT_NEAR(seen.picture, drawn.radiance, 1e-9) << "pixels' edges aside: " << i;
    EXPECT_NEAR(seen.picture_density, drawn.density, 1e-9 * drawn.density);
  }
  // Binomial, 4 sigma: a false alarm in 16,000 seeds.
  const double share = 400.0 * 2.0 * kPi / 32.0 * (std::cos(kPi * 3 / 16) - std::cos(kPi * 4 / 16)) / whole;
  EXPECT_NEAR(in_bright_pixel, share * kDraws, 4.0 * std::sqrt(share * (1.0 - share) * kDraws))
      << "seed " << kSeed;
}

/// The sun's disc: what it gives a surface that faces it is its irradiance.
TEST(Environment, TheSunGivesItsIrradiance) {
  const Vec3d towards = normalised(Vec3d{0.3, -0.8, 0.2});
  const Environment sky{{}, {0, -1, 0}, {0, 0, 1}, {towards, 27.0}};
  double irradiance = 0.0;
  for (int i = 0; i < 1000; ++i) {
    const auto drawn = sky.drawSun((i + 0.5) / 1000.0, std::fmod(i * 0.618034, 1.0));
    irradiance += drawn.radiance / drawn.density * dot(drawn.direction, towards) / 1000.0;
    EXPECT_EQ(sky.seen(drawn.direction).sun, drawn.radiance);
  }
  EXPECT_NEAR(irradiance, 27.0, 1e-6);
  EXPECT_EQ(sky.radiance(normalised(towards + Vec3d{0.0, 0.0, 0.01})), 0.0) << "0.5 degrees beside it";
  EXPECT_FALSE(sky.isDark());
  EXPECT_TRUE((Environment{Image<float>{4, 2}, {0, -1, 0}, {0, 0, 1}, kNoSun}.isDark())) << "a black picture";
}

TEST(Texture, IsBilinearBetweenPixelsAndRepeats) {
  Image<float> picture{2, 2};
  picture(0, 0) = 0.0f;
  picture(1, 0) = 1.0f;
  picture(0, 1) = 0.5f;
  picture(1, 1) = 0.5f;
  const Texture texture{picture};
  EXPECT_FLOAT_EQ(texture.at({0.25f, 0.25f}), 0.0f);
  EXPECT_FLOAT_EQ(texture.at({0.75f, 0.25f}), 1.0f);
  EXPECT_FLOAT_EQ(texture.at({0.5f, 0.25f}), 0.5f);
  EXPECT_FLOAT_EQ(texture.at({0.75f, 0.5f}), 0.75f);
  EXPECT_FLOAT_EQ(texture.at({0.0f, 0.25f}), 0.5f) << "between the last column and the first";
  EXPECT_FLOAT_EQ(texture.at({-3.25f, 7.25f}), 1.0f);
  EXPECT_TRUE(std::isfinite(texture.at({std::numeric_limits<float>::quiet_NaN(), 1e30f})));
  EXPECT_NEAR(linearOfSrgb(0.5f), 0.21404, 1e-5);
}

TEST(Motion, GoesSteadilyAndTurns) {
  Motion motion{.velocity_m_per_s = {1.0, 0.0, -2.0},
                .rotation_rad_per_s = {0.0, kPi, 0.0},
                .keys = {},
                .period_s = 0.0};
  const auto pose = poseAt(motion, Transform<World, Object>{{1, 0, 0, 0}, {5, 0, 0}}, 500_ms);
  EXPECT_NEAR(norm(pose.translation_m - Vec3d{5.5, 0.0, -1.0}), 0.0, 1e-12);
  EXPECT_NEAR(norm(pose.rotate({0, 0, 1}) - Vec3d{1, 0, 0}), 0.0, 1e-12)
      << "a quarter turn about y takes z to x";
}

TEST(Motion, GoesFromKeyToKeyAndRepeats) {
  const auto half_turn = rotation<World, Object>({0, 0, 1}, kPi / 2.0).rotation_wxyz;
  Motion motion{
      .velocity_m_per_s = {},
      .rotation_rad_per_s = {},
      .keys = {{0.0, {1, 0, 0, 0}, {0, 0, 0}}, {1.0, half_turn, {2, 0, 0}}, {3.0, half_turn, {2, 4, 0}}},
      .period_s = 0.0};
  const Transform<World, Object> unused;
  EXPECT_NEAR(poseAt(motion, unused, 500_ms).translation_m.x, 1.0, 1e-12);
  const Vec3d turned = poseAt(motion, unused, 500_ms).rotate({1, 0, 0});
  EXPECT_NEAR(std::atan2(turned.y, turned.x), kPi / 4.0, 1e-12);
  EXPECT_NEAR(poseAt(motion, unused, 2_s).translation_m.y, 2.0, 1e-12);
  EXPECT_NEAR(poseAt(motion, unused, 9_s).translation_m.y, 4.0, 1e-12) << "stays at the last";
  EXPECT_NEAR(poseAt(motion, unused, -1_s).translation_m.x, 0.0, 1e-12) << "and at the first";
  motion.period_s = 4.0;
  EXPECT_NEAR(poseAt(motion, unused, 8500_ms).translation_m.x, 1.0, 1e-12);
  EXPECT_NEAR(poseAt(motion, unused, -2_s).translation_m.y, 2.0, 1e-12);
}

}  // namespace
}  // namespace toftwin::sim
