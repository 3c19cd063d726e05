// SPDX-License-Identifier: Apache-2.0
// The documents' tables are those that the code gives.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include <fmt/format.h>

#include "drivers/sim/simulator.h"
#include "protocol/settings/describe.h"
#include "sim/effects/effects.h"
#include "sim/effects/learned/covariates.h"
#include "sim/sensor/camera_file.h"
#include "sim/sensor/sensor_model.h"
#include "sim/terms/words.h"

namespace toftwin::sim {
namespace {

using testing::HasSubstr;

std::string textOf(const std::string& path) {
  std::ifstream file{std::string{TOFTWIN_SOURCE_DIR} + "/" + path};
  EXPECT_TRUE(file) << path << " is missing";
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::string covariatesOf(const About& about) {
  std::string names;
  for (const auto& [covariate, name] : kCovariateNames) {
    if (about.explains.contains(covariate))
      names += (names.empty() ? "" : ", ") + std::string{name};
  }
  return names.empty() ? "nothing" : names;
}

TEST(Docs, EveryEffectHasAPageWithItsTruth) {
  const std::string index = textOf("docs/effects/README.md");
  AllEffects::forEach([&]<class E>() {
    const std::string name{E::about.name};
    const std::string page = textOf("docs/effects/" + name + ".md");
    EXPECT_THAT(page, HasSubstr("`" + name + "`, on " + std::string{stageInWords<E>()} +
                                ". Depends on: " + covariatesOf(E::about) + "."));
    EXPECT_THAT(page, HasSubstr("\n" + settings::markdownTable(settings::keysOf<E>())));
    EXPECT_THAT(page, HasSubstr("](figures/" + name + ".svg)"));
    EXPECT_THAT(index,
                HasSubstr("| [`" + name + "`](" + name + ".md) | " + std::string{stageInWords<E>()} +
                          " | " + covariatesOf(E::about) + " |"));
  });
}

TEST(Docs, NoEffectHasAPageWithoutBeing) {
  for (const auto& entry :
       std::filesystem::directory_iterator{std::string{TOFTWIN_SOURCE_DIR} + "/docs/effects"}) {
    if (entry.is_directory()) continue;  // figures: effect_figures checks them
    const std::string page = entry.path().stem().string();
    bool is_effect = page == "README";
    AllEffects::forEach([&]<class E>() { is_effect |= page == E::about.name; });
    EXPECT_TRUE(is_effect) << entry.path();
  }
}

TEST(Docs, LearnedHasAllWordsOfItsLanguage) {
  const std::string page = textOf("docs/effects/learned.md");
  for (const terms::BasisWord& row : terms::kBasisWords)
    EXPECT_THAT(page, HasSubstr(fmt::format("\n| `{}` | {} | {} |\n", row.word, row.numbered, row.formula)));
  for (const terms::CarrierWord& row : terms::kCarrierWords)
    EXPECT_THAT(page, HasSubstr(fmt::format("`{}({})`", row.word, row.numbered)));
  for (const terms::QuantityWord& row : terms::kQuantityWords) {
    if (row.quantity == terms::Quantity::Value) continue;
    EXPECT_THAT(page, HasSubstr(fmt::format("`{}`", row.word)));
  }
  for (const LearnedCovariate& row : learnedCovariates()) {
    const bool at_light = isKnownAt(terms::Stage::Light, row), at_range = isKnownAt(terms::Stage::Range, row);
    const bool everywhere = isKnownAt(terms::Stage::Samples, row);
    const std::string known = everywhere ? "all" : at_light && at_range ? "light, range" : at_light ? "light" : "range";
    EXPECT_THAT(page, HasSubstr(fmt::format("\n| `{}` | {} | {} | {} |\n", row.name, row.unit, known, row.meaning)));
  }
}

TEST(Docs, CameraFileHasAllKeys) {
  EXPECT_THAT(textOf("docs/camera-file.md"),
              HasSubstr("\n" + settings::markdownTable(settings::keysOf<CameraFile>())));
}

TEST(Docs, CameraFileNamesThePresets) {
  const std::string page = textOf("docs/camera-file.md");
  for (const std::string& name : SensorModel::presetNames())
    EXPECT_THAT(page, HasSubstr("`" + name + "`"));
}

TEST(Docs, SimulatorHasAllKeys) {
  EXPECT_THAT(textOf("docs/drivers/sim.md"),
              HasSubstr("\n" + drivers::simulator::row().document()));
}

TEST(Docs, TheExampleOfAnEffectCompiles) {
  const std::string page = textOf("docs/add-an-effect.md"),
                    code = textOf("tests/sim/scale_example.h");
  std::size_t blocks = 0;
  for (std::size_t at = 0; (at = page.find("```cpp\n", at)) != std::string::npos; ++blocks) {
    at += 7;
    const std::size_t end = page.find("```", at);
    EXPECT_THAT(code, HasSubstr(page.substr(at, end - at)));
    at = end + 3;
  }
  EXPECT_EQ(blocks, 2u);
}

}  // namespace
}  // namespace toftwin::sim
