// SPDX-License-Identifier: Apache-2.0
// What a script can tell by the exit status of `toftwin discover` before it has worked.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "program.h"
#include "tests/record/record_testing.h"

namespace toftwin::cli {
namespace {

using testing::HasSubstr;

class DiscoverCommand : public testing::Test {
 protected:
  DiscoverCommand() {
    std::filesystem::create_directories(folder_ / "run");
    std::ofstream{folder_ / "one.mcap"} << "no recording";
    std::ofstream{folder_ / "table.csv"} << "measured_mm,true_mm\n";
  }
  [[nodiscard]] Ran discover(const std::string& data, const std::string& more = {}) const {
    return toftwin(
        fmt::format("discover '{}' -o '{}' {}", (folder_ / data).string(), (folder_ / "out").string(), more));
  }
  record::Folder folder_;
};

constexpr int kUsageStatus = 2, kBadInputStatus = 4, kCannotWriteStatus = 6;
constexpr const char* kBoth = "--model preset:o3d303 --scene scene.toml";

TEST_F(DiscoverCommand, AForgottenModelOrSceneIsAWrongCommandLine) {
  for (const auto& [more, missing] : {std::pair{"", "both are missing"},
                                      {"--scene scene.toml", "--model is missing"},
                                      {"--model preset:o3d303", "--scene is missing"}}) {
    const Ran ran = discover("run", more);
    EXPECT_EQ(ran.status, kUsageStatus) << more;
    EXPECT_THAT(ran.err, HasSubstr(missing));
  }
}

TEST_F(DiscoverCommand, DataThatIsNotThereIsBadInput) {
  for (const char* name : {"none", "none.mcap", "none.csv"}) {
    const Ran ran = discover(name, kBoth);
    EXPECT_EQ(ran.status, kBadInputStatus) << name;
    EXPECT_THAT(ran.err, HasSubstr("there is no such file or folder"));
  }
}

TEST_F(DiscoverCommand, OptionsOfARunAreRefusedOfARecordingAndTheOtherWayRound) {
  const Ran b = discover("one.mcap", std::string{kBoth} + " --b");
  EXPECT_EQ(b.status, kUsageStatus);
  EXPECT_THAT(b.err, HasSubstr("--b is for a run"));
  const Ran poses = discover("run", std::string{kBoth} + " --poses one.mcap");
  EXPECT_EQ(poses.status, kUsageStatus);
  EXPECT_THAT(poses.err, HasSubstr("--poses is for a recording"));
}

TEST_F(DiscoverCommand, AFolderThatCannotBeWrittenComesBeforeTheTable) {
  const Ran ran = toftwin(fmt::format("discover '{}' -o /proc/nothing", (folder_ / "table.csv").string()));
  EXPECT_EQ(ran.status, kCannotWriteStatus) << ran.err;
}

}  // namespace
}  // namespace toftwin::cli
