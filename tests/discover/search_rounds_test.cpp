// SPDX-License-Identifier: Apache-2.0
// What each round of a search looks at.
#include "calib/discover/campaign/search/search_rounds.h"

#include <gmock/gmock.h>

#include "tests/discover/searched.h"

namespace toftwin::discover {
namespace {

using Rounds = Searched;

/// At the poses as they were told a pixel beside an edge mixes other shares of both sides, and what an effect does
/// there is another thing. And along the paths of the light that is compared, an effect that smooths images would
/// explain what these have by chance.
TEST_F(Rounds, EffectsAreTriedOnOtherLightOfThePlacesWhereTheCamerasStood) {
  simulate("");
  const auto model = sim::SensorModel::parse(tinyCamera(), "camera.toml");
  const auto scene = sim::Scene::parse(smallScene(), "scene.toml");
  auto campaign = readCampaign(folder_ / "run", Side::A);
  ASSERT_TRUE(model.ok() && scene.ok() && campaign.ok());
  const Declared declared{*model, *scene};
  const auto at_poses = traceAll(declared, campaign->captures, job().trace);
  ASSERT_TRUE(at_poses.ok()) << at_poses.error().message;
  double traced_by = 0.0;
  const auto round = searchInRounds(
      declared, {campaign->captures, *at_poses, job().trace, {}, {}, false}, [] {},
      [&](double share) { traced_by = share; });
  ASSERT_TRUE(round.ok()) << round.error().message;
  EXPECT_EQ(traced_by, 1.0);
  ASSERT_EQ((*round)->varied.size(), campaign->captures.size());
  for (std::size_t c = 0; c < campaign->captures.size(); ++c) {
    const sim::Light &compared = (*round)->traced[c]->light, &varied = *(*round)->varied[c];
    ASSERT_NE((*round)->traced[c]->stood, Stood{});
    EXPECT_TRUE(std::ranges::equal(varied.truth.range_m.pixels(), compared.truth.range_m.pixels())) << c;
    EXPECT_FALSE(std::ranges::equal(varied.steady.pixels(), compared.steady.pixels())) << c;
  }
}

}  // namespace
}  // namespace toftwin::discover
