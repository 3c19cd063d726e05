// SPDX-License-Identifier: Apache-2.0
// What a campaign says of effects that may be missing, before anybody looks for one.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <filesystem>
#include <numbers>
#include <set>

#include "calib/discover/campaign/answer/discover_campaign.h"
#include "calib/discover/campaign/captures/catalogue.h"
#include "calib/discover/campaign/captures/light_delay.h"
#include "calib/discover/campaign/captures/sites.h"
#include "calib/discover/campaign/rows/carriers.h"
#include "calib/discover/campaign/rows/refit.h"
#include "calib/discover/campaign/rows/rows.h"
#include "calib/discover/campaign/search/model_file.h"
#include "calib/discover/marginal.h"
#include "calib/discover/significance.h"
#include "tests/discover/simulated_run.h"

namespace toftwin::discover {
namespace {

struct Made {
  const Campaign& campaign;
  const std::vector<std::shared_ptr<const TracedCapture>>& traced;
  const Lights& lights;
  CampaignRows rows;
};

class Rows : public testing::Test {
 protected:
  Rows() : folder_(std::filesystem::temp_directory_path() / fmt::format("toftwin-rows-{}", ::getpid())) {}
  ~Rows() override { std::filesystem::remove_all(folder_); }

  Made make(const std::string& hidden, const std::string& of_camera = smallCamera(),
            const std::string& of_plan = smallPlan(), const decltype(SimulatedRun::spoil)& spoil = {}) {
    const auto plan = plan::parsePlan(of_plan, "plan.toml");
    const auto camera = sim::SensorModel::parse(of_camera + hidden, "camera.toml");
    const auto declared = sim::SensorModel::parse(of_camera, "camera.toml");
    const auto scene = sim::Scene::parse(smallScene(), "scene.toml");
    if (!plan || !camera || !declared || !scene)
      throw std::runtime_error("the small campaign's files are wrong");
    write(SimulatedRun{.plan = *plan, .camera = *camera, .scene = *scene, .spoil = spoil}, folder_);
    auto campaign = readCampaign(folder_, Side::A);
    if (!campaign) throw std::runtime_error(campaign.error().message);
    auto traced = traceAll({*declared, *scene}, campaign->captures, {.max_surfaces = 1});
    if (!traced) throw std::runtime_error(traced.error().message);
    const Kept& kept = kept_.emplace_back(Declared{*declared, *scene}, *std::move(campaign), *std::move(traced));
    auto rows = CampaignRows::make(kept.declared, {kept.campaign.captures, kept.traced, kept.lights}, {});
    if (!rows) throw std::runtime_error(rows.error().message);
    return {kept.campaign, kept.traced, kept.lights, *std::move(rows)};
  }
  /// What rows refer to.
  struct Kept {
    Kept(Declared of, Campaign taken, std::vector<std::shared_ptr<const TracedCapture>> light)
        : declared(std::move(of)), campaign(std::move(taken)), traced(std::move(light)), lights(lightsOf(traced)) {}
    Declared declared;
    Campaign campaign;
    std::vector<std::shared_ptr<const TracedCapture>> traced;
    Lights lights;
  };
  std::deque<Kept> kept_{};
  std::filesystem::path folder_;
};

TEST_F(Rows, ColumnOfAnEffectRecoversItsStrengthByPlainLeastSquares) {
  const Made made = make("[[effect]]\ntype = 'clock_scale'\nppm = 2500.0\n");
  const Marginal marginal = marginalise(made.rows.evidence({}), {});
  Columns columns = nuisanceColumns(marginal);
  const auto group = std::ranges::find(marginal.groups, "clock_scale", &Group::name);
  ASSERT_NE(group, marginal.groups.end());
  append(columns, *group);
  const Fit fit_with = fit(marginal, columns);
  const auto candidate = std::ranges::find_if(made.rows.candidates(), [](const Candidate& one) {
    return discover::nameOf(one.example) == "clock_scale";
  });
  ASSERT_NE(candidate, made.rows.candidates().end());
  ASSERT_EQ(candidate->variations.size(), 1u);
  const double step = candidate->variations.front().step;
  const Eigen::Index last = fit_with.coefficient.size() - 1;
  const double ppm = step * fit_with.coefficient[last];
  const double error = std::abs(step) * std::sqrt(fit_with.inverse(last, last));
  EXPECT_LT(error, 250.0);                // it is there to be seen
  EXPECT_NEAR(ppm, 2500.0, 4.0 * error);  // 4 standard errors: 6e-5 false alarms
}

TEST_F(Rows, NothingIsLeftButNoiseWhereNothingIsHidden) {
  const Made made = make("");
  const Marginal marginal = marginalise(made.rows.evidence({}), {});
  const Fit plain = fit(marginal, nuisanceColumns(marginal));
  // Tracing's variance is an upper bound, so somewhat less than 1 is left; a mistake in the noise
  // or in the poses' columns would leave far more.
  EXPECT_LT(plain.dispersion(), 1.05);
  EXPECT_GT(plain.dispersion(), 0.75);
}

/// Nobody knows where the light's zero lies. With square waves a delay of 8 mm in the light is an offset of the
/// range and a change of the cyclic error: both are free.
TEST_F(Rows, ADelayOfTheLightIsNoMoreAnEffectThanAnOffset) {
  std::string square = smallCamera();
  square.replace(square.find("contrast = 0.5"), 14,
                 "contrast = 0.5\nemitted = 'square'\ndemodulated = 'square'");
  square.replace(square.find("taps = 2"), 8, "taps = 2\nharmonics = 7");
  const Made made = make("[[effect]]\ntype = 'frequency_offset'\nfirst_rad = 0.01\n", square);
  const Marginal marginal = marginalise(made.rows.evidence({}), {});
  const auto delay = std::ranges::find(marginal.groups, "delay of the light", &Group::name);
  ASSERT_NE(delay, marginal.groups.end());
  const Fit all = fit(marginal, nuisanceColumns(marginal));
  EXPECT_LT(all.dispersion(), 1.05);
  Columns others = nuisanceColumns(marginal);
  std::erase(others, static_cast<Eigen::Index>(delay->first));
  EXPECT_GT(fit(marginal, others).deviance - all.deviance, 100.0);  // ten standard errors: it is there
}

/// What a delay of 32 mm does to the cyclic error is not proportional to it.
TEST_F(Rows, ADelayOfTheLightIsFoundHoweverLargeItIs) {
  std::string square = tinyCamera();
  square.replace(square.find("contrast = 0.5"), 14, "contrast = 0.5\nemitted = 'square'\ndemodulated = 'square'");
  square.replace(square.find("taps = 2"), 8, "taps = 2\nharmonics = 7");
  const Made made = make("[[effect]]\ntype = 'frequency_offset'\nfirst_rad = 0.04\n", square);
  const auto declared = sim::SensorModel::parse(square, "camera.toml");
  const auto scene = sim::Scene::parse(smallScene(), "scene.toml");
  const Declared as_declared{*declared, *scene};
  const auto delay_mm = delayThatFits({as_declared, {made.campaign.captures, made.traced, made.lights}, {}});
  ASSERT_TRUE(delay_mm) << delay_mm.error().message;
  EXPECT_NEAR(*delay_mm, 0.04 * 795.77, 2.0);
  const auto once = withDelay(*declared, effectsWithoutNoise(*declared), *delay_mm);
  EXPECT_EQ(once.size(), effectsWithoutNoise(*declared).size() + 1);
  const auto twice = withDelay(*declared, once, -*delay_mm);
  ASSERT_EQ(twice.size(), once.size()) << "one frequency_offset is enough";
  double left_rad = 1.0;
  for (const sim::AnyEffect& effect : twice)
    if (const auto* offset = std::get_if<sim::FrequencyOffset>(&effect)) left_rad = offset->first.in(radian);
  EXPECT_NEAR(left_rad, 0.0, 1e-12);
}

/// Offset 5, delay −1 mm beyond what is known; variances 0.01 and 1, covariance 0.05.
Refitted withDelayOfOne() {
  Refitted fitted{.offset_mm = 5.0, .delay_mm = -1.0};
  fitted.common_covariance(0, 0) = 0.01, fitted.common_covariance(2, 2) = 1.0;
  fitted.common_covariance(0, 2) = fitted.common_covariance(2, 0) = 0.05;
  return fitted;
}

TEST(Zero, ADelayThatIsNoMoreThanChanceWithWhatIsKnownIsTakenBack) {
  const Zero zero = zeroOf(withDelayOfOne(), 2.0);
  EXPECT_EQ(zero.delay_mm, -2.0);
  EXPECT_NEAR(zero.offset_mm, 5.0 - 0.05 + 2.0, 1e-12);
  EXPECT_NEAR(zero.offset_error_mm, std::sqrt(0.01 - 0.05 * 0.05), 1e-12);
}

TEST(Zero, ADelayThatTheCapturesDoNotTellIsNone) {
  const Zero zero = zeroOf(withDelayOfOne(), 20.0, false);
  EXPECT_EQ(zero.delay_mm, -20.0);
}

TEST(TellDelay, NeedsThreePlaces) {
  std::vector<MeasuredCapture> captures(4);
  for (std::size_t i = 0; i < captures.size(); ++i) {
    captures[i].moment.world_from_camera.emplace();
    captures[i].moment.world_from_camera->translation_m.z = i == 3 ? 0.0 : 0.1 * static_cast<double>(i);
  }
  EXPECT_TRUE(tellDelay(captures));
  captures[1] = captures[0];
  EXPECT_FALSE(tellDelay(captures)) << "0, 0, 0.2 and 0 m";
}

TEST(Zero, TheOffsetBesideADelayIsAsUncertainAsBoth) {
  const Zero zero = zeroOf(withDelayOfOne(), 20.0);
  EXPECT_EQ(zero.delay_mm, -1.0);
  EXPECT_NEAR(zero.offset_mm, 6.0, 1e-12);
  EXPECT_NEAR(zero.offset_error_mm, std::sqrt(0.01 + 1.0 - 2.0 * 0.05), 1e-12);
  EXPECT_TRUE(zero.hasOffset());
}

TEST(Zero, OfADelayByWhichTheLightWasMovedTheOffsetHasNothing) {
  Refitted refitted = withDelayOfOne();
  refitted.moved_mm = refitted.delay_mm;
  const Zero zero = zeroOf(refitted, 20.0);
  EXPECT_EQ(zero.delay_mm, -1.0);
  EXPECT_NEAR(zero.offset_mm, 5.0, 1e-12);
}

TEST_F(Rows, WithoutACyclicErrorADelayIsAnOffset) {
  const Made made = make("[[effect]]\ntype = 'frequency_offset'\nfirst_rad = 0.04\n", tinyCamera());
  const auto declared = sim::SensorModel::parse(tinyCamera(), "camera.toml");
  const auto scene = sim::Scene::parse(smallScene(), "scene.toml");
  const Declared as_declared{*declared, *scene};
  const auto delay_mm = delayThatFits({as_declared, {made.campaign.captures, made.traced, made.lights}, {}});
  ASSERT_TRUE(delay_mm) << delay_mm.error().message;
  EXPECT_EQ(*delay_mm, 0.0);
}

/// Beside a charge a delay is a little more than an offset: that little would be bought with millimetres.
TEST_F(Rows, AWrongChargeIsNoDelayOfTheLight) {
  const auto charged = [](double electrons) {
    return fmt::format("[[effect]]\ntype = 'sample_offset'\nstep = 1\nelectrons = {}\n", electrons);
  };
  const Made made = make(charged(400.0), tinyCamera());
  const auto declared = sim::SensorModel::parse(tinyCamera(charged(200.0)), "camera.toml");
  const auto scene = sim::Scene::parse(smallScene(), "scene.toml");
  ASSERT_TRUE(declared && scene);
  const Declared as_declared{*declared, *scene};
  const auto delay_mm = delayThatFits({as_declared, {made.campaign.captures, made.traced, made.lights}, {}});
  ASSERT_TRUE(delay_mm) << delay_mm.error().message;
  EXPECT_EQ(*delay_mm, 0.0);
}

/// Of a camera whose pattern no default of the catalogue has. z is a normal deviate; the best of some 150 groups
/// exceeds 4.5 by chance in 5e-4.
TEST_F(Rows, APatternThatStaysAtItsPixelsIsSeenWhereverTheyLook) {
  const auto seen = [](const Made& made) {
    double most = 0.0;
    discover::Test test{{.draws = 300}};
    const Marginal marginal = marginalise(made.rows.withoutCatalogue(made.rows.ownGroups()), {});
    test.add(marginal, nuisanceColumns(marginal));
    for (const GroupScore& score : test.result().scores)
      if (test.names()[score.group].starts_with("a pattern of pixels")) most = std::max(most, score.z);
    return most;
  };
  const std::string pattern = "[[effect]]\ntype = 'fixed_pattern_phase'\nsigma_rad = 0.002\ndevice = 4711\n";
  EXPECT_GT(seen(make(pattern, tinyCamera())), 4.5);
  EXPECT_LT(seen(make("", tinyCamera())), 4.5);
}

TEST_F(Rows, APatternOfPixelsIsWhatItIsByItsPlaceWithinTheImage) {
  const Made made = make("[[effect]]\ntype = 'fixed_pattern_phase'\nsigma_rad = 0.01\ndevice = 4711\n", tinyCamera());
  const PixelPattern* pattern = made.rows.patternOf("pixel:range");
  ASSERT_NE(pattern, nullptr);
  EXPECT_EQ(pattern->grid.size(), 28U * 21U);
  EXPECT_NEAR(pattern->deviation, 0.01 * 795.8, 1.5);  // mm: a radian at 30 MHz is 0.7958 m
  EXPECT_EQ(made.rows.patternOf("neighbours:1px"), nullptr);
}

/// Paint that the scene file lacks stays in its pixels as long as the camera stays, whatever the block is
/// called: a third of a millimetre ahead moves the image by 0.005 pixels.
TEST_F(Rows, WhatIsSeenFromOnePlaceInSeveralBlocksIsNoPatternOfPixels) {
  const std::string plan = R"(name = "one place"
seed = 7
frames = 4
exposure_us = 500.0
[[block]]
name = "first"
kind = "warm_up"
distance_m = [1.5]
repeats = 5
interval_s = 80.0
[[block]]
name = "second"
kind = "distance"
distance_m = [1.5, 1.5003, 1.4997]
repeats = 3
)";
  const auto paint = [](sim::RangeImage& image, const Moment&, const CameraInfo&, std::uint64_t) {
    for (std::size_t i = 0; i < image.amplitude.size(); ++i)
      image.amplitude[i] *= i * 2'654'435'761U % 7 < 3 ? 1.0F : 0.9F;
  };
  const Made made = make("", tinyCamera(), plan, paint);
  ASSERT_EQ(made.campaign.captures.size(), 14U);
  EXPECT_EQ(made.rows.patternOf("pixel:gain"), nullptr);
}

/// A distance of 3.3 % more moves what is 9 pixels from the middle by a third of one.
TEST_F(Rows, SitesAreLinkedFromNeighbourToNeighbourAndAsWideAsACell) {
  const auto sites = [this](const std::string& distances_m, const CellGrid& grid,
                            const std::map<std::string, sim::Scene>& scene_of_block = {}) {
    const std::string plan = R"(name = "sites"
seed = 7
frames = 4
exposure_us = 500.0
[[block]]
name = "first"
kind = "warm_up"
distance_m = [1.5]
repeats = 3
interval_s = 80.0
[[block]]
name = "other"
kind = "distance"
repeats = 2
)";
    const Made made = make("", tinyCamera(), plan + "distance_m = " + distances_m + "\n");
    const auto camera = sim::SensorModel::parse(tinyCamera(), "camera.toml");
    const auto scene = sim::Scene::parse(smallScene(), "scene.toml");
    const auto all = sitesOf({*camera, *scene, scene_of_block},
                             {made.campaign.captures, made.traced, made.lights}, grid);
    return std::set<std::size_t>(all.begin(), all.end()).size();
  };
  const CellGrid pixels{1, 1, 28, 21}, large{14, 8, 2, 3};
  EXPECT_EQ(sites("[1.55, 1.6, 1.65, 1.7, 1.75, 1.8, 1.85, 1.9, 1.95, 2.0]", pixels), 1U);
  EXPECT_EQ(sites("[2.0, 2.001, 2.002]", pixels), 2U) << "without those between them";
  EXPECT_EQ(sites("[2.0, 2.001, 2.002]", large), 1U) << "in cells of 14 x 8 pixels nothing moves into the next";
  const auto again = sim::Scene::parse(smallScene(), "again.toml"),
             corner = sim::Scene::parse(cornerScene(), "corner.toml");
  ASSERT_TRUE(again && corner);
  EXPECT_EQ(sites("[1.55, 1.551, 1.552]", pixels, {{"other", *again}}), 1U) << "another copy of the same scene";
  EXPECT_EQ(sites("[1.55, 1.551, 1.552]", pixels, {{"other", *corner}}), 2U);
}

/// A pattern far below the noise of one capture. Fitted where it was learned, it would have explained that
/// noise, too, and would seem several times as strong as it was taken for.
TEST_F(Rows, HowStrongAPatternIsOtherPlacesSay) {
  const Made made =
      make("[[effect]]\ntype = 'fixed_pattern_phase'\nsigma_rad = 0.001\ndevice = 4711\n", tinyCamera());
  const Term found = made.rows.settled({{}, Stage::Range, "pixel:range"});
  const std::vector<TermGroup> groups{{"pattern", Kind::Generic, {found}, 0}};
  const Marginal marginal = marginalise(made.rows.withoutCatalogue(groups), {});
  Columns columns = nuisanceColumns(marginal);
  append(columns, marginal.groups.back());
  const Fit with = fit(marginal, columns);
  const Eigen::Index last = with.coefficient.size() - 1;
  const double error =
      made.rows.errorFactor(found) * std::sqrt(with.inverse(last, last) * std::max(1.0, with.dispersion()));
  EXPECT_EQ(made.rows.errorFactor(found), std::numbers::sqrt2) << "each two places are counted twice";
  EXPECT_LT(error, 0.2);
  EXPECT_NEAR(with.coefficient[last], 1.0, 4.0 * error);
}

/// The delay of the light, too, which no effect of this camera acts on.
TEST_F(Rows, TheDeclaredEffectsLeaveWhatIsLeftAlready) {
  const std::string all = smallCamera();
  const Made made = make("", all.substr(0, all.find("[[effect]]")) + "[[effect]]\ntype = 'read_noise'\n" +
                                 "[[effect]]\ntype = 'sample_gain'\ngain = 1.0\n");
  ASSERT_TRUE(made.rows.hasDelay());
  const Evidence as_made = made.rows.withoutCatalogue({});
  const auto left = made.rows.evidenceLeft({.effects = made.rows.effects(), .with_numbers = true});
  ASSERT_TRUE(left);
  ASSERT_EQ(left->captures.size(), as_made.captures.size());
  for (std::size_t c = 0; c < as_made.captures.size(); ++c) {
    const CaptureEvidence &a = as_made.captures[c], &b = left->captures[c];
    EXPECT_LT((a.gram - b.gram).norm(), 1e-5 * a.gram.norm());
    EXPECT_LT((a.moment - b.moment).norm(), 1e-5 * a.moment.norm());
  }
}

TEST(PixelPattern, IsKnownAsFarAsItsPixelsStandOutOfNoise) {
  const PixelPattern pattern{.deviation = 2.0, .weight = {1.0, 0.25}};  // four times its noise's variance, and once
  EXPECT_DOUBLE_EQ(pattern.knownShare(), (0.8 + 0.25 * 0.5) / 1.25);
  EXPECT_DOUBLE_EQ(pattern.knownShare(4.0), (16.0 / 17.0 + 0.25 * 0.8) / 1.25);
}

TEST_F(Rows, APatternGoesIntoTheModelAsStrongAsItWasFitted) {
  const Made made =
      make("[[effect]]\ntype = 'fixed_pattern_phase'\nsigma_rad = 0.01\ndevice = 4711\n", tinyCamera());
  const auto camera = sim::SensorModel::parse(tinyCamera(), "camera.toml");
  Effect effect{.name = "a pattern of pixels", .coefficient = {0.5}};
  effect.parts.push_back({.group = {"pattern", Kind::Generic, {{{}, Stage::Range, "pixel:range"}}, 0}});
  const auto learned = learnedEffectsOf(effect, made.rows, *camera);
  ASSERT_EQ(learned.size(), 1U);
  const auto& terms = std::get<sim::Learned>(learned.front().effect).terms.list();
  const PixelPattern& pattern = *made.rows.patternOf("pixel:range");
  const auto size = [](const std::vector<double>& values) {
    double sum = 0.0;
    for (const double value : values) sum += std::abs(value);
    return sum;
  };
  EXPECT_GT(size(pattern.value), 100.0);
  // For each column of cells a hat times a curve over the rows: x₀, y₀, x₁, y₁ …
  std::vector<double> offsets_mm;
  for (const terms::Term& term : terms)
    for (std::size_t i = 1; i < term.factors.back().numbers.size(); i += 2) offsets_mm.push_back(term.factors.back().numbers[i]);
  ASSERT_EQ(offsets_mm.size(), pattern.value.size());
  EXPECT_NEAR(size(offsets_mm), 0.5 * size(pattern.value), 1e-6);
}

/// A wave shorter than any knots, stripes, a checkerboard, a product: the simulator adds what the search fitted.
TEST_F(Rows, WhatWasFoundGoesIntoTheModelAsItIs) {
  const Made made = make("", tinyCamera());
  const auto camera = sim::SensorModel::parse(tinyCamera(), "camera.toml");
  Factor checker = factorOf("column", Basis::Class, {2.0, 1.0});
  checker.of.parts.push_back({1.0, "row"});
  Effect effect{.name = "shapes", .coefficient = {3.0, -2.0, 0.5, 1.5}};
  effect.parts.push_back({.group = {"shapes", Kind::Generic,
                                    {{{factorOf("range_m", Basis::Sine, {0.011})}, Stage::Range},
                                     {{factorOf("column", Basis::Class, {3.0, 1.0})}, Stage::Range},
                                     {{factorOf("time_s", Basis::Decay, {400.0}), factorOf("row", Basis::Power, {1.0})}, Stage::Range},
                                     {{checker}, Stage::Range}}, 0}});
  const auto learned = learnedEffectsOf(effect, made.rows, *camera);
  ASSERT_EQ(learned.size(), 1U);
  const auto& captures = made.campaign.captures;
  const auto plain = NoiselessCamera::make(*camera, made.rows.effects(), captures);
  const auto with = NoiselessCamera::make(*camera, withInserted(made.rows.effects(), learned.front().effect), captures);
  ASSERT_TRUE(plain && with);
  for (std::size_t c = 0; c < captures.size(); ++c) {
    const Reading before = plain->read(captures[c], *made.lights[c]), after = with->read(captures[c], *made.lights[c]);
    for (int y = 0; y < before.range_m.height(); ++y) {
      for (int x = 0; x < before.range_m.width(); ++x) {
        const auto value = [&](const std::string& name) {
          if (name == "time_s") return captures[c].moment.since_power_on->in(second);
          return name == "range_m" ? static_cast<double>(before.range_m(x, y)) : name == "column" ? 1.0 * x : 1.0 * y;
        };
        double sum = 0.0;
        for (std::size_t t = 0; t < effect.coefficient.size(); ++t)
          sum += effect.coefficient[t] * effect.parts[0].group.terms[t].at(value);
        ASSERT_NEAR(1e3 * static_cast<double>(after.range_m(x, y) - before.range_m(x, y)), sum, 1e-3) << x << ", " << y;
      }
    }
  }
}

/// Where the light's zero lies is fitted beforehand. That is no effect of the file, so that a phase of each
/// frequency may still be missing in it.
TEST_F(Rows, ADelayThatIsKnownHidesNoFrequencyOffset) {
  std::string square = tinyCamera();
  square.replace(square.find("contrast = 0.5"), 14,
                 "contrast = 0.5\nemitted = 'square'\ndemodulated = 'square'");
  square.replace(square.find("taps = 2"), 8, "taps = 2\nharmonics = 7");
  const Made made = make("", square);
  const auto camera = sim::SensorModel::parse(square, "camera.toml");
  const auto scene = sim::Scene::parse(smallScene(), "scene.toml");
  const Declared late{.model = *camera, .scene = *scene, .delay_mm = 8.0};
  const auto rows = CampaignRows::make(late, {made.campaign.captures, made.traced, made.lights}, {});
  ASSERT_TRUE(rows) << rows.error().message;
  std::vector<std::string> names;
  for (const Candidate& one : rows->candidates()) names.push_back(discover::nameOf(one.example));
  EXPECT_THAT(names, testing::Contains("frequency_offset"));
  for (const Group& group : rows->baseGroups())
    EXPECT_FALSE(group.kind == Kind::Declared && group.name == "frequency_offset");
}

TEST_F(Rows, EveryEffectOfTheCatalogueThatShowsIsACandidateAndNoiseIsNot) {
  const Made made = make("");
  std::vector<std::string> names;
  for (const Candidate& one : made.rows.candidates()) names.push_back(discover::nameOf(one.example));
  for (const char* shows : {"lens_scatter", "warm_up", "thermal_delay", "time_walk", "clock_scale",
                            "sample_offset", "vignetting", "propagation_delay", "calibration_table"})
    EXPECT_THAT(names, testing::Contains(shows));
  for (const char* does_not : {"shot_noise", "read_noise", "range_noise", "delay", "learned"})
    EXPECT_THAT(names, testing::Not(testing::Contains(does_not)));
}

/// All that a file's numbers can do is free, the rest of one that is far off would look like an effect. A few
/// captures are probed: at the beginning and at the end two time constants do nothing.
TEST_F(Rows, AllNumbersOfADeclaredDriftAreFree) {
  const Made made = make("", tinyCamera("[[effect]]\ntype = 'warm_up'\n"), R"(name = "drift"
seed = 7
frames = 4
exposure_us = 500.0
[[block]]
name = "warm-up"
kind = "warm_up"
distance_m = [1.5]
repeats = 6
interval_s = 400.0
)");
  const auto& groups = made.rows.baseGroups();
  const auto drift = std::ranges::find(groups, "warm_up", &Group::name);
  ASSERT_NE(drift, groups.end());
  EXPECT_EQ(drift->count, 4U) << "how much and how long, twice";
}

/// Two temperatures that rise alike: what the sensor's does beside the illumination's is less than images in single
/// precision show of a small step. The fit goes to where it is most likely, and states how likely the rest is.
TEST_F(Rows, NumbersThatHardlyDifferAreFittedAndAsUncertainAsTheyAre) {
  const Made made = make("[[effect]]\ntype = 'thermal_delay'\nper_degree_mm = 0.7\nper_sensor_degree_mm = 0.0\n");
  const Declared& declared = kept_.back().declared;
  const sim::AnyEffect delay = sim::ThermalDelay{.per_degree = 0.7_mm, .per_sensor_degree = 0_mm};
  const auto effects = withInserted(declaredEffects(declared), {delay});
  const auto at = std::ranges::find(effects, delay.index(), &sim::AnyEffect::index);
  const auto place = static_cast<std::size_t>(at - effects.begin());
  const auto refitted = [&](double sensor_mm, const RefitOptions& options) {
    auto from = effects;
    from[place] = withNumber(from[place], "per_sensor_degree_mm", sensor_mm);
    return refit(made.rows, from, {place}, options);
  };
  const auto fit = refitted(0.0, {});
  ASSERT_TRUE(fit) << fit.error().message;
  const auto sensor = std::ranges::find(fit->fitted.front().numbers, "per_sensor_degree_mm", &FittedNumber::key);
  ASSERT_NE(sensor, fit->fitted.front().numbers.end());
  EXPECT_NEAR(sensor->value, 0.0, 4.0 * sensor->error);  // 6e-5 false alarms
  for (const double errors : {-2.0, 2.0}) {
    const auto beside = refitted(sensor->value + errors * sensor->error, {.only = {{place, {"per_degree_mm"}}}});
    ASSERT_TRUE(beside) << beside.error().message;
    const double more = (beside->deviance - fit->deviance) / std::max(1.0, fit->dispersion);
    EXPECT_GT(more, 2.5) << errors;  // of 4, and the fit ends a third of an error from the best
    EXPECT_LT(more, 6.0) << errors;
  }
}

/// Two captures with one deviation of 2 between them: each alone would have to explain its own.
TEST(Evidence, CapturesOfOneStandHaveOneDeviation) {
  const auto capture = [](double deviation) {
    return CaptureEvidence{.gram = Eigen::MatrixXd::Constant(1, 1, 100.0),
                           .moment = Eigen::VectorXd::Constant(1, 100.0 * deviation),
                           .energy = 100.0 * deviation * deviation,
                           .rows = 100.0};
  };
  const std::vector<Group> groups{{.name = "pose", .kind = Kind::PerCapture, .first = 0, .count = 1}};
  const std::vector<CaptureEvidence> captures{capture(2.0), capture(2.0), capture(-1.0)};
  const auto all = joined(captures, {0, 0, 1});
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].rows, 200.0);
  // yᵀ(I + ZZᵀ)⁻¹y of n rows of 2 is 4n/(1 + n).
  EXPECT_NEAR(marginalise({groups, all}, {}).energy, 800.0 / 201.0 + 100.0 / 101.0, 1e-9);
  EXPECT_NEAR(marginalise({groups, captures}, {}).energy, 900.0 / 101.0, 1e-9);
}

TEST(Catalogue, NumbersOfAnEffectAreSetByTheirKeysAndStayWithinBounds) {
  const sim::AnyEffect effect = withNumber(sim::AnyEffect{sim::WarmUp{}}, "fast_mm", 7.0);
  EXPECT_DOUBLE_EQ(std::get<sim::WarmUp>(effect).fast.in(millimetre), 7.0);
  EXPECT_DOUBLE_EQ(std::get<sim::WarmUp>(withNumber(effect, "fast_mm", 1e9)).fast.in(millimetre), 1000.0);
  EXPECT_EQ(std::get<sim::SampleOffset>(withNumber(sim::AnyEffect{sim::SampleOffset{}}, "step", 2.4)).step,
            2);
}

TEST(Catalogue, AWeakStrengthIsNotAtItsBoundForBoundsBeingWide) {
  const std::vector<std::string> keys{"radiance_w_per_m2_sr"};
  const auto reflecting = [](double radiance) {
    return withNumber(sim::AnyEffect{sim::InternalReflection{}}, "radiance_w_per_m2_sr", radiance);
  };
  EXPECT_FALSE(isAtBound(reflecting(2e-4), keys));  // the default, of 0 to 1000
  EXPECT_TRUE(isAtBound(reflecting(1e9), keys));
  EXPECT_TRUE(isAtBound(reflecting(-1.0), keys));
}

TEST(Catalogue, AnEffectIsInsertedWhereLightMeetsIt) {
  const std::vector<sim::AnyEffect> some{sim::Vignetting{}, sim::ReadNoise{}, sim::TemporalFilter{}};
  EXPECT_EQ(discover::nameOf(withInserted(some, sim::AnyEffect{sim::LensScatter{}})[1]), "lens_scatter");
  EXPECT_EQ(discover::nameOf(withInserted(some, sim::AnyEffect{sim::WarmUp{}})[2]), "warm_up");
  EXPECT_EQ(discover::nameOf(withInserted(some, sim::AnyEffect{sim::Harmonics{}})[0]), "harmonics");
}

}  // namespace
}  // namespace toftwin::discover
