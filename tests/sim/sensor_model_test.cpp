// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor/sensor_model.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "sim/sensor/frame_assembly.h"
#include "tests/sim/camera_testing.h"

namespace toftwin::sim {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(CameraFile, ErrorsNameFileLineKeyBoundAndUnit) {
  EXPECT_THAT(errorOf("[lens]\nwidth = 0\n"), HasSubstr("camera.toml:2: width"));
  EXPECT_THAT(errorOf(plainCamera(2, 2, 0.5)), HasSubstr("steps = 2"));
  EXPECT_THAT(errorOf(plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'warmup'\n")),
              testing::AllOf(HasSubstr("\"warmup\" is no effect"), HasSubstr("warm_up")));
  EXPECT_THAT(errorOf(plainCamera(4, 2, 0.5, "[[effect]]\nveil = 0.1\n")),
              HasSubstr("type is missing"));
  EXPECT_THAT(errorOf(plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'lens_scatter'\nveil = 0.7\n")),
              HasSubstr("veil = 0.7 is out of bounds: it must be 0 to 0.5"));
  EXPECT_THAT(errorOf(plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'delay'\noffset_m = 1\n")),
              HasSubstr("unknown key \"offset_m\""));
  EXPECT_THAT(errorOf("model = 'x'\n"),
              testing::AllOf(HasSubstr("no [[emitter]]"), HasSubstr("no [[modulation]]")));
  EXPECT_THAT(errorOf("[[emitter]]\npower_w = 0\n[[modulation]]\n"), HasSubstr("power_w = 0 and gives no light"));
  EXPECT_THAT(errorOf("[[emitter]]\naxis = [0, 0, 0]\n[[modulation]]\n"),
              HasSubstr("axis of length 0"));
  EXPECT_THAT(errorOf("[[emitter]]\n[[modulation]]\n[decoder]\nnearest_m = 3\nfarthest_m = 2\n"),
              HasSubstr("every range would be invalid"));
}

TEST(CameraFile, EmittersHaveTheirMeasuredPattern) {
  const auto with = [](const std::string& keys) { return "[[emitter]]\n" + keys + "\n[[modulation]]\n"; };
  const TraceRequest request = modelOf(with("pattern_deg = [0, 20, 35]\npattern = [1, 1.1, 0]")).traceRequest();
  EXPECT_THAT(request.emitters.at(0).pattern_deg, ElementsAre(0.0, 20.0, 35.0));
  EXPECT_THAT(request.emitters.at(0).pattern, ElementsAre(1.0, 1.1, 0.0));
  EXPECT_THAT(errorOf(with("pattern_deg = [0, 20]\npattern = [1]")), HasSubstr("1 numbers of pattern at 2 of pattern_deg"));
  EXPECT_THAT(errorOf(with("pattern = [1, 1]")), HasSubstr("2 numbers of pattern at 0"));
  EXPECT_THAT(errorOf(with("pattern_deg = [0, 20, 20]\npattern = [1, 1, 1]")), HasSubstr("ascend from 0"));
  EXPECT_THAT(errorOf(with("pattern_deg = [5, 20]\npattern = [1, 1]")), HasSubstr("ascend from 0"));
  EXPECT_THAT(errorOf(with("pattern_deg = [0, 20]\npattern = [0, 0]")), HasSubstr("dark everywhere"));
  EXPECT_THAT(errorOf(with("isotropic = true\npattern_deg = [0, 20]\npattern = [1, 1]")), HasSubstr("one of them"));
}

TEST(CameraFile, PhysicsThatCannotBeIsAnError) {
  EXPECT_THAT(errorOf("[[emitter]]\n[[modulation]]\nexposure_us = 20000\n"),
              HasSubstr("the gaps between them take 81.5 ms"));
  const std::string start =
      "[[emitter]]\n[sampling]\nharmonics = 31\n[[modulation]]\nfrequency_mhz = 30\n";
  EXPECT_THAT(errorOf(start + "contrast = 0.95\nemitted = 'square'\ndemodulated = 'square'\n"),
              HasSubstr("negative charge"));
  EXPECT_EQ(errorOf(start + "contrast = 0.8\nemitted = 'square'\ndemodulated = 'square'\n"), "");
  EXPECT_THAT(errorOf("[[emitter]]\n[[modulation]]\nfrequency_mhz = "
                      "80\n[[modulation]]\nfrequency_mhz = 80.001\n"),
              HasSubstr("ratios of small whole numbers"));
  EXPECT_THAT(errorOf("[[emitter]]\n[[modulation]]\nfrequency_mhz = 80.0001234\n"),
              HasSubstr("whole kilohertz"));
  EXPECT_THAT(
      errorOf(
          "[[emitter]]\n[[modulation]]\nfrequency_mhz = 80\n[decoder]\nalgorithm = 'kinect_v2'\n"),
      HasSubstr("10 : 2 : 15"));
}

TEST(CameraFile, TheIdIsTheContentNotTheText) {
  const SensorModel model = modelOf(plainCamera(4, 2, 0.5, kShotNoise));
  EXPECT_EQ(model.id().size(), 32u);
  EXPECT_EQ(modelOf("# a comment\n" + plainCamera(4, 2, 0.5, kShotNoise)).id(), model.id());
  EXPECT_NE(modelOf(plainCamera(4, 2, 0.51, kShotNoise)).id(), model.id());
  EXPECT_NE(modelOf(plainCamera(4, 2, 0.5)).id(), model.id());
}

TEST(Parameters, ChangeOneNumberWithinItsBounds) {
  const SensorModel model =
      modelOf(plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'delay'\noffset_mm = 1\n"));
  EXPECT_THAT(model.parameterNames(), ElementsAre("exposure_us", "delay.offset_mm"));
  const auto changed = model.with("delay.offset_mm", 12.5);
  ASSERT_TRUE(changed) << changed.error().message;
  EXPECT_NE(changed->id(), model.id());
  const Light light = evenLight(model, 1.0, 0.9);
  EXPECT_NEAR(rangeStatistics(changed->expose(light, {}, 1, 0).range).mean - 0.9, 0.0125, 1e-6);
  EXPECT_EQ(model.with("delay.offset_mm", 1.0)->id(), model.id());
  EXPECT_THAT(model.with("delay.offset_mm", 1e9).error().message, HasSubstr("-10000 to 10000"));
  EXPECT_THAT(model.with("exposure_us", std::nan("")).error().message, HasSubstr("1 to 20000"));
  EXPECT_THAT(model.with("delay.size", 1.0).error().message,
              HasSubstr("there are: exposure_us, delay.offset_mm"));
}

TEST(Parameters, TwiceTheExposureIsTwiceTheSignal) {
  const SensorModel model = modelOf(plainCamera(4, 2, 0.5));
  const Light light = evenLight(model, 1.0, 0.9);
  const double once = static_cast<double>(model.expose(light, {}, 1, 0).range.amplitude(0, 0));
  const double twice = static_cast<double>(
      model.with("exposure_us", 2000.0)->expose(light, {}, 1, 0).range.amplitude(0, 0));
  EXPECT_NEAR(once, 5000.0, 0.01);  // m N_e
  EXPECT_NEAR(twice, 2.0 * once, 0.01);
}

/// expose() makes samples strip by strip and never as whole images free of noise; it must be the bits of both
/// halves.
TEST(Exposing, IsCollectingAndReadingOut) {
  const std::string scatter =
      "[[effect]]\ntype = 'lens_scatter'\nveil = 0.01\nhalo = 0.02\nhalo_radius_px = 15\n";
  for (const std::string& camera : {*SensorModel::presetText("kinect_v2") + scatter,
                                    *SensorModel::presetText("o3d303"), plainCamera(4, 1, 0.5)}) {
    const SensorModel model = modelOf(camera);
    const TraceRequest request = model.traceRequest();
    // From where it saturates to where it is too dark, with jumps; no multiple of a strip's rows.
    const Light light = syntheticLight(37, 45, request.frequencies, request.harmonics, [](int x, int y) {
      const double range_m = (x < 20 ? 0.3 : 2.0) + 0.11 * y;
      return std::vector<Way>{{0.2 / (range_m * range_m), range_m}};
    });
    const auto whole = model.expose(light, {}, 5, 3, 11, 22);
    const auto halves = model.readOut(model.collect(light, {}, 5, 3, 11, 22), {}, 5, 3, 11, 22);
    EXPECT_EQ(whole.samples.electrons, halves.samples.electrons);
    EXPECT_EQ(whole.samples.flags, halves.samples.flags);
    EXPECT_EQ(whole.range.flags, halves.range.flags);
    EXPECT_EQ(whole.range.phasors, halves.range.phasors);
    int valid = 0;
    for (std::size_t i = 0; i < whole.range.range_m.size(); ++i) {
      if (std::isnan(halves.range.range_m[i])) continue;
      ++valid;
      EXPECT_EQ(whole.range.range_m[i], halves.range.range_m[i]) << i;
    }
    EXPECT_GT(valid, 100);
  }
}

/// The Kinect's three steps see the 5th and 7th harmonic at 16 MHz as they see the first: with both folded into it,
/// all raw exposures collect the same charge; so do the four of the O3D303, whose 3rd is not faint.
TEST(Exposing, CollectsTheSameOfFoldedHarmonics) {
  // An emitter that rises slowly turns the first harmonic's content, too.
  const auto slowly = [](std::string text) {
    for (std::size_t at = 0; (at = text.find("[[modulation]]\n", at)) != std::string::npos; ++at)
      text.insert(at + 15, "rise_ns = 5\n");
    return text;
  };
  const std::string kinect = *SensorModel::presetText("kinect_v2"), o3d303 = *SensorModel::presetText("o3d303");
  for (const std::string& text : {kinect, o3d303, slowly(kinect), slowly(o3d303)}) {
    SCOPED_TRACE(text);
    const SensorModel model = modelOf(text);
    const TraceRequest request = model.traceRequest();
    const Light light = syntheticLight(9, 40, request.frequencies, request.harmonics, [](int x, int y) {
      const double range_m = 0.6 + 0.07 * x + 0.11 * y;
      return std::vector<Way>{{0.2, range_m}, {0.07, range_m + 0.4}};
    });
    Light folded = light, without = light;
    int count = 0;
    const auto terms = model.correlatedTerms();
    const auto harmonics = static_cast<std::size_t>(request.harmonics);
    for (std::size_t term = 0; term < terms.size(); ++term) {
      if (!terms[term].is_folded) continue;
      ++count;
      auto& first = folded.phasors[term / harmonics * harmonics];
      for (std::size_t p = 0; p < first.size(); ++p) {
        const auto added = terms[term].beside_first * light.phasors[term][p];
        first[p] += terms[term].is_mirrored ? std::conj(added) : added;
      }
      folded.phasors[term] = without.phasors[term] = {};
    }
    EXPECT_GE(count, 1);
    const Samples all = model.collect(light, {}, 1, 0), same = model.collect(folded, {}, 1, 0),
                  less = model.collect(without, {}, 1, 0);
    float largest = 0.0F;
    for (std::size_t e = 0; e < all.electrons.size(); ++e) {
      for (std::size_t p = 0; p < all.electrons[e].size(); ++p) {
        const float charge = all.electrons[e][p];
        ASSERT_NEAR(same.electrons[e][p], charge, 1e-6F * charge);
        largest = std::max(largest, std::abs(less.electrons[e][p] - charge) / charge);
      }
    }
    EXPECT_GT(largest, 1e-3F) << "it would have been seen";
    // What turns harmonics each in its own way must see them apart.
    const SensorModel apart = modelOf(text + "[[effect]]\ntype = 'propagation_delay'\nper_column_mm = 0.1\n");
    EXPECT_TRUE(std::ranges::none_of(apart.correlatedTerms(), &SeenHarmonic::is_folded));
  }
}

/// measure() never has an image of samples, and decodes what others still collect.
TEST(Exposing, MeasuresTheSameRangeWithoutKeepingSamples) {
  const std::string scatter =
      "[[effect]]\ntype = 'lens_scatter'\nveil = 0.01\nhalo = 0.02\nhalo_radius_px = 15\n";
  for (const std::string& camera : {*SensorModel::presetText("kinect_v2") + scatter,
                                    *SensorModel::presetText("kinect_v2"), plainCamera(4, 1, 0.5)}) {
    const SensorModel whole = modelOf(camera);
    CameraInfo lens = whole.camera();
    lens.width = 37;
    lens.height = 45;
    const SensorModel model = whole.withLens(lens);
    const TraceRequest request = model.traceRequest();
    const Light light = syntheticLight(37, 45, request.frequencies, request.harmonics, [](int x, int y) {
      const double range_m = (x < 20 ? 0.3 : 2.0) + 0.11 * y;
      return std::vector<Way>{{0.2 / (range_m * range_m), range_m}};
    });
    const RangeImage with = model.expose(light, {}, 5, 3).range, without = model.measure(light, {}, 5, 3);
    EXPECT_EQ(with.flags, without.flags);
    EXPECT_EQ(with.phasors, without.phasors);
    EXPECT_EQ(with.amplitude, without.amplitude);
    EXPECT_EQ(with.ambient, without.ambient);
    int valid = 0;
    for (std::size_t i = 0; i < with.range_m.size(); ++i) {
      if (std::isnan(with.range_m[i]) && std::isnan(without.range_m[i])) continue;
      ++valid;
      EXPECT_EQ(with.range_m[i], without.range_m[i]) << i;
    }
    EXPECT_GT(valid, 100);
  }
}

TEST(FrameAssembly, GivesThePlanesAskedForInOrder) {
  const SensorModel model =
      modelOf(plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'delay'\noffset_mm = -1200\n"));
  Light light = evenLight(model, 1.0, 1.3);
  light.truth.range_m(0, 0) = 1.3F;
  const PlaneKind kinds[] = {PlaneKind::Samples, PlaneKind::Depth, PlaneKind::Range,
                             PlaneKind::TruthNormal, PlaneKind::Phasors};
  auto exposed = model.expose(light, {}, 1, 0);
  exposed.range.range_m(5, 5) = -0.2F;  // as an effect might make it
  const auto planes = planesOf(model, exposed, light.truth, kinds);
  ASSERT_EQ(planes.size(), 5u);
  EXPECT_EQ(planes[0].channels, 4);
  EXPECT_EQ(planes[3].channels, 3);
  EXPECT_EQ(planes[4].channels, 2);
  for (const Plane& plane : planes) EXPECT_EQ(plane.data.size(), plane.byteSize());
  const auto at = [](const Plane& plane, int x, int y) {
    return plane.as<float>()[static_cast<std::size_t>(y * 400 + x)];
  };
  EXPECT_NEAR(at(planes[2], 200, 125), 0.1, 1e-5);
  EXPECT_FLOAT_EQ(
      at(planes[1], 30, 40),
      at(planes[2], 30, 40) * static_cast<float>(rayThroughPixel(model.camera(), 30, 40).v.z));
  EXPECT_TRUE(std::isnan(at(planes[2], 5, 5)));
  EXPECT_TRUE(std::isnan(at(planes[1], 5, 5)));
  EXPECT_NEAR(at(planes[0], 9, 9),
              exposed.samples.tap(0, 0, 0)(9, 9) - exposed.samples.tap(0, 0, 1)(9, 9), 1e-3);
}

TEST(FrameAssembly, CameraOfARegionSeesTheSameRays) {
  const CameraInfo whole = SensorModel::preset("kinect_v2")->camera();
  const CameraInfo region = cameraOfRegion(whole, 100, 50, 60, 40);
  EXPECT_EQ(rayThroughPixel(region, 7, 9), rayThroughPixel(whole, 107, 59));
}

}  // namespace
}  // namespace toftwin::sim
