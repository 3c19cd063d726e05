// SPDX-License-Identifier: Apache-2.0
// What `toftwin render --transient` writes, beside phasors of the same paths.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <complex>
#include <cstring>
#include <fstream>
#include <numbers>
#include <sstream>

#include "program.h"
#include "protocol/settings/settings.h"
#include "sim/tracer/trace.h"
#include "tests/record/record_testing.h"
#include "tiny_camera.h"
#include "tools/cli/render_transient.h"

namespace toftwin::cli {
namespace {

using testing::HasSubstr;

constexpr int kWidth = 24, kHeight = 18, kBins = 1500;
constexpr double kFirst_m = 0.5, kBin_m = 0.03;

constexpr auto kCorner = R"([[material]]
name = "white"
albedo = 0.8
[[object]]
shape = "rectangle"
size_m = [4, 4, 0]
position_m = [0, 0, 2]
material = "white"
[[object]]
shape = "rectangle"
size_m = [4, 4, 0]
position_m = [0, 0.6, 0]
euler_deg = [90, 0, 0]
material = "white"
)";

std::string contentOf(const std::filesystem::path& file) {
  std::stringstream text;
  text << std::ifstream{file, std::ios::binary}.rdbuf();
  return text.str();
}

class TransientCommand : public testing::Test {
 protected:
  TransientCommand() {
    writeText(folder_ / "tiny.toml", kTinyCamera);
    writeText(folder_ / "corner.toml", kCorner);
  }
  Ran render(const std::string& arguments) {
    return runShell(fmt::format("cd '{}' && '{}' render tiny.toml --scene corner.toml {}",
                                (folder_ / "").string(), TOFTWIN_PROGRAM, arguments));
  }
  record::Folder folder_;
};

/// All light of a bin lies within half its width of the middle: a phasor is off by at most Σ h · k w/2, and
/// by the rounding of each bin to a float.
TEST_F(TransientCommand, AWaveformAppliedAfterwardsGivesThePhasorsOfTheSamePaths) {
  const Ran ran = render(fmt::format(
      "--samples 32 --surfaces 5 --seed 7 --position 0.1,0,0 --transient --first-m {} --bin-mm {} "
      "--bins {} -o light.npy",
      kFirst_m, 1e3 * kBin_m, kBins));
  ASSERT_EQ(ran.status, 0) << ran.err;
  const std::string file = contentOf(folder_ / "light.npy");
  EXPECT_THAT(file.substr(0, 256),
              HasSubstr(fmt::format("'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}, {})", kBins,
                                    kHeight, kWidth)));
  constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;
  std::vector<float> radiance(kBins * kPixels);
  ASSERT_GT(file.size(), 4 * radiance.size());
  std::memcpy(radiance.data(), file.data() + file.size() - 4 * radiance.size(), 4 * radiance.size());

  drivers::simulator::Keys keys;
  keys.samples_per_pixel = 32;
  keys.max_surfaces = 5;
  keys.seed = 7;
  Transform<World, Camera> pose;
  pose.translation_m = {0.1, 0.0, 0.0};
  const auto model = sim::SensorModel::load(folder_ / "tiny.toml");
  sim::TraceRequest request = transientRequest(*model, keys, pose);
  request.frequencies = {20_MHz, 100_MHz};
  request.harmonics = 1;
  const sim::Light light = sim::trace(*sim::Scene::load(folder_ / "corner.toml"), request);
  for (std::size_t f = 0; f < 2; ++f) {
    const double k = 2.0 * std::numbers::pi * request.frequencies[f].in(hertz) / kSpeedOfLight_m_per_s;
    double largest = 0.0;
    for (std::size_t i = 0; i < kPixels; ++i) {
      std::complex<double> phasor;
      double all = 0.0;
      for (int bin = 0; bin < kBins; ++bin) {
        const double here = static_cast<double>(radiance[static_cast<std::size_t>(bin) * kPixels + i]);
        phasor += std::polar(here, -k * (kFirst_m + kBin_m * (bin + 0.5)));
        all += here;
      }
      ASSERT_GT(all, 0.0);
      EXPECT_NEAR(all, static_cast<double>(light.steady[i]), 1e-5 * all);  // nothing is outside of the bins
      const double apart = std::abs(phasor - std::complex<double>{light.phasors[f][i]});
      EXPECT_LE(apart, all * (k * kBin_m / 2.0 + 1e-5)) << i;
      largest = std::max(largest, apart / (all * k * kBin_m / 2.0));
    }
    std::printf("%.0f MHz: off by up to %.2f of the bound\n", request.frequencies[f].in(megahertz), largest);
  }
}

TEST_F(TransientCommand, SaysWhereTheBinsLieAndWhatIsOutside) {
  // The wall lies 2 m and more away: ways of 4 m and more.
  ASSERT_EQ(render("--surfaces 1 --transient --first-m 4.5 --bin-mm 100 --bins 3 -o light.npy").status, 0);
  const auto about = settings::Table::load(folder_ / "light.npy.toml");
  ASSERT_TRUE(about) << about.error().message;
  const std::string text = contentOf(folder_ / "light.npy.toml");
  EXPECT_THAT(text, testing::AllOf(HasSubstr("first_m = 4.5\n"), HasSubstr("bin_m = 0.1\n"),
                                   HasSubstr("bins = 3\n")));
  const std::string key = "outside_share = ";
  const double outside = std::stod(text.substr(text.find(key) + key.size()));
  EXPECT_GT(outside, 0.1);
  EXPECT_LT(outside, 1.0);
}

TEST_F(TransientCommand, RefusesWhatItCannotWrite) {
  for (const std::string arguments :
       {"--transient -o light.png", "--transient -o light.npy --frames 3",
        "--transient -o light.npy -p range", "--transient -o light.npy --images", "--transient -o folder/",
        "--transient --bins 0 -o light.npy", "--bins 3 -o light.npy", "--first-m 1 -o light.png"}) {
    const Ran ran = render(arguments);
    EXPECT_NE(ran.status, 0) << arguments;
    EXPECT_THAT(ran.err, HasSubstr(arguments.find("--bins") != std::string::npos ? "--bins" : "--transient"))
        << arguments;
  }
  const Ran large = toftwin("render kinect_v2 --transient --bins 20000 -o /nowhere/light.npy");
  EXPECT_NE(large.status, 0);
  EXPECT_THAT(large.err, HasSubstr("20000 bins of 512 x 424 pixels are 16.2 GiB"));
}

}  // namespace
}  // namespace toftwin::cli
