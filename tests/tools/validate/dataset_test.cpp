// SPDX-License-Identifier: Apache-2.0
#include "tools/validate/dataset.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/settings/describe.h"

namespace toftwin::validate {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const std::string kCamera = "[[camera]]\nname = \"kinect_v2\"\ntitle = \"K\"\n";
const std::string kDistances =
    "[[judge]]\nkind = \"distances\"\ncamera = \"kinect_v2\"\ntitle = \"distances\"\nfile = \"{camera}.csv\"\nmeasured = \"m\"\n";

class DatasetFile : public testing::Test {
 protected:
  void SetUp() override {
    folder = std::filesystem::path{testing::TempDir()} / testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder / "mine");
  }
  Result<Dataset> load(const std::string& text, const std::filesystem::path& data = {}) {
    std::ofstream{folder / "dataset.toml"} << text;
    return loadDataset(folder / "dataset.toml", data);
  }
  std::string errorOf(const std::string& text) {
    const auto set = load(text);
    return set ? "no error" : set.error().message;
  }
  std::filesystem::path folder;
};

TEST_F(DatasetFile, NamesTheCameraInItsFiles) {
  const auto set = load("data = \"mine\"\n" + kCamera + kDistances);
  ASSERT_TRUE(set.ok()) << set.error().message;
  EXPECT_EQ(set->folder, folder / "mine");
  EXPECT_EQ(std::get<Distances>(set->judgements.front().what).file, "kinect_v2.csv");
}

TEST_F(DatasetFile, TakesFromAnotherJudgementWhatItDoesNotSay) {
  const auto set = load("data = \"mine\"\n" + kCamera + "[[camera]]\nname = \"o3d303\"\n" + kDistances +
                        "block_mm = 50.0\n[[judge]]\nlike = \"distances-kinect_v2\"\ncamera = \"o3d303\"\nbin_mm = 10.0\n");
  ASSERT_TRUE(set.ok()) << set.error().message;
  const auto& second = std::get<Distances>(set->judgements.at(1).what);
  EXPECT_EQ(second.file, "o3d303.csv");
  EXPECT_EQ(second.block_mm, 50.0);
  EXPECT_EQ(second.bin_mm, 10.0);
  EXPECT_EQ(second.id, "distances-o3d303");
}

TEST_F(DatasetFile, NamesFileAndLineOfEveryMistake) {
  EXPECT_THAT(errorOf("data = \"mine\"\n" + kCamera + "[[judge]]\nkind = \"colours\"\n"), AllOf(HasSubstr("dataset.toml:"), HasSubstr("distances, series")));
  EXPECT_THAT(errorOf("data = \"mine\"\n" + kCamera), HasSubstr("[[judge]]"));
  EXPECT_THAT(errorOf("data = \"mine\"\n" + kDistances), HasSubstr("no [[camera]] has that name"));
  EXPECT_THAT(errorOf("data = \"mine\"\n[[camera]]\nname = \"nobody\"\n" + kDistances), HasSubstr("nobody"));
  EXPECT_THAT(errorOf("data = \"mine\"\n" + kCamera + kDistances + "colour = 1\n"), HasSubstr("colour"));
}

TEST_F(DatasetFile, RefusesANumberOfAnEffectThatHasNone) {
  const std::string edges = "[[judge]]\nkind = \"edges\"\ncamera = \"kinect_v2\"\ntitle = \"edges\"\nfile = \"a.csv\"\neffect = [{ type = \"defocus\" }]\n";
  const auto with = [&](const std::string& number) { return errorOf("data = \"mine\"\n" + kCamera + edges + "number = [" + number + "]\n"); };
  EXPECT_THAT(with("{ name = \"s\", high = 3.0, keys = [\"gain\"] }"), HasSubstr("\"gain\" is no number of that effect"));
  EXPECT_THAT(with("{ name = \"s\", high = 9.0, keys = [\"sigma_px\"] }"), HasSubstr("sigma_px must be 0 to 3"));
  EXPECT_THAT(with("{ name = \"s\", start = 5.0, high = 3.0, keys = [\"sigma_px\"] }"), HasSubstr("low ≤ start ≤ high"));
  EXPECT_EQ(with("{ name = \"s\", high = 3.0, keys = [\"sigma_px\"] }"), "no error");
}

TEST_F(DatasetFile, SaysWhereItLookedForTheData) {
  const auto set = load("data = \"elsewhere\"\n" + kCamera + kDistances, folder);
  ASSERT_FALSE(set.ok());
  EXPECT_EQ(set.error().code, Error::Code::NotFound);
  EXPECT_THAT(set.error().message, AllOf(HasSubstr("elsewhere"), HasSubstr(folder.string())));
}

TEST_F(DatasetFile, TakesTheDataFolderItselfOrOneThatHoldsIt) {
  std::filesystem::create_directories(folder / "far" / "mine");
  EXPECT_EQ(findData("mine", folder / "far", folder / "dataset.toml"), folder / "far" / "mine");
  EXPECT_EQ(findData("mine", folder / "far" / "mine", folder / "dataset.toml"), folder / "far" / "mine");
}

/// The keys as docs/validate.md has them; a new one is added there by what this prints.
template <class Kind>
void expectKeys(const std::string& page, const std::string& kind) {
  const std::string table = settings::markdownTable(settings::keysOf<Kind>());
  EXPECT_NE(page.find("<!-- " + kind + ": generated -->\n" + table), std::string::npos) << kind << "\n" << table;
}

TEST(Documents, KeysOfADescriptionAreThoseOfThePage) {
  std::ifstream in{std::filesystem::path{TOFTWIN_SOURCE_DIR} / "docs/validate.md"};
  const std::string page{std::istreambuf_iterator<char>{in}, {}};
  expectKeys<Distances>(page, "distances");
  expectKeys<Series>(page, "series");
  expectKeys<Noise>(page, "noise");
  expectKeys<Line>(page, "line");
  expectKeys<Edges>(page, "edges");
}

}  // namespace
}  // namespace toftwin::validate
