// SPDX-License-Identifier: Apache-2.0
// What light in real time keeps from frame to frame, and what it forgets.
#include <fmt/format.h>

#include <string>
#include <thread>
#include <vector>

#include "sim/tracer/irradiance_cells.h"
#include "sim/tracer/realtime.h"
#include "tests/tracer/realtime_room.h"

namespace toftwin::sim::testing {
namespace {

/// Blocks of pixels that no mover is near to keep their direct light; it must be the bits of tracing it again. The
/// ball casts its shadow away from where it is seen, and turns back.
TEST(Realtime, KeepsOnlyDirectLightThatStaysTheSame) {
  const Scene moving = sceneOf(room(0.0, "velocity_m_per_s = [0.9, 0.4, -0.5]"));
  TraceRequest request = roomRequest();
  request.emitters.push_back({.position_m = {-0.9, 0.3, 0.1}, .radius = 30_mm});
  request.max_surfaces = 1;
  RealtimeTracer with_past;
  for (const Duration time : {0_ms, 33_ms, 66_ms, 400_ms, 433_ms, 0_ms, 33_ms}) {
    if (time == 433_ms) request.world_from_camera.translation_m.x += 0.01;
    const Scene scene = moving.at(time);
    RealtimeTracer anew;
    const Light &a = with_past.next(scene, request), &b = anew.next(scene, request);
    EXPECT_EQ(a.steady, b.steady);
    EXPECT_EQ(a.ambient, b.ambient);
    EXPECT_EQ(a.phasors, b.phasors);
    EXPECT_EQ(a.truth.normal, b.truth.normal);
    EXPECT_EQ(a.truth.range_m, b.truth.range_m);
  }
}

/// What images hold of earlier frames is used again where it is the same; what was asked for in between, or of other
/// frequencies, must leave nothing behind.
TEST(Realtime, IsTheSameWhateverWasAskedForInBetween) {
  const Scene moving = sceneOf(room(0.0, "velocity_m_per_s = [0.9, 0.4, -0.5]") +
                               "\n[[object]]\nshape = 'sphere'\nradius_m = 0.2\nposition_m = [-0.8, 0.4, 1.8]\nmaterial = 'white'\n");
  TraceRequest whole = roomRequest(), direct = whole;
  direct.max_surfaces = 1;
  TraceRequest centres = direct, other = direct;
  centres.pixel_extent = 0.0;
  other.frequencies = {16_MHz};
  TraceRequest whole_of_centres = whole;
  whole_of_centres.pixel_extent = 0.0;
  RealtimeTracer whole_alone, mixed, centres_alone, refined_before;
  for (const Duration time : {0_ms, 33_ms, 66_ms}) {
    const Scene scene = moving.at(time);
    RealtimeTracer anew;
    const Light &a = mixed.next(scene, direct), &b = anew.next(scene, direct);
    EXPECT_EQ(a.steady, b.steady);
    EXPECT_EQ(a.phasors, b.phasors);
    EXPECT_EQ(a.variance, b.variance);
    const Light &c = mixed.next(scene, whole), &d = whole_alone.next(scene, whole);
    EXPECT_EQ(c.steady, d.steady);
    EXPECT_EQ(c.ambient, d.ambient);
    EXPECT_EQ(c.phasors, d.phasors);
    EXPECT_EQ(c.variance, d.variance);
    refined_before.next(scene, direct);
    EXPECT_EQ(refined_before.next(scene, whole_of_centres).phasors,
              centres_alone.next(scene, whole_of_centres).phasors);
    mixed.next(scene, direct);
    RealtimeTracer of_centres, of_other;
    EXPECT_EQ(mixed.next(scene, centres).phasors, of_centres.next(scene, centres).phasors);
    mixed.next(scene, direct);
    EXPECT_EQ(mixed.next(scene, other).phasors, of_other.next(scene, other).phasors);
  }
}

/// Light over several surfaces is told by what was looked for in earlier frames where nothing moved: it must be the bits of
/// looking for all of it again, which another name of the camera's calibration makes the tracer do. Neither side of the image is
/// whole blocks. The light is where the camera is, and a rod moves along itself: of the ball around it, that has pixels traced
/// again, its ends reach the rim, and what lies beside them is in no shadow.
TEST(Realtime, KeepsOnlyWhatStaysTheSame) {
  const Scene moving = sceneOf(roomWith("shape = 'box'\nsize_m = [0.5, 0.08, 0.08]\nposition_m = [-0.1, 0.03, 2.2]\n"
                                        "velocity_m_per_s = [1.2, 0, 0]"));
  TraceRequest request = roomRequest();
  request.camera.width -= 1;
  request.camera.height -= 2;
  request.emitters.front().position_m = {};
  RealtimeTracer keeping, looking;
  for (int frame = 0; frame < 8; ++frame) {
    const Scene scene = moving.at(frame * 33.333333_ms);
    const Light& kept = keeping.next(scene, request);
    TraceRequest renamed = request;
    renamed.camera.calibration_id = std::to_string(frame);
    const Light& anew = looking.next(scene, renamed);
    ASSERT_EQ(kept.phasors, anew.phasors) << frame;
    ASSERT_EQ(kept.steady, anew.steady) << frame;
    ASSERT_EQ(kept.variance, anew.variance) << frame;
  }
}

/// Other frequencies begin anew: phasors of the old ones mean nothing for them.
TEST(Realtime, ForgetsLightOfOtherFrequencies) {
  const Scene scene = sceneOf(room(0.2));
  TraceRequest request = roomRequest(), other = request;
  for (Frequency& f : other.frequencies) f = 0.75 * f;
  RealtimeTracer changed;
  changed.next(scene, request);
  changed.next(scene, other);
  const Light& after = changed.next(scene, other);
  TraceRequest exact = other;
  exact.samples_per_pixel = 4096;
  exact.region_width = exact.region_height = 1;
  exact.region_x = 40, exact.region_y = 100;
  const Complex truth = phasorAt(trace(scene, exact), 0, 0, 0);
  EXPECT_LT(std::abs(phasorAt(after, 0, 40, 100) - truth), 0.05 * std::abs(truth));
}

/// A board with a fin on its left, which moves with it: the light between them moves along. What is remembered must be
/// that of the same place on the board, not in the image, where it would be that of farther from the fin. (Medians:
/// 2.1 mm where it stands and its memory is longer, 3.5 where it moves; 7.1 where it is remembered in the image.)
TEST(Realtime, RemembersLightWhereThingsMovedTo) {
  const auto fin = [](double x, const char* motion) {
    return fmt::format(R"(
      [[material]]
      name = "white"
      albedo = 0.9
      [[object]]
      shape = "rectangle"
      size_m = [0.8, 0.8, 0]
      position_m = [{}, 0, 1.5]
      material = "white"
      {}
      [[object]]
      shape = "box"
      size_m = [0.02, 0.8, 0.4]
      position_m = [{}, 0, 1.3]
      material = "white"
      {})", x + 0.4, motion, x - 0.01, motion);
  };
  const Scene moving = sceneOf(fin(-0.8, "velocity_m_per_s = [1.2, 0, 0]")), last = sceneOf(fin(0.0, ""));
  const TraceRequest request = roomRequest();
  Frames run, still;
  for (int frame = 0; frame <= 20; ++frame) {
    run.next(moving.at(frame * 33.333333_ms), request);
    still.next(last, request);
  }
  TraceRequest exact = request;
  exact.samples_per_pixel = 16384;
  exact.region_width = exact.region_height = 1;
  std::vector<double> moved, stood;
  for (int y = exact.region_y = 60; y < 160; y = exact.region_y += 20) {
    for (int x = exact.region_x = kWidth / 2 + 4; x < kWidth / 2 + 60; x = exact.region_x += 4) {
      const Complex here = phasorAt(trace(last, exact), 0, 0, 0);
      moved.push_back(errorOf(*run.light, x, y, here));
      stood.push_back(errorOf(*still.light, x, y, here));
    }
  }
  RecordProperty("median_mm", std::to_string(median(moved)));
  EXPECT_LT(median(moved), 2.4 * median(stood));
}

void expectSame(const Light& a, const Light& b, int frame) {
  EXPECT_EQ(a.phasors, b.phasors) << frame;
  EXPECT_EQ(a.steady, b.steady) << frame;
  EXPECT_EQ(a.ambient, b.ambient) << frame;
  EXPECT_EQ(a.variance, b.variance) << frame;
  EXPECT_EQ(a.truth.range_m, b.truth.range_m) << frame;
  EXPECT_EQ(a.truth.normal, b.truth.normal) << frame;
  EXPECT_EQ(a.truth.albedo, b.truth.albedo) << frame;
}

/// While a frame is begun, the last one's light stays as it is; what comes of it is what next() gives. A frame that is begun
/// and then not wanted counts as one more, here where nothing is looked at again for its footprint.
TEST(Realtime, IsTheSameBegunAhead) {
  const Scene moving = sceneOf(room(0.0, "velocity_m_per_s = [0.9, 0.4, -0.5]"));
  TraceRequest request = roomRequest();
  for (const double extent : {1.0, 0.0}) {
    request.pixel_extent = extent;
    RealtimeTracer ahead, in_turn;
    for (int frame = 0; frame < 4; ++frame) {
      const Scene scene = moving.at(frame * 33.3_ms);
      const Light& light = frame == 0 ? ahead.next(scene, request) : ahead.finish();
      const Light& expected = in_turn.next(scene, request);
      if (extent == 0.0 && frame == 2) {
        ahead.begin(moving.at(500_ms), request);
        in_turn.next(moving.at(500_ms), request);
      }
      const Light before = light;
      if (frame == 1) request.world_from_camera.translation_m.x += 0.01;
      {
        // Whoever reads meanwhile, reads that.
        const std::jthread begins{[&] { ahead.begin(moving.at((frame + 1) * 33.3_ms), request); }};
        for (int again = 0; again < 3; ++again) expectSame(light, before, frame);
      }
      expectSame(light, before, frame);
      if (extent == 0.0 && frame == 2) continue;
      expectSame(light, expected, frame);
    }
  }
  // What the frame that was begun does not want is taken back: other frequencies, and another size of the image.
  RealtimeTracer changed, straight;
  TraceRequest other = request, smaller = request;
  for (Frequency& f : other.frequencies) f = 0.75 * f;
  smaller.camera.width -= 40;
  smaller.camera.height -= 44;
  changed.next(moving.at(0_ms), request);
  straight.next(moving.at(0_ms), request);
  for (const TraceRequest& wanted : {other, smaller}) {
    changed.begin(moving.at(33_ms), request);
    straight.next(moving.at(33_ms), request);
    expectSame(changed.next(moving.at(66_ms), wanted), straight.next(moving.at(66_ms), wanted), 0);
  }
  EXPECT_THROW(RealtimeTracer{}.finish(), std::logic_error);
}

TEST(IrradianceCells, KeepNewSamplesLonger) {
  IrradianceCells cells{0.1, 1};
  const auto key = cells.keyOf({0.05, 0.25, -0.35}, {0, 0, 1});
  EXPECT_EQ(key, cells.keyOf({0.01, 0.21, -0.31}, {0.1, 0.2, 0.9}));
  EXPECT_NE(key, cells.keyOf({0.05, 0.25, -0.35}, {0, 0, -1}));
  EXPECT_NE(key, cells.keyOf({0.05, 0.25, -0.45}, {0, 0, 1}));
  for (int k = 1; k <= 10; ++k) {
    EXPECT_EQ(cells.find(key).means.empty(), k <= IrradianceCells::kEnough);
    const float sample = static_cast<float>(k);
    cells.add(key, {&sample, 1}, 100);
  }
  // Σ 2k/n(n+1) · k = (2n + 1)/3
  EXPECT_NEAR(cells.find(key).means[0], 7.0f, 1e-5f);
}

}  // namespace
}  // namespace toftwin::sim::testing
