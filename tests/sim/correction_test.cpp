// SPDX-License-Identifier: Apache-2.0
// What was learned, added and taken off again.
#include "sim/effects/learned/correction.h"

#include <gmock/gmock.h>

#include <cmath>
#include <optional>

#include <toftwin/nan.h>

#include "sim/effects/learned/covariates.h"
#include "sim/effects/learned/ready_correction.h"
#include "tests/sim/camera_testing.h"
#include "tests/sim/terms/random_terms.h"

namespace toftwin::sim {
namespace {

using terms::RandomTerms;
using terms::Term;
using testing::HasSubstr;

constexpr int kWidth = 23, kHeight = 17;

CameraInfo cameraHere() {
  CameraInfo camera = cameraOfSize(kWidth, kHeight);
  camera.cx = 10.3, camera.cy = 8.1;
  return camera;
}

Moment momentHere() {
  Moment moment;
  moment.exposures = {{.start = {}, .duration = 0.7 * millisecond, .modulation = 20_MHz}};
  moment.since_power_on = 210.0 * second;
  moment.temperatures = {{"illumination", 41.0 * celsius}};
  moment.ambient = 12.0 * kilolux;
  return moment;
}

RangeImage imageHere() {
  RangeImage image{.range_m = {kWidth, kHeight}, .amplitude = {kWidth, kHeight}, .ambient = {kWidth, kHeight},
                   .flags = {kWidth, kHeight}, .phasors = {}};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      image.range_m(x, y) = (x + 3 * y) % 29 == 5 ? static_cast<float>(kNaN) : static_cast<float>(0.6 + 0.011 * ((x * 37 + y * 101) % 331));
      image.amplitude(x, y) = static_cast<float>(300.0 + 7.3 * ((x * 91 + y * 17) % 401));
    }
  }
  return image;
}

struct Span {
  const char* name;
  double low, high;
};
/// Of the decoded image; where their numbers lie in it.
constexpr Span kSpans[] = {{"range_mm", 600, 4300},  {"range_m", 0.6, 4.3},        {"amplitude_e", 300, 3300},
                           {"column", 0, 23},        {"row", 0, 17},               {"radius_px", 0, 14},
                           {"time_s", 1, 1000},      {"temperature_sensor_c", 20, 60}, {"ambient_klx", 1, 30},
                           {"exposure_us", 100, 2000}, {"frame", 0, 20}};

/// A term of the decoded image. What goes with the range has so small a slope that r + t(r) rises: `steepest` bounds
/// |dt/dr|; bases that jump are of other covariates.
Term randomTerm(RandomTerms& random, terms::Quantity quantity) {
  using terms::Basis;
  const bool is_range = quantity == terms::Quantity::RangeMm;
  Term term{.quantity = quantity, .coefficient = random.between(-8.0, 8.0)};
  bool has_pixel = false;
  for (int count = random.upTo(2); count > 0; --count) {
    const Span& span = kSpans[random.upTo(std::size(kSpans) - 1)];
    const bool is_pixel = std::string_view{span.name}.starts_with("range") || std::string_view{span.name} == "amplitude_e";
    if (is_pixel && std::exchange(has_pixel, true)) continue;
    Basis basis = Basis::Level;
    const auto jumps = [](Basis one) { return one == Basis::Step || one == Basis::Sawtooth || one == Basis::Class; };
    const auto is_angle = [](Basis one) { return one == Basis::Secant || one == Basis::Tangent2; };
    while (basis == Basis::Level || (is_pixel && (jumps(basis) || is_angle(basis))))
      basis = terms::kBasisWords[static_cast<std::size_t>(random.upTo(terms::kBasisWords.size() - 1))].basis;
    terms::Factor factor = random.factor(basis, {{{1.0, span.name}}}, span.low, span.high);
    if (basis == Basis::Decay || basis == Basis::Sine || basis == Basis::Cosine || basis == Basis::Sawtooth)
      factor.numbers[0] = 0.4 * (span.high - span.low);
    if (basis == Basis::Power && std::abs(factor.numbers[0]) > 1.0) factor.numbers[0] = 1.0;
    // As large as 1 within the span, so that the product is as large as the coefficient.
    double largest = 1e-3;
    for (int i = 0; i <= 50; ++i) {
      const double value = std::abs(terms::valueOf(factor, span.low + (span.high - span.low) * i / 50.0));
      if (std::isfinite(value)) largest = std::max(largest, value);
    }
    term.coefficient /= largest;
    term.factors.push_back(std::move(factor));
  }
  if (!is_range) term.coefficient *= 0.2;
  return term;
}

terms::Lookup lookupAt(const RangeImage& image, const Conditions& now, int x, int y) {
  return [&image, &now, x, y](std::string_view name) -> terms::Known {
    if (name == "range_mm") return {1e3 * static_cast<double>(image.range_m(x, y)), {}};
    if (name == "range_m") return {static_cast<double>(image.range_m(x, y)), {}};
    if (name == "amplitude_e") return {static_cast<double>(image.amplitude(x, y)), {}};
    const LearnedCovariate* covariate = learnedCovariate(name);
    if (covariate->of_place != nullptr) return {covariate->of_place(now.camera, x, y), {}};
    return knownOfFrame(name, now);
  };
}

/// The law of the language: what the search predicts, what the simulator adds and what the correction takes off agree.
TEST(TermsLaw, PredictionSimulatorAndCorrectionAgreeForRandomTerms) {
  constexpr std::uint64_t kSeed = 451;
  RandomTerms random{kSeed};
  const Moment moment = momentHere();
  const CameraInfo camera = cameraHere();
  for (int i = 0; i < 1500; ++i) {
    std::vector<Term> range_terms, amplitude_terms;
    for (int count = 1 + random.upTo(2); count > 0; --count) range_terms.push_back(randomTerm(random, terms::Quantity::RangeMm));
    if (random.oneIn(3)) amplitude_terms.push_back(randomTerm(random, terms::Quantity::AmplitudePercent));
    std::vector<Term> all = range_terms;
    all.insert(all.end(), amplitude_terms.begin(), amplitude_terms.end());
    const Learned learned{.title = {}, .terms = all};
    ASSERT_EQ(learned.problem(), "") << "seed " << kSeed << ", set " << i;
    const Conditions now{moment, camera, 0, 0, {}, 17};
    const RangeImage before = imageHere();
    const RangeImage after = learned.apply(before, now, Random{1, 17, 3});
    const auto correction = Correction::of({learned});
    ASSERT_TRUE(correction.ok()) << correction.error().message;
    const auto undone = correction->undone({after.range_m, after.amplitude}, now);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const auto r = static_cast<double>(before.range_m(x, y)), a = static_cast<double>(before.amplitude(x, y));
        ASSERT_EQ(std::isnan(after.range_m(x, y)), std::isnan(r));
        ASSERT_EQ(std::isnan(undone.range_m(x, y)), std::isnan(r));
        const terms::Lookup lookup = lookupAt(before, now, x, y);
        const std::string where = toText(all.front()) + " at " + std::to_string(x) + ", " + std::to_string(y) + ", seed " +
                                  std::to_string(kSeed) + ", set " + std::to_string(i);
        // A float of 4 m is known to 2.4e-7 m, of 3000 electrons to 1.2e-4 electrons.
        if (!std::isnan(r)) {
          ASSERT_NEAR(static_cast<double>(after.range_m(x, y)), r + 1e-3 * terms::sumOf(range_terms, lookup), 3e-7) << where;
          ASSERT_NEAR(static_cast<double>(undone.range_m(x, y)), r, 6e-7) << where;
        }
        const double gain = 1.0 + 1e-2 * terms::sumOf(amplitude_terms, lookup);
        ASSERT_NEAR(static_cast<double>(after.amplitude(x, y)), a * gain, 3e-7 * a) << where;
        if (std::isnan(r)) continue;
        ASSERT_NEAR(static_cast<double>(undone.amplitude(x, y)), a, 4e-6 * a) << where;
      }
    }
  }
}

std::string whyNot(const std::string& text) {
  const auto correction = Correction::of({Learned{.title = {}, .terms = LearnedTerms::parsed({text})}});
  return correction.ok() ? "it can" : correction.error().message;
}

TEST(Correction, RefusesWhatCannotBeUndoneByName) {
  EXPECT_THAT(whyNot("noise_mm += 3"), HasSubstr("\"noise_mm += 3\" cannot be undone: noise cannot be taken off"));
  EXPECT_THAT(whyNot("invalid_percent += 3"), HasSubstr("cannot be brought back"));
  EXPECT_THAT(whyNot("range_mm += 0.1 * around()"), HasSubstr("it goes with what other pixels see"));
  EXPECT_THAT(whyNot("range_mm += 0.1 * before()"), HasSubstr("it goes with the frame before"));
  EXPECT_THAT(whyNot("delay_mm += 3"), HasSubstr("it acts on the camera's light"));
  EXPECT_THAT(whyNot("in_phase_e += 3"), HasSubstr("it acts on the camera's samples"));
  EXPECT_THAT(whyNot("range_mm += 3 * plate_mm"), HasSubstr("knows no \"plate_mm\""));
  EXPECT_EQ(whyNot("range_mm += 3 * row"), "it can");
}

TEST(Correction, UndoesSeveralEffectsFromTheLastToTheFirst) {
  const std::vector<Learned> effects{{.title = {}, .terms = LearnedTerms::parsed({"range_mm += 300"})},
                                     {.title = {}, .terms = LearnedTerms::parsed({"range_mm += 0.1 * range_mm"})}};
  const Moment moment;
  const CameraInfo camera = cameraHere();
  const Conditions now{moment, camera};
  RangeImage image = imageHere();
  for (const Learned& effect : effects) image = effect.apply(std::move(image), now, Random{1, 1, 1});
  const auto undone = Correction::of(effects)->undone({image.range_m, {}}, now);
  EXPECT_NEAR(image.range_m(0, 0), 1.1 * (static_cast<double>(imageHere().range_m(0, 0)) + 0.3), 1e-6);
  EXPECT_NEAR(undone.range_m(0, 0), imageHere().range_m(0, 0), 1e-6);
}

// What is kept from frame to frame must not be that of another frame.
TEST(Correction, ReadyForACameraGivesEachFrameTheSameBitsAsAlone) {
  const auto correction = Correction::of({Learned{.title = {}, .terms = LearnedTerms::parsed({
      "range_mm += 9 * sine(range_mm, 700) * decay(time_s, 300)", "range_mm += 0.2 * column", "range_mm += 4 * class(column, 3, 1) * log(range_mm)",
      "amplitude_percent += 0.001 * range_mm"})}});
  ASSERT_TRUE(correction.ok()) << correction.error().message;
  const CameraInfo camera = cameraHere();
  std::optional<ReadyCorrection> ready;
  for (const double time_s : {5.0, 5.0, 400.0, 20.0}) {
    Moment moment;
    moment.since_power_on = time_s * second;
    const Conditions now{moment, camera};
    if (!ready) ready.emplace(correction->effects(), kWidth, kHeight, now);
    const RangeImage image = imageHere();
    const auto kept = ready->undone({image.range_m, image.amplitude}, now), alone = correction->undone({image.range_m, image.amplitude}, now);
    for (std::size_t i = 0; i < image.range_m.size(); ++i) {
      if (std::isnan(image.range_m[i])) continue;
      ASSERT_EQ(kept.range_m[i], alone.range_m[i]) << time_s;
      ASSERT_EQ(kept.amplitude[i], alone.amplitude[i]) << time_s;
    }
  }
}

TEST(Correction, OfRangesBeyondAllGuessesIsFoundToo) {
  const auto correction = Correction::of({Learned{.title = {}, .terms = LearnedTerms::parsed({"range_mm += 5 * sine(range_mm, 900)", "range_mm += 0.1 * range_mm"})}});
  const Moment moment;
  const CameraInfo camera = cameraHere();
  Image<float> range_m{4, 1};
  range_m[0] = 0.03F, range_m[1] = 15.0F, range_m[2] = 40.0F, range_m[3] = -0.2F;
  const auto undone = correction->undone({range_m, {}}, {moment, camera});
  for (int i = 0; i < 4; ++i) {
    const double r = 1e3 * static_cast<double>(undone.range_m(i, 0));
    EXPECT_NEAR(r + 0.1 * r + 5.0 * std::sin(2.0 * M_PI * r / 900.0), 1e3 * static_cast<double>(range_m(i, 0)), 4e-3) << i;  // a float of 40 m
  }
}

// Nothing is r with r + 40 mm · step(r, 2 m) = 2.02 m: what is met is r + t(r) = 2.02 from either side of the jump.
TEST(Correction, WithinAJumpTakesARangeBesideIt) {
  const auto correction = Correction::of({Learned{.title = {}, .terms = LearnedTerms::parsed({"range_mm += 40 * step(range_mm, 2000)"})}});
  const Moment moment;
  const CameraInfo camera = cameraHere();
  Image<float> range_m{3, 1};
  range_m[0] = 1.5F, range_m[1] = 2.02F, range_m[2] = 2.54F;
  const auto undone = correction->undone({range_m, {}}, {moment, camera});
  EXPECT_EQ(undone.range_m[0], 1.5F);
  EXPECT_NEAR(undone.range_m[1], 2.0, 0.021);
  EXPECT_NEAR(undone.range_m[2], 2.5, 1e-6);
}

TEST(Correction, SaysWhatAMomentDoesNotTell) {
  const auto right = Correction::of({Learned{.title = {}, .terms = LearnedTerms::parsed({"range_mm += 4 * time_s * row", "range_mm += 1 * ambient_klx"})}});
  const Moment moment = [] {
    Moment knows_time;
    knows_time.since_power_on = 3_s;
    return knows_time;
  }();
  const CameraInfo camera = cameraHere();
  EXPECT_THAT(right->unknownOf({moment, camera}), testing::ElementsAre("ambient_klx"));
}

}  // namespace
}  // namespace toftwin::sim
