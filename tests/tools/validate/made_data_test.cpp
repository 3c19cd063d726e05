// SPDX-License-Identifier: Apache-2.0
// Data that were made here, of a camera of no preset, in columns with names of their own: what was put into them must be
// found, and nothing of the measurements of 2018 is needed.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tools/validate/free_numbers.h"
#include "tools/validate/traced_line.h"
#include "tools/validate/validate.h"
#include "tools/validate/walls.h"

namespace toftwin::validate {
namespace {

constexpr unsigned kSeed = 20261129;

const char* const kCamera = R"(model = "Own camera"
[lens]
width = 96
height = 72
fx = 80.0
fy = 80.0
cx = 47.5
cy = 35.5
[[emitter]]
position_mm = [20.0, 0.0, 0.0]
[[modulation]]
frequency_mhz = 24.0
[pixel]
electrons_per_radiance_s = 1e9
[decoder]
algorithm = "n_phase"
farthest_m = 6.2
[[effect]]
type = "shot_noise"
)";

std::string cornerToml(double albedo) {
  return materialToml("plaster", albedo) + wallToml({-600, 600, 0, 1200, 900, "plaster"}) + wallToml({0, 1200, 600, 600, 900, "plaster"});
}

const char* const kDataset = R"(title = "Made data"
data = "made"
[[camera]]
name = "mine"
title = "My camera"
file = "camera.toml"
[[judge]]
kind = "distances"
camera = "mine"
title = "distances"
file = "rail.csv"
reference = "true"
measured = "read"
candidates = "candidates.toml"
at_most = 1
[[judge]]
kind = "line"
camera = "mine"
title = "corner"
files = ["row.csv"]
reference = "scanner.csv"
x = "right"
z = "ahead"
scene = "corner.toml"
edges_mm = [0.0, 1200.0]
parts_mm = [-1e9, -200, 0, 200, 1e9]
reading = "clean"
samples = 6000
batches = 1
block_rays = 6
number = [
  { role = "albedo", name = "albedo", cause = "multipath", material = "plaster", values = [0.3, 0.6, 0.8, 1.0], start = 0.5, low = 0.2, high = 1.0, decimals = 2 },
  { role = "constant", name = "constant", unit = "mm", low = -50.0, high = 50.0 },
]
)";

const char* const kCandidates = R"([[candidate]]
name = "step_phase"
effect = [{ type = "step_phase", step = 0 }, { type = "step_phase", step = 1 }]
number = [{ unit = "°", step = 0.1, low = -20.0, high = 20.0, keys = ["error_rad", "error_rad"], per = [0.0174533, -0.0174533] }]
[[candidate]]
name = "time_walk"
effect = [{ type = "time_walk" }]
number = [{ unit = "mm", step = 1.0, low = -100.0, high = 100.0, keys = ["per_e_fold_mm"] }]
)";

/// A rail with a delay of 25 mm and a step that is 3° late; a corner of albedo 0.7 and a constant of 9 mm.
class MadeData : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const std::filesystem::path root = std::filesystem::path{testing::TempDir()} / "made_data";
    std::filesystem::remove_all(root);
    std::filesystem::create_directories(root / "made");
    std::ofstream{root / "camera.toml"} << kCamera;
    std::ofstream{root / "dataset.toml"} << kDataset;
    std::ofstream{root / "candidates.toml"} << kCandidates;
    std::ofstream{root / "corner.toml"} << cornerToml(0.5);
    const auto model = sim::SensorModel::parse(kCamera, "camera.toml");
    ASSERT_TRUE(model.ok()) << model.error().message;
    std::mt19937 random(kSeed);
    writeRail(withoutNoise(*model), root / "made" / "rail.csv", random);
    writeCorner(withoutNoise(*model), root / "made", random);
    const auto set = loadDataset(root / "dataset.toml");
    ASSERT_TRUE(set.ok()) << set.error().message;
    auto judged = judgeAll(*set, 1.0, nullptr);
    ASSERT_TRUE(judged.ok()) << judged.error().message;
    all = *std::move(judged);
    page = compare::toMarkdown(reportOf(*set, all, ""));
  }

  static void writeRail(const sim::SensorModel& camera, const std::filesystem::path& file, std::mt19937& random) {
    const sim::SensorModel truth = withMore(
        camera, {sim::Delay{.offset = 25_mm}, sim::StepPhase{.step = 0, .error = 3_deg}, sim::StepPhase{.step = 1, .error = -3_deg}}, false);
    std::vector<double> distances;
    for (double d = 590.0; d < 3020.0; d += 15.0) distances.push_back(d);
    const auto walls = traceWalls(camera, 0.8, distances, kSeed);
    ASSERT_TRUE(walls.ok());
    std::uniform_real_distribution<double> anywhere(600.0, 3000.0);
    std::normal_distribution<double> noise(0.0, 1.0);
    std::vector<double> reference;
    for (int i = 0; i < 600; ++i) reference.push_back(anywhere(random));
    const std::vector<double> error = errorsAt(reference, walls->truth_mm, readRanges(truth, *walls));
    std::ofstream out{file};
    out << "true,read\n";
    for (std::size_t i = 0; i < reference.size(); ++i)
      out << fmt::format("{:.3f},{:.3f}\n", reference[i], reference[i] + error[i] + noise(random));
  }

  static void writeCorner(const sim::SensorModel& camera, const std::filesystem::path& folder, std::mt19937& random) {
    const auto scene = sim::Scene::parse(cornerToml(0.7), "corner.toml");
    ASSERT_TRUE(scene.ok());
    const TracedLine traced = traceLine(camera.traceRequest(), *scene, {.samples = 20000, .seed = 77});
    const ScanLine read = readLine(camera, traced, 1).line;
    std::normal_distribution<double> noise(0.0, 0.5);
    std::ofstream row{folder / "row.csv"}, scanner{folder / "scanner.csv"};
    row << "right,ahead\n", scanner << "right,ahead\n";
    for (std::size_t i = 0; i < read.size(); ++i) {
      const double slope = std::sqrt(1.0 + read.t[i] * read.t[i]), z = (read.range_mm[i] + 9.0 + noise(random)) / slope,
                   exact = traced.truth_mm[i] / slope;
      if (!std::isfinite(z + exact)) continue;
      row << fmt::format("{:.4f},{:.4f}\n", read.t[i] * z, z);
      scanner << fmt::format("{:.4f},{:.4f}\n", read.t[i] * exact, exact);
    }
  }

  static const Judged& of(const std::string& id) {
    for (const Judged& one : all)
      if (one.finding.section.id == id) return one;
    throw std::runtime_error("no section " + id);
  }
  static double numberOf(const Judged& judged, const std::string& name) {
    return judged.finding.data.find("held_out")->find(name)->number();
  }

  static inline std::vector<Judged> all;
  static inline std::string page;
};

TEST_F(MadeData, RailIsLeftWithItsNoise) {
  const Outcome& outcome = of("distances-mine").outcomes.front();
  EXPECT_EQ(outcome.data, "My camera, distances");
  EXPECT_GT(outcome.as_is_mm, 20.0);
  EXPECT_GT(outcome.constant_mm, 2.0);
  // The root mean square of some 300 rows of noise of 1 mm is known to 4 %.
  EXPECT_NEAR(outcome.fitted_mm, 1.0, 0.2) << "seed " << kSeed;
}

TEST_F(MadeData, TheEffectThatWasPutInIsChosen) {
  const auto& ablations = of("distances-mine").ablations;
  ASSERT_EQ(ablations.size(), 2u) << page;
  EXPECT_EQ(ablations[0].cause, "step_phase");
  EXPECT_EQ(ablations[1].cause, "constant delay");
  EXPECT_GT(ablations[1].without, 5.0 * ablations[1].with);
}

TEST_F(MadeData, CornersAlbedoAndConstantAreFound) {
  const Judged& corner = of("line-mine");
  EXPECT_NEAR(numberOf(corner, "albedo"), 0.7, 0.05) << page;
  EXPECT_NEAR(numberOf(corner, "constant"), 9.0, 1.5) << page;
  // Noise of 0.5 mm along the ray and the Monte-Carlo noise of 6,000 paths.
  EXPECT_LT(corner.outcomes.front().fitted_mm, 1.5);
  EXPECT_GT(corner.outcomes.front().as_is_mm, 8.0);
}

TEST_F(MadeData, WithoutMultipathTheCornerFitsWorse) {
  const auto& ablations = of("line-mine").ablations;
  ASSERT_EQ(ablations.size(), 2u);
  EXPECT_EQ(ablations[0].cause, "multipath");
  EXPECT_GT(ablations[0].without, 3.0 * ablations[0].with);
}

TEST_F(MadeData, PageIsOfThisCameraAlone) {
  EXPECT_EQ(page.rfind("# Made data\n", 0), 0u) << page.substr(0, 100);
  for (const char* other : {"Kinect", "O3D303", "published"}) EXPECT_EQ(page.find(other), std::string::npos) << other;
}

}  // namespace
}  // namespace toftwin::validate
