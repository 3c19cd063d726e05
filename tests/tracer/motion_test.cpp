// SPDX-License-Identifier: Apache-2.0
// Scenes at other times: instances stand where their motion says, as exactly as still objects.
#include "tests/tracer/tracing.h"

namespace toftwin::sim::testing {
namespace {

constexpr auto kMatt = "[[material]]\nname = 'm'\nalbedo = 0.8\nemission_w_per_m2_sr = 1\n";

TEST(Scene, StandsStillWithoutMotion) {
  const Scene scene =
      sceneOf(std::string{kMatt} + "[[object]]\nshape = 'disc'\nmaterial = 'm'\nposition_m = [0, 0, 2]\n");
  EXPECT_FALSE(scene.moves());
  EXPECT_EQ(&scene.at(5_s).impl(), &scene.impl());
}

/// Every shape, moved and turned: range, normal and phasor are those of the same object written down there.
TEST(Scene, MovingObjectsStandWhereStillOnesWould) {
  for (const std::string shape :
       {"shape = 'rectangle'", "shape = 'box'\nsize_m = [1, 0.8, 0.6]", "shape = 'sphere'", "shape = 'disc'",
        "shape = 'cylinder'\nradius_m = 0.4"}) {
    const std::string wall =
        std::string{kMatt} +
        "[[object]]\nshape = 'rectangle'\nsize_m = [9, 9, 0]\nposition_m = [0, 0, 4]\nmaterial = 'm'\n";
    const std::string object = wall + "[[object]]\n" + shape + "\nmaterial = 'm'\n";
    const Scene moving = sceneOf(object +
                                 "position_m = [0.4, 0, 2.6]\nvelocity_m_per_s = [-0.8, 0.1, "
                                 "1.2]\nrotation_rate_deg_per_s = [0, 50, 0]\n");
    const Scene still = sceneOf(object + "position_m = [0, 0.05, 3.2]\neuler_deg = [0, 25, 0]\n");
    ASSERT_TRUE(moving.moves());
    const Scene posed = moving.at(500_ms);
    EXPECT_EQ(posed.id(), moving.id());
    TraceRequest request = requestFor(24, 24, 24.0, {80_MHz});
    const Light a = trace(posed, request), b = trace(still, request);
    int seen = 0;
    for (int y = 0; y < 24; ++y) {
      for (int x = 0; x < 24; ++x) {
        EXPECT_NEAR(a.truth.range_m(x, y), b.truth.range_m(x, y), 2e-6) << shape << " " << x << " " << y;
        EXPECT_NEAR(dot(a.truth.normal(x, y), b.truth.normal(x, y)), 1.0f, 1e-6f);
        EXPECT_LT(std::abs(phasorAt(a, 0, x, y) - phasorAt(b, 0, x, y)),
                  2e-6 * std::abs(phasorAt(b, 0, x, y)) + 1e-12);
        seen += b.truth.range_m(x, y) < 3.9f ? 1 : 0;
      }
    }
    EXPECT_GT(seen, 30) << shape;
    EXPECT_NE(trace(moving.at(0_s), request).truth.range_m, a.truth.range_m);
    EXPECT_EQ(trace(moving, request).truth.range_m, trace(moving.at(0_s), request).truth.range_m)
        << "loaded: at time 0";
    EXPECT_EQ(trace(posed.at(1_s), request).truth.range_m, trace(moving.at(1_s), request).truth.range_m)
        << "from any pose";
  }
}

/// A closed room of even radiance, with moving bodies far from their own frame's origin: over four surfaces
/// of albedo 1/2 every pixel is 1 + 1/2 + 1/4 + 1/8; a path that gets lost at a wrong start ends early and is
/// darker.
TEST(Scene, NoLightIsLostAtMovingSurfaces) {
  const Scene scene = sceneOf(
      "[[material]]\nname = 'm'\nalbedo = 0.5\nemission_w_per_m2_sr = 1\n"
      "[[object]]\nshape = 'box'\nsize_m = [6, 4, 7]\nposition_m = [100, 0, 50]\nmaterial = 'm'\n"
      "[[object]]\nshape = 'box'\nsize_m = [1, 1, 1]\nposition_m = [99, 0, 50]\nvelocity_m_per_s = [1, 0, "
      "1]\n"
      "rotation_rate_deg_per_s = [10, 20, 30]\nmaterial = 'm'\n"
      "[[object]]\nshape = 'sphere'\nradius_m = 0.4\nposition_m = [101, 0.5, 51]\nvelocity_m_per_s = [0, -1, "
      "0]\nmaterial = 'm'\n");
  TraceRequest request = requestFor(128, 128, 100.0, {});
  request.world_from_camera.translation_m = {100, 0, 47.5};
  request.samples_per_pixel = 16;
  request.max_surfaces = 4;  // 0.5³ = 0.125: no roulette, so no noise at all
  const Light light = trace(scene.at(700_ms), request);
  for (const float value : light.ambient.pixels()) ASSERT_NEAR(value, 1.875f, 3e-6f * 1.875f);
}

TEST(SceneFile, KeyframesSayWhereAThingIs) {
  const std::string object = std::string{kMatt} + "[[object]]\nshape = 'disc'\nmaterial = 'm'\n";
  const Scene scene =
      sceneOf(object +
              "period_s = 2\n[[object.keyframe]]\ntime_s = 0\nposition_m = [0, 0, 2]\n"
              "[[object.keyframe]]\ntime_s = 1\nposition_m = [0, 0, 3]\neuler_deg = [0, 30, 0]\n");
  const auto range = [&](Duration time) {
    return trace(scene.at(time), requestFor(1, 1, 1.0, {})).truth.range_m(0, 0);
  };
  EXPECT_FLOAT_EQ(range(0_s), 2.0f);
  EXPECT_FLOAT_EQ(range(250_ms), 2.25f);
  EXPECT_FLOAT_EQ(range(4500_ms), 2.5f);
  const auto errorOf = [&](const std::string& more) {
    const auto wrong = Scene::parse(object + more, "scene.toml");
    return wrong ? std::string{"no error"} : wrong.error().message;
  };
  EXPECT_THAT(errorOf("[[object.keyframe]]\ntime_s = 1\n[[object.keyframe]]\ntime_s = 1\n"),
              ::testing::HasSubstr("scene.toml:11: time_s is not later"));
  EXPECT_THAT(errorOf("velocity_m_per_s = [1, 0, 0]\n[[object.keyframe]]\ntime_s = 1\n"),
              ::testing::HasSubstr("beside keyframes"));
  EXPECT_THAT(errorOf("[[object.keyframe]]\ntime = 1\n"),
              ::testing::HasSubstr("scene.toml:9: unknown key \"time\""));
  EXPECT_THAT(errorOf("period_s = 1\n"), ::testing::HasSubstr("needs keyframes"));
}

}  // namespace
}  // namespace toftwin::sim::testing
