// SPDX-License-Identifier: Apache-2.0
// Several exposures in one frame, their merging, and the temperatures that a camera tells.
#include "sim/sensor/exposures.h"

#include <gmock/gmock.h>

#include <cmath>

#include "sim/sensor/frame_assembly.h"
#include "tests/sim/camera_testing.h"

namespace toftwin::sim {
namespace {

using testing::HasSubstr;

constexpr auto kThree = "exposure_factors = [1.0, 0.1, 0.01]\n";
const std::string kWell = "[[effect]]\ntype = 'saturation'\nfull_well_electrons = 50000\n";

/// The camera of camera_testing with three exposures; 1e4 electrons at radiance 1 in the longest.
SensorModel threeExposures(const std::string& effects) {
  std::string text = plainCamera(4, 2, 0.5, effects);
  text.insert(text.find("[pixel]"), kThree);
  return modelOf(text);
}

/// Radiance 1, 100 and 1000: enough in the first exposure, in the second, in the third.
Light brightAndDark(const SensorModel& model) {
  const TraceRequest request = model.traceRequest();
  return syntheticLight(model.camera().width, model.camera().height, request.frequencies, 1,
                        [](int x, int) {
                          return std::vector<Way>{{x < 100 ? 1.0 : x < 200 ? 60.0 : 600.0, 1.1}};
                        });
}

TEST(Exposures, EachPixelIsOfTheLongestThatDoesNotSaturate) {
  const SensorModel model = threeExposures(kWell);
  const RangeImage image = model.expose(brightAndDark(model), {}, 1, 0).range;
  EXPECT_EQ(image.exposure(50, 10), 0);
  EXPECT_EQ(image.exposure(150, 10), 1);
  EXPECT_EQ(image.exposure(300, 10), 2);
  for (int x : {50, 150, 300}) {
    EXPECT_NEAR(image.range_m(x, 10), 1.1, 1e-5) << x;
    EXPECT_EQ(image.flags(x, 10), 0) << x;
  }
  EXPECT_NEAR(image.amplitude(50, 10), 5e3, 1.0);   // m N
  EXPECT_NEAR(image.amplitude(150, 10), 3e4, 1.0);  // a tenth of 60 times as much
}

/// What the longest exposure finds too dark is no better in a shorter one, whose noise may pass for a signal.
TEST(Exposures, AreNotTakenForWhatIsTooDark) {
  const SensorModel model = threeExposures("[decoder]\nminimum_amplitude_electrons = 1000\n" + kWell + kShotNoise +
                                           "[[effect]]\ntype = 'read_noise'\nsigma_electrons = 1000\n");
  const TraceRequest request = model.traceRequest();
  const Light dark = syntheticLight(model.camera().width, model.camera().height, request.frequencies, 1,
                                    [](int, int) { return std::vector<Way>{{0.02, 1.1}}; });
  const RangeImage image = model.expose(dark, {}, 1, 0).range;
  std::size_t invalid = 0;
  for (std::size_t i = 0; i < image.range_m.size(); ++i) {
    ASSERT_EQ(image.exposure[i], 0);
    invalid += std::isnan(image.range_m[i]) ? 1 : 0;
  }
  EXPECT_GT(invalid, image.range_m.size() / 4) << "too bright to tell";
}

TEST(Exposures, OneAloneLosesTheBrightPixels) {
  const SensorModel model = modelOf(plainCamera(4, 2, 0.5, kWell));
  const RangeImage image = model.expose(brightAndDark(model), {}, 1, 0).range;
  EXPECT_TRUE(image.exposure.empty());
  EXPECT_TRUE(std::isnan(image.range_m(150, 10)));
}

TEST(Exposures, AreTakenOneAfterTheOther) {
  const SensorModel model = threeExposures("");
  const auto exposures = model.exposures({0});
  ASSERT_EQ(exposures.size(), 12u);
  EXPECT_NEAR(exposures[4].duration.in(microsecond), 100.0, 1e-9);
  EXPECT_EQ(exposures[4].start.ns, 4 * 1'500'000);
  EXPECT_EQ(exposures[5].start.ns, 4 * 1'500'000 + 600'000);
  EXPECT_NEAR(model.exposureTime().in(microsecond), 4 * 1500 + 4 * 600 + 4 * 510 - 500, 1e-6);
}

TEST(Exposures, HaveNoiseOfTheirOwn) {
  const SensorModel model =
      threeExposures("[[effect]]\ntype = 'read_noise'\nsigma_electrons = 100\n");
  const Samples samples = model.expose(evenLight(model, 1.0, 1.1), {}, 1, 0).samples;
  ASSERT_EQ(samples.electrons.size(), 24u);
  double product = 0.0, squares = 0.0;
  const Samples clean = model.collect(evenLight(model, 1.0, 1.1), {}, 1, 0);
  std::size_t pixels = 0;
  for (std::size_t image = 0; image < 8; ++image) {
    for (std::size_t i = 0; i < samples.electrons[image].size(); ++i, ++pixels) {
      const auto a = static_cast<double>(samples.electrons[image][i] - clean.electrons[image][i]);
      const auto b = static_cast<double>(samples.electrons[image + 8][i] - clean.electrons[image + 8][i]);
      product += a * b;
      squares += a * a;
    }
  }
  // Four standard errors of a correlation of so many: one seed in 16,000 would be beyond.
  const double most = 4.0 / std::sqrt(static_cast<double>(pixels));
  ASSERT_LT(most, 0.01);
  EXPECT_LT(std::abs(product / squares), most);
}

TEST(Exposures, ThePlaneSaysWhichWasTaken) {
  const SensorModel model = threeExposures(kWell);
  const Light light = brightAndDark(model);
  const PlaneKind kinds[] = {PlaneKind::Exposure};
  const auto planes = planesOf(model, model.expose(light, {}, 1, 0), light.truth, kinds);
  ASSERT_EQ(planes.size(), 1u);
  EXPECT_EQ(planes[0].type, ElementType::U8);
  EXPECT_EQ(planes[0].as<std::uint8_t>()[300], 2);
  EXPECT_THAT(planesOfCamera(model), testing::Contains(PlaneKind::Exposure));
  EXPECT_THAT(planesOfCamera(modelOf(plainCamera(4, 2, 0.5))),
              testing::Not(testing::Contains(PlaneKind::Exposure)));
}

TEST(Exposures, MustGetShorter) {
  EXPECT_THAT(errorOf("[[emitter]]\n[[modulation]]\n[sampling]\nexposure_factors = [1.0, 1.0]\n"),
              HasSubstr("each shorter than the one before"));
  EXPECT_THAT(
      errorOf("[[emitter]]\n[[modulation]]\n[sampling]\nexposure_factors = [1, 0.5, 0.2, 0.1]\n"),
      HasSubstr("one to three"));
}

TEST(Temperatures, RiseWithTheTimeSincePowerOn) {
  const SensorModel model =
      modelOf(plainCamera(4, 2, 0.5,
                          "[thermal]\nillumination_rise_c = 27.2\nillumination_time_s = "
                          "300\nsensor_rise_c = 10\nsensor_time_s = 600\n"));
  const auto at = [&](double seconds) { return model.temperatures(23_degC, seconds * second); };
  ASSERT_EQ(at(0.0).size(), 2u);
  EXPECT_EQ(at(0.0)[0].where, "illumination");
  EXPECT_EQ(at(0.0)[1].where, "sensor");
  EXPECT_NEAR(at(0.0)[0].value.in(celsius), 23.0, 1e-9);
  EXPECT_NEAR(at(300.0)[0].value.in(celsius), 23.0 + 27.2 * (1.0 - std::exp(-1.0)), 1e-9);
  EXPECT_NEAR(at(1e6)[1].value.in(celsius), 33.0, 1e-9);
  EXPECT_TRUE(modelOf(plainCamera(4, 2, 0.5)).temperatures(23_degC, 100_s).empty());
}

}  // namespace
}  // namespace toftwin::sim
