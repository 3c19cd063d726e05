// SPDX-License-Identifier: Apache-2.0
// Cameras whose verdict, margin and cause can be written down before.
#include <cmath>

#include "cases.h"

namespace toftwin::suit {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const std::string kBias10 = "[[require]]\nname = 'bias'\nkind = 'bias'\nat_most_mm = 10\n";
/// What decoding in single precision leaves at 2 m, mm; measured 2e-3.
constexpr double kRounding_mm = 0.02;

const CameraResult& only(const Suit& suit) { return suit.cameras.front(); }

TEST(Planted, ACameraWithoutErrorDoesEverything) {
  const Folder folder;
  folder.camera("ideal.toml");
  const auto suit = folder.judged(kPose + kBias10 + R"(
[[require]]
name = 'accurate'
kind = 'accuracy'
object = 'box'
within_mm = 0.05
at_least_percent = 100
[[require]]
name = 'quiet'
kind = 'noise'
at_most_mm = 0
[[require]]
name = 'rate'
kind = 'frame_rate'
at_least_hz = 20
)" + entry("ideal.toml"));
  ASSERT_TRUE(suit) << suit.error().message;
  EXPECT_TRUE(only(*suit).isFit()) << inWords(*suit);
  EXPECT_NEAR(only(*suit).requirements[0].verdict.margin, 10.0, kRounding_mm);
  for (const auto& one : only(*suit).requirements) EXPECT_TRUE(one.verdict.is_met);
  // "All pixels" is met in every frame and yet no number of frames makes it certain.
  for (const std::size_t r : {0u, 2u, 3u}) EXPECT_TRUE(only(*suit).requirements[r].verdict.is_certain);
  EXPECT_FALSE(only(*suit).requirements[1].verdict.is_certain);
}

/// Offset 25 mm, limit 10: it fails by 15, and without the effect it gains from −15 to +10. The noise has a
/// mean over 768 pixels and 12 frames of 0.01 mm, its median 0.013: five of these.
TEST(Planted, AnOffsetFailsByWhatItIsTooLargeAndIsFoundAsTheCause) {
  const Folder folder;
  folder.camera("late.toml", effect("range_noise", "sigma_mm = 1") + effect("delay", "offset_mm = 25"));
  const auto suit = folder.judged(kPose + kBias10 + entry("late.toml"));
  ASSERT_TRUE(suit) << suit.error().message;
  const CameraResult& camera = only(*suit);
  const RequirementResult& bias = camera.requirements[0];
  EXPECT_FALSE(bias.verdict.is_met);
  EXPECT_TRUE(bias.verdict.is_certain);
  EXPECT_NEAR(bias.verdict.margin, -15.0, kRounding_mm + 0.065);
  ASSERT_FALSE(camera.spoilers[0].empty());
  const Spoiler& first = camera.spoilers[0].front();
  EXPECT_EQ(first.what, "delay");
  EXPECT_NEAR(first.gain.value, 25.0, 2.0 * kRounding_mm + 0.15);
  EXPECT_TRUE(first.is_met_without);
  const auto noise = std::ranges::find(camera.spoilers[0], "range_noise", &Spoiler::what);
  EXPECT_FALSE(noise->is_met_without);
}

/// Normal errors of σ = 10 mm: 68.27 % are within 10 mm. 768 pixels × 12 frames: standard error 0.48 %; 2.5 %
/// are five of these.
TEST(Planted, NoiseLeavesTheShareOfANormalDistribution) {
  const Folder folder;
  folder.camera("noisy.toml", effect("range_noise", "sigma_mm = 10"));
  const auto suit = folder.judged(kPose + R"(
[[require]]
name = 'accurate'
kind = 'accuracy'
within_mm = 10
at_least_percent = 95
)" + entry("noisy.toml"));
  ASSERT_TRUE(suit) << suit.error().message;
  EXPECT_NEAR(only(*suit).requirements[0].verdict.estimate.value, std::erf(std::sqrt(0.5)), 0.025);
  EXPECT_EQ(only(*suit).spoilers[0].front().what, "range_noise");
}

TEST(Planted, AFrameRateIsThatOfTheFile) {
  const Folder folder;
  folder.camera("ideal.toml");
  const auto suit = folder.judged(
      kPose + "[[require]]\nname = 'rate'\nkind = 'frame_rate'\nat_least_hz = 30\n" + entry("ideal.toml"));
  ASSERT_TRUE(suit) << suit.error().message;
  EXPECT_DOUBLE_EQ(only(*suit).requirements[0].verdict.margin, -10.0);
}

/// 30 ms of exposures at 20 frames a second: at four times that a frame takes 8 × 15 + 7 × 0.5 = 123.5 ms.
TEST(Planted, ALongExposureLowersTheFrameRate) {
  const Folder folder;
  folder.camera("ideal.toml");
  const auto suit =
      folder.judged(kPose + "[[require]]\nname = 'rate'\nkind = 'frame_rate'\nat_least_hz = 30\n" +
                    entry("ideal.toml", "[15.0]"));
  ASSERT_TRUE(suit) << suit.error().message;
  EXPECT_NEAR(only(*suit).requirements[0].verdict.estimate.value, 1e3 / 123.5, 1e-6);
}

/// The well holds what three times the exposure collects: four times that saturates, twice it is best.
TEST(Planted, TheBestExposureIsTheLongestThatDoesNotSaturate) {
  const Folder folder;
  const std::string noisy = effect("shot_noise") + effect("read_noise", "sigma_electrons = 200");
  // Brightest pixel: albedo 0.5 at 1.5 m straight ahead, 2 W Lambertian: L = 0.5/π · (2/π)/1.5² = 0.045 W/(m²
  // sr), one tap half of 8.2e7 · 1e-3 s · L · (1 + contrast 0.5): 2769 electrons at the file's exposure.
  folder.camera("deep.toml", noisy + effect("saturation", "full_well_electrons = 8300"));
  const auto suit = folder.judged(kPose + R"(
[[require]]
name = 'quiet'
kind = 'noise'
at_most_mm = 1
[[require]]
name = 'valid'
kind = 'valid'
at_least_percent = 100
)" + entry("deep.toml", "[0.25, 0.5, 1.0, 2.0, 4.0]"));
  ASSERT_TRUE(suit) << suit.error().message;
  EXPECT_DOUBLE_EQ(only(*suit).tries[only(*suit).best].exposure_us, 2000.0);
  EXPECT_EQ(only(*suit).tries.size(), 5u);
}

/// 100 klx: 27 W/m² on albedo 0.5 are 4.3 W/(m² sr), a hundred times the camera's own light: the well is
/// full.
TEST(Planted, SunThatFillsTheWellIsFoundAsTheCauseAndDarknessIsNotBlamed) {
  const Folder folder;
  folder.camera("dazzled.toml",
                effect("ambient_light") + effect("saturation", "full_well_electrons = 20000"));
  const auto suit = folder.judged(kPose + R"(
[[lighting]]
name = 'dark'
[[lighting]]
name = 'noon'
ambient_klx = 100
[[require]]
name = 'in the dark'
kind = 'valid'
at_least_percent = 100
lightings = ['dark']
[[require]]
name = 'at noon'
kind = 'valid'
at_least_percent = 100
lightings = ['noon']
)" + entry("dazzled.toml"));
  ASSERT_TRUE(suit) << suit.error().message;
  const CameraResult& camera = only(*suit);
  EXPECT_TRUE(camera.requirements[0].verdict.is_met);
  EXPECT_FALSE(camera.requirements[1].verdict.is_met);
  EXPECT_EQ(camera.requirements[1].conditions.size(), 1u);
  // Either of the two mends it wholly.
  for (const std::string cause : {"ambient_light", "saturation"}) {
    const auto found = std::ranges::find(camera.spoilers[1], cause, &Spoiler::what);
    ASSERT_NE(found, camera.spoilers[1].end());
    EXPECT_TRUE(found->isSpoiling() && found->is_met_without) << cause;
  }
}

/// The same where the value is a bias, which does not exist while no pixel is valid: there is no gain to
/// tell, and yet either of the two is the cause. Dark range noise of 3 mm, over 768 pixels and 12 frames, is
/// not.
TEST(Planted, SunThatLeavesNoPixelValidIsFoundAsTheCauseOfABiasThatCannotBeTold) {
  const Folder folder;
  folder.camera("dazzled.toml", effect("ambient_light") +
                                    effect("saturation", "full_well_electrons = 20000") +
                                    effect("range_noise", "sigma_mm = 3"));
  const auto suit = folder.judged(kPose + "[[lighting]]\nname = 'noon'\nambient_klx = 100\n" + kBias10 +
                                  entry("dazzled.toml"));
  ASSERT_TRUE(suit) << suit.error().message;
  const CameraResult& camera = only(*suit);
  ASSERT_FALSE(camera.requirements[0].verdict.is_met);
  ASSERT_TRUE(std::isnan(camera.requirements[0].verdict.estimate.value));
  for (std::size_t i = 0; i < 2; ++i) {
    const Spoiler& cause = camera.spoilers[0][i];
    EXPECT_THAT(cause.what, testing::AnyOf("ambient_light", "saturation"));
    EXPECT_TRUE(cause.isSpoiling() && cause.is_met_without) << cause.what;
  }
  EXPECT_FALSE(std::ranges::find(camera.spoilers[0], "range_noise", &Spoiler::what)->isSpoiling());
  ASSERT_TRUE(writeSuit(*suit, folder.path() / "report", ""));
  std::stringstream words;
  words << std::ifstream{folder.path() / "report/report.md"}.rdbuf();
  EXPECT_THAT(words.str(), AllOf(HasSubstr("with which nothing is valid: without it, it would be met"),
                                 testing::Not(HasSubstr("no single effect"))));
}

/// Pulses of 30 and 60 ns need light of their own: a ratio of charges that one's gates let through is another
/// range with the other's, metres off. Each range is 4.5 m or more; the wall is at 2 m.
TEST(Planted, ModesWithOtherGatesSeeLightOfTheirOwn) {
  const Folder folder;
  for (const std::string width : {"30", "60"}) {
    std::string text =
        "[lens]\nwidth = 16\nheight = 12\nfx = 26.0\nfy = 26.0\ncx = 7.5\ncy = 5.5\n"
        "[[emitter]]\npower_w = 2.0\n[[pulse]]\nwidth_ns = " +
        width +
        ".0\n"
        "[decoder]\nalgorithm = \"pulsed\"\n[sampling]\nfactory_calibration = \"waveform\"\n";
    folder.write("pulse" + width + ".toml", text);
  }
  for (const std::string order : {"'pulse30.toml', 'pulse60.toml'", "'pulse60.toml', 'pulse30.toml'"}) {
    const auto suit =
        folder.judged(kPose + kBias10 + "[[camera]]\nmodels = [" + order + "]\nexposure_factors = [1.0]\n");
    ASSERT_TRUE(suit) << suit.error().message;
    ASSERT_EQ(only(*suit).tries.size(), 2u);
    for (const Try& one : only(*suit).tries) EXPECT_EQ(one.failed, 0u) << one.mode << " of " << order;
  }
}

/// 2 m/s towards the wall and 1.5 ms from one raw exposure to the next: 3 mm each, which phases of 100 MHz
/// see.
TEST(Planted, MotionIsFoundAsTheCause) {
  const Folder folder;
  folder.camera("ideal.toml");
  const auto suit =
      folder.judged("[[pose]]\nname = 'driving'\nvelocity_m_per_s = [0, 0, 2]\n" + std::string{R"(
[[require]]
name = 'accurate'
kind = 'accuracy'
object = 'wall'
within_mm = 0.5
at_least_percent = 95
)"} + entry("ideal.toml"));
  ASSERT_TRUE(suit) << suit.error().message;
  EXPECT_FALSE(only(*suit).requirements[0].verdict.is_met);
  EXPECT_EQ(only(*suit).spoilers[0].front().what, "motion");
  EXPECT_TRUE(only(*suit).spoilers[0].front().is_met_without);
}

/// 100 MHz decide, whose four raw exposures are in their middles 6.5, 8, 9.5 and 11 ms after the frame's
/// start: 8.75 ms on the mean, when the wall is 2 m/s · 2.25 ms nearer than in the middle of the middle one,
/// to which truth belongs. Besides, samples that are 4π · 3 mm / 3 m = 12.6 mrad of phase apart make a cyclic
/// error of at most half of that: 1.5 mm. Rays are up to 0.6 rad off the axis, so that the median of the
/// projections is 0.93.
TEST(Planted, AMovingCameraIsOffByItsWayToTheExposuresThatDecide) {
  const Folder folder;
  folder.camera("ideal.toml");
  const auto suit = folder.judged(
      "[[pose]]\nname = 'driving'\nvelocity_m_per_s = [0, 0, 2]\n" +
      std::string{"[[require]]\nname = 'it'\nkind = 'bias'\nobject = 'wall'\nat_most_mm = 1\n"} +
      entry("ideal.toml"));
  ASSERT_TRUE(suit) << suit.error().message;
  EXPECT_NEAR(only(*suit).requirements[0].verdict.estimate.value, -4.5 * 0.93, 1.6);
}

/// A footprint of one pixel mixes box and wall along the box's outline, and nothing else is wrong.
TEST(Planted, MixedPixelsAreFoundAsTheCause) {
  const Folder folder;
  folder.camera("ideal.toml");
  auto use = folder.use(kPose + R"(
[[require]]
name = 'accurate'
kind = 'accuracy'
within_mm = 20
at_least_percent = 100
)" + entry("ideal.toml"));
  ASSERT_TRUE(use) << use.error().message;
  use->spec.pixel_extent = 1.0;
  use->spec.samples_per_pixel = 64;
  compare::Progress quiet{nullptr};
  const auto suit = judge(*use, {}, quiet);
  ASSERT_TRUE(suit) << suit.error().message;
  EXPECT_FALSE(only(*suit).requirements[0].verdict.is_met);
  EXPECT_EQ(only(*suit).spoilers[0].front().what, "mixed pixels");
  EXPECT_TRUE(only(*suit).spoilers[0].front().is_met_without);
}

/// The box is 1 m wide at 1.5 m, its left edge on the axis: 26 · 1/1.5 = 17.3 pixels from the middle to the
/// right of which the image has 16; 17.3 rows, half of them above. Its left side is seen edge on.
TEST(Planted, PixelsOfAnObjectAreCountedByItsOutline) {
  const Folder folder;
  folder.camera("ideal.toml");
  const auto suit = folder.judged(
      kPose + "[[require]]\nname = 'size'\nkind = 'pixels'\nobject = 'box'\nat_least_pixels = 1\n" +
      entry("ideal.toml"));
  ASSERT_TRUE(suit) << suit.error().message;
  // Columns 16 to 31, rows whose |y − 11.5| < 8.67: 3 to 20.
  EXPECT_EQ(only(*suit).requirements[0].verdict.estimate.value, 16.0 * 18.0);
}

TEST(Planted, ARegionTakesWhatLiesWithinIt) {
  const Folder folder;
  folder.camera("ideal.toml");
  const auto suit = folder.judged(kPose + R"(
[[region]]
name = 'front'
lower_m = [-5, -5, 1.49]
upper_m = [5, 5, 1.51]
[[require]]
name = 'size'
kind = 'pixels'
region = 'front'
at_least_pixels = 1
)" + entry("ideal.toml"));
  ASSERT_TRUE(suit) << suit.error().message;
  EXPECT_EQ(only(*suit).requirements[0].verdict.estimate.value, 16.0 * 18.0);
}

TEST(Planted, ACameraThatDoesNotSeeTheObjectDoesNotFitAndTheOthersAreJudged) {
  const Folder folder;
  const std::string wide = folder.camera("wide.toml");
  folder.write("narrow.toml", R"(
[lens]
width = 8
height = 8
fx = 800.0
fy = 800.0
cx = 103.5
cy = 3.5
[[emitter]]
[[modulation]]
)");
  const std::string rest =
      kPose + "[[require]]\nname = 'seen'\nkind = 'valid'\nat_least_percent = 50\nobject = 'box'\n";
  const auto suit = folder.judged(rest + entry("narrow.toml") + entry("wide.toml"));
  ASSERT_TRUE(suit) << suit.error().message;
  EXPECT_EQ(suit->cameras[0].name, "wide.toml");
  EXPECT_THAT(suit->cameras[1].cannot, AllOf(HasSubstr("case.toml:13"), HasSubstr("none of its 8 x 8 pixels"),
                                             HasSubstr("sees \"box\""), HasSubstr("case.toml:8")));
  const auto none = folder.judged(rest + entry("narrow.toml"));
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("no camera can be judged"));
}

TEST(Planted, AnUnknownCameraOfTheCommandLineIsNamed) {
  const Folder folder;
  folder.camera("ideal.toml");
  const auto suit = folder.judged(kPose + kBias10 + entry("ideal.toml"), {"kinect"});
  ASSERT_FALSE(suit);
  EXPECT_THAT(suit.error().message, HasSubstr("there is no camera \"kinect\"; there are: ideal.toml"));
}

TEST(Planted, TheReportSaysVerdictCauseAndWhereAndHoldsItsNumbers) {
  const Folder folder;
  folder.camera("late.toml", effect("delay", "offset_mm = 25"));
  const auto suit = folder.judged(kPose + kBias10 + entry("late.toml"));
  ASSERT_TRUE(suit) << suit.error().message;
  const auto page = writeSuit(*suit, folder.path() / "report", "a note");
  ASSERT_TRUE(page) << page.error().message;
  std::stringstream html, json;
  html << std::ifstream{*page}.rdbuf();
  json << std::ifstream{folder.path() / "report/report.json"}.rdbuf();
  EXPECT_THAT(html.str(), AllOf(HasSubstr("The one camera, "),
                                HasSubstr("is spoiled most by delay: without it, it would be met"),
                                HasSubstr("at most 10 mm"), HasSubstr("a note")));
  EXPECT_THAT(html.str(), testing::Not(HasSubstr("http")));
  EXPECT_THAT(json.str(), AllOf(HasSubstr("\"left_out\": \"delay\""), HasSubstr("\"met_without\": true"),
                                HasSubstr("\"pose\": \"here\"")));
}

}  // namespace
}  // namespace toftwin::suit
