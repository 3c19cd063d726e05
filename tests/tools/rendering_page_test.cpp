// SPDX-License-Identifier: Apache-2.0
// docs/rendering.md tells the truth: its lines run, its table is the code's.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>
#include <sstream>

#include "program.h"
#include "protocol/settings/describe.h"
#include "tests/record/record_testing.h"
#include "tiny_camera.h"
#include "tools/cli/campaign/trajectory.h"

namespace toftwin::cli {
namespace {

using testing::HasSubstr;

std::string page() {
  std::stringstream text;
  text << std::ifstream{TOFTWIN_SOURCE_DIR "/docs/rendering.md"}.rdbuf();
  return text.str();
}

/// The fenced blocks of that kind, one after the other.
std::vector<std::string> blocks(const std::string& kind) {
  const std::string text = page(), start = "```" + kind + "\n";
  std::vector<std::string> found;
  for (std::size_t at = text.find(start); at != std::string::npos; at = text.find(start, at)) {
    at += start.size();
    found.push_back(text.substr(at, text.find("```", at) - at));
  }
  return found;
}

TEST(RenderingPage, HasTheCodesTable) {
  std::istringstream rows{settings::markdownTable(settings::keysOf<TimedPoseSpec>())};
  std::string row;
  for (int i = 0; std::getline(rows, row); ++i) {
    if (i < 2) continue;  // the head
    EXPECT_THAT(page(), HasSubstr(row + "\n"));
  }
}

TEST(RenderingPage, ItsLinesRun) {
  const record::Folder folder;
  std::filesystem::create_directory_symlink(TOFTWIN_SOURCE_DIR "/sim", folder / "sim");
  ASSERT_EQ(blocks("csv").size(), 1u);
  ASSERT_EQ(blocks("toml").size(), 1u);
  writeText(folder / "walk.csv", blocks("csv")[0]);
  writeText(folder / "walk.toml", blocks("toml")[0]);
  int run = 0;
  for (const std::string& block : blocks("sh")) {
    std::istringstream lines{block};
    for (std::string line; std::getline(lines, line); ++run) {
      ASSERT_TRUE(line.starts_with("toftwin ")) << line;
      const Ran ran = runShell(fmt::format("cd '{}' && '{}' {} --samples 1 --surfaces 1",
                                           (folder / "").string(), TOFTWIN_PROGRAM, line.substr(8)));
      EXPECT_EQ(ran.status, 0) << line << "\n" << ran.err;
    }
  }
  EXPECT_EQ(run, 11);
  for (const char* file : {"range.png", "cloud.ply", "raw.npy", "frame.h5", "desk-color.png",
                           "desk-infrared.png", "desk-depth.png", "corner.npy", "corner.npy.toml",
                           "walk/frame-000003-flags.npy", "walk/frame-000003-range.png", "walk/frames.csv",
                           "walk.h5", "walk.mcap", "rgbd/frame-000001-color.png", "noise.h5"})
    EXPECT_TRUE(std::filesystem::exists(folder / file)) << file;
}

}  // namespace
}  // namespace toftwin::cli
