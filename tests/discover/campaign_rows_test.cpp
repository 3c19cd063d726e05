// SPDX-License-Identifier: Apache-2.0
// What a campaign says of effects that may be missing, before anybody looks for one.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "calib/discover/campaign/catalogue.h"
#include "calib/discover/campaign/refit.h"
#include "calib/discover/campaign/rows.h"
#include "calib/discover/marginal.h"
#include "tests/discover/simulated_run.h"

namespace toftwin::discover {
namespace {

struct Made {
  Campaign campaign;
  std::vector<std::shared_ptr<const TracedCapture>> traced;
  CampaignRows rows;
};

class Rows : public testing::Test {
 protected:
  Rows() : folder_(std::filesystem::temp_directory_path() / fmt::format("toftwin-rows-{}", ::getpid())) {}
  ~Rows() override { std::filesystem::remove_all(folder_); }

  Made make(const std::string& hidden, const std::string& of_camera = smallCamera()) {
    const auto plan = plan::parsePlan(smallPlan(), "plan.toml");
    const auto camera = sim::SensorModel::parse(of_camera + hidden, "camera.toml");
    const auto declared = sim::SensorModel::parse(of_camera, "camera.toml");
    const auto scene = sim::Scene::parse(smallScene(), "scene.toml");
    if (!plan || !camera || !declared || !scene)
      throw std::runtime_error("the small campaign's files are wrong");
    write(SimulatedRun{.plan = *plan, .camera = *camera, .scene = *scene}, folder_);
    auto campaign = readCampaign(folder_, Side::A);
    if (!campaign) throw std::runtime_error(campaign.error().message);
    const Declared as_declared{*declared, *scene};
    auto traced = traceAll(as_declared, campaign->captures, {.max_surfaces = 1});
    if (!traced) throw std::runtime_error(traced.error().message);
    const Lit lit{campaign->captures, *traced, *traced};
    auto rows = CampaignRows::make(as_declared, lit, {});
    if (!rows) throw std::runtime_error(rows.error().message);
    return {*std::move(campaign), *std::move(traced), *std::move(rows)};
  }
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

TEST_F(Rows, EveryEffectOfTheCatalogueThatShowsIsACandidateAndNoiseIsNot) {
  const Made made = make("");
  std::vector<std::string> names;
  for (const Candidate& one : made.rows.candidates()) names.push_back(discover::nameOf(one.example));
  for (const char* shows : {"lens_scatter", "warm_up", "thermal_delay", "time_walk", "clock_scale",
                            "sample_offset", "vignetting", "propagation_delay", "calibration_table"})
    EXPECT_THAT(names, testing::Contains(shows));
  for (const char* does_not : {"shot_noise", "read_noise", "range_noise", "delay", "learned_range"})
    EXPECT_THAT(names, testing::Not(testing::Contains(does_not)));
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
