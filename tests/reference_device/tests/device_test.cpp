// SPDX-License-Identifier: Apache-2.0
// The reference device against theory, and its hidden effects against what they say of themselves.
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

#include "tests/reference_device/device/device.h"

namespace toftwin::reference {
namespace {

constexpr double kPi = std::numbers::pi;

Board wallAt(double z_m, double half_side_m, double albedo) {
  return {{0, 0, z_m}, {half_side_m, 0, 0}, {0, half_side_m, 0}, {0, 0, 1}, albedo};
}

/// One narrow pixel with an isotropic lamp beside it, sines: what theory is written for.
Datasheet pinhole(double frequency_mhz) {
  Datasheet sheet;
  sheet.lens = {.width = 1, .height = 1, .fx = 1e5, .fy = 1e5, .cx = 0, .cy = 0};
  sheet.emitters = {{.power_w = 1.0, .isotropic = true}};
  sheet.modulations = {{.frequency = frequency_mhz * megahertz}};
  return sheet;
}

Transform<World, Camera> lookingFrom(Vec3d from, Vec3d to) {
  const Vec3d z = normalised(to - from), axis = cross({0, 0, 1}, z);
  Transform<World, Camera> pose;
  if (norm(axis) > 1e-12) pose = rotation<World, Camera>(normalised(axis), std::acos(z.z));
  pose.translation_m = from;
  return pose;
}

/// Of the camera at D from the edge of two walls of 1 x 1 m at 90°, on their bisector, looking at u from the
/// edge.
double cornerError_mm(double albedo, double frequency_mhz, double u_m) {
  const double s = std::sqrt(0.5);
  const Room corner{{{{0.5, 0, 0}, {0.5, 0, 0}, {0, 0.5, 0}, {0, 0, 1}, albedo},
                     {{0, 0, 0.5}, {0, 0, 0.5}, {0, 0.5, 0}, {1, 0, 0}, albedo}}};
  const Transport transport{corner, pinhole(frequency_mhz), {.fineness = 0.25}};
  const Vec3d from{1.5 * s, 0, 1.5 * s}, to{u_m, 0, 0};
  const Light light = transport.see(lookingFrom(from, to));
  const double k = transport.wavenumber(0), truth = norm(to - from);
  return -1e3 * std::arg(light.phasor(0, 1, 0) * std::polar(1.0, 2.0 * k * truth)) / (2.0 * k);
}

TEST(ReferenceLight, FallsWithTheSquareOfTheDistance) {
  const Transport transport{{{wallAt(2.0, 3.0, 0.5)}}, pinhole(30)};
  const double near = transport.see(lookingFrom({0, 0, 1}, {0, 0, 2})).steady[0];
  const double far = transport.see(lookingFrom({0, 0, 0}, {0, 0, 2})).steady[0];
  EXPECT_NEAR(near, 0.5 / kPi / (4.0 * kPi), 1e-9);  // ρ/π · P/4π / r²
  EXPECT_NEAR(near / far, 4.0, 1e-6);
}

TEST(ReferenceLight, FallsWithTheCosineOfTheIncidence) {
  const Transport transport{{{wallAt(2.0, 9.0, 0.5)}}, pinhole(30)};
  const double straight = transport.see(lookingFrom({0, 0, 0}, {0, 0, 2})).steady[0];
  const double aslant =
      transport.see(lookingFrom({-std::sqrt(12.0), 0, 0}, {0, 0, 2})).steady[0];  // 60°, 4 m
  EXPECT_NEAR(aslant / straight, 0.5 / 4.0, 1e-5);
}

TEST(ReferenceLight, ReadsOffTheRangeOfASingleSurfaceExactly) {
  Device device{{{wallAt(2.0, 9.0, 0.5)}}, pinhole(30), {}, 1};
  const State state{.world_from_camera = lookingFrom({-1, 0, 0.5}, {0, 0, 2})};
  EXPECT_NEAR(device.exposeNoiseFree(state, 0, false).measured.range_m[0], std::sqrt(1.0 + 2.25), 1e-6);
}

// Independent radiosity with 40 x 40 patches: right within 0.1 mm and half of its last digit from 10 cm on,
// too low by up to 1 mm at 2 cm (docs/tracer.md); our own patches are worth another 0.15 mm.
TEST(ReferenceLight, InACornerTakesTheDetourOfThePublishedTable) {
  const double u[] = {0.02, 0.10, 0.30, 0.60, 0.90};
  const double expected_30[] = {27.5, 60.8, 74.9, 52.3, 31.3},
               expected_120[] = {21.7, 46.9, 47.6, 13.3, -1.2};
  for (int i = 0; i < 5; ++i) {
    EXPECT_NEAR(cornerError_mm(0.8, 30, u[i]), expected_30[i], i == 0 ? 1.15 : 0.3) << u[i];
    EXPECT_NEAR(cornerError_mm(0.8, 120, u[i]), expected_120[i], i == 0 ? 1.15 : 0.3) << u[i];
  }
  EXPECT_NEAR(cornerError_mm(0.3, 30, 0.30), 25.8, 0.3);
}

// Between endless parallel walls of which the near one is black there is no detour.
TEST(ReferenceLight, BlackBoardsGiveNothingBack) {
  const Room room{{wallAt(2.0, 1.2, 0.8), wallAt(-0.5, 2.0, 0.0)}};
  const Transport transport{room, pinhole(30)};
  const double alone =
      Transport{{{wallAt(2.0, 2.0, 0.8)}}, pinhole(30)}.see(lookingFrom({0, 0, 0}, {0, 0, 2})).steady[0];
  EXPECT_NEAR(transport.see(lookingFrom({0, 0, 0}, {0, 0, 2})).steady[0], alone, 1e-9 * alone);
}

// Square on square, four steps: the triangle's harmonics 3, 5, 7 … leave a cyclic error of 0.0711 rad (56.5
// mm at 30 MHz).
TEST(ReferencePixels, OfSquareWavesWiggleAsTheTriangleSays) {
  Datasheet sheet = pinhole(30);
  sheet.modulations[0].emitted = sheet.modulations[0].demodulated = Datasheet::Wave::Square;
  sheet.sampling.harmonics = 31;
  Device device{{{wallAt(10.0, 20.0, 0.5)}}, sheet, {}, 1};
  double most_mm = 0.0;
  for (double range = 1.0; range < 3.0; range += 0.01) {
    const State state{.world_from_camera = lookingFrom({0, 0, 10 - range}, {0, 0, 10})};
    const double read = static_cast<double>(device.exposeNoiseFree(state, 0, false).measured.range_m[0]);
    most_mm = std::max(most_mm, 1e3 * std::abs(read - range));
  }
  EXPECT_NEAR(most_mm, 56.5, 0.5);
}

// σ_φ = √(2 (N_e + N_a) / N) / (m N_e) for two taps; read noise adds 2σ² to the variance of a difference.
TEST(ReferencePixels, AreAsNoisyAsPhotonsAndReadNoiseSay) {
  Datasheet sheet = pinhole(30);
  sheet.lens = {.width = 40, .height = 40, .fx = 1e5, .fy = 1e5, .cx = 19.5, .cy = 19.5};
  sheet.effects = {{.type = "shot_noise"}, {.type = "read_noise", .sigma_electrons = 25.0}};
  sheet.pixel.electrons_per_radiance_s = 1e9;
  Sealed still;
  still.rig = {0.0, 0.0, 0.0};
  Device device{{{wallAt(1.0, 9.0, 0.8)}}, sheet, std::move(still), 4};
  const State state{.world_from_camera = lookingFrom({0, 0, 0}, {0, 0, 1})};
  const double clean = static_cast<double>(device.exposeNoiseFree(state, 0, false).measured.range_m[0]);
  const double electrons = static_cast<double>(device.exposeNoiseFree(state, 0, false).measured.ambient[0]);
  double squares = 0.0;
  constexpr int kFrames = 20, kDraws = kFrames * 1600;
  for (int frame = 0; frame < kFrames; ++frame) {
    const Device::Exposed exposed = device.expose(state, static_cast<std::uint64_t>(frame));
    for (const float range : exposed.measured.range_m)
      squares += std::pow(static_cast<double>(range) - clean, 2);
  }
  const double sigma_phi = std::sqrt(2.0 * (electrons + 2.0 * 25.0 * 25.0) / 4.0) / (0.5 * electrons);
  const double sigma_m = sigma_phi * 299'792'458.0 / (4.0 * kPi * 30e6);
  // A variance of n draws is right within √(2/n): 4 of its standard errors, false alarm 6e-5.
  EXPECT_NEAR(squares / kDraws / (sigma_m * sigma_m), 1.0, 4.0 * std::sqrt(2.0 / kDraws));
}

/// A plate before a wall and another that stands aslant on it: bright and dark, near and far, an edge and a
/// corner.
Device deviceWith(const std::string& effect, double strength, std::uint64_t seed = 7) {
  Datasheet sheet = *readDatasheet(std::string{TOFTWIN_SOURCE_DIR} + "/tests/reference_device/camera.toml");
  const std::string file = testing::TempDir() + "sealed_" + effect + ".toml";
  std::ofstream{file} << "[[hidden]]\neffect = '" << effect << "'\nstrength = " << strength << "\n";
  auto sealed = readSealed(file);
  EXPECT_TRUE(sealed.ok()) << sealed.error().message;
  const double s = std::sqrt(0.5);
  const Room room{{wallAt(2.0, 1.2, 0.8),
                   {{0.3, 0, 1.3}, {0.2, 0, 0}, {0, 0.3, 0}, {0, 0, 1}, 0.3},
                   {{-0.4, 0, 1.7171572875}, {0.4 * s, 0, 0.4 * s}, {0, 0.3, 0}, {s, 0, -s}, 0.8}}};
  sheet.lens = {.width = 24, .height = 18, .fx = 21.0, .fy = 21.0, .cx = 11.5, .cy = 8.5};
  return {room, sheet, *std::move(sealed), seed, {.fineness = 1.0}};
}
State usual() {
  State state{.since_power_on_s = 200.0, .exposure_scale = 0.62, .ambient_klx = 4.0};
  state.world_from_camera.translation_m = {0.05, 0, 0.85};
  return state;
}

class EachHidden : public testing::TestWithParam<std::string> {};

TEST_P(EachHidden, OfStrengthNothingChangesNothing) {
  Device none = deviceWith(GetParam(), 0.0);
  const auto with = none.exposeNoiseFree(usual(), 3, true), without = none.exposeNoiseFree(usual(), 3, false);
  EXPECT_EQ(with.charges.taps, without.charges.taps);
  EXPECT_EQ(with.measured.amplitude, without.measured.amplitude);
  for (std::size_t i = 0; i < with.measured.range_m.size(); ++i) {
    EXPECT_TRUE(with.measured.range_m[i] == without.measured.range_m[i] ||
                std::isnan(without.measured.range_m[i]));
  }
}

TEST_P(EachHidden, ActsInTheStageThatItSays) {
  const auto rows = allHidden();
  const About& about = std::ranges::find(rows, GetParam(), [](const Row& r) { return r.about.name; })->about;
  const double strength = about.unit.starts_with("share") ? 0.05 : 30.0;
  Device some = deviceWith(GetParam(), strength);
  const auto with = some.exposeNoiseFree(usual(), 3, true), without = some.exposeNoiseFree(usual(), 3, false);
  double charge = 0.0, range = 0.0, amplitude = 0.0;
  for (std::size_t i = 0; i < with.charges.taps.size(); ++i)
    charge = std::max(charge, std::abs(with.charges.taps[i] - without.charges.taps[i]));
  for (std::size_t i = 0; i < with.measured.range_m.size(); ++i) {
    const float off = with.measured.range_m[i] - without.measured.range_m[i];
    if (!std::isnan(off)) range = std::max(range, static_cast<double>(std::abs(off)));
    const float gain = with.measured.amplitude[i] / without.measured.amplitude[i];
    amplitude = std::max(amplitude, static_cast<double>(std::abs(gain - 1.0F)));
  }
  EXPECT_EQ(charge > 0.0, about.stage != Stage::Range);
  EXPECT_TRUE(range > 1e-5 || amplitude > 1e-4) << range << " m, " << amplitude;
}

TEST_P(EachHidden, IsTheSameForTheSameSeedAndAnotherForAnother) {
  Device a = deviceWith(GetParam(), 0.01), b = deviceWith(GetParam(), 0.01),
         other = deviceWith(GetParam(), 0.01, 8);
  const auto first = a.expose(usual(), 3).charges.taps;
  EXPECT_EQ(first, b.expose(usual(), 3).charges.taps);
  EXPECT_NE(first, other.expose(usual(), 3).charges.taps);
  EXPECT_NE(first, a.expose(usual(), 4).charges.taps);
}

std::vector<std::string> names() {
  std::vector<std::string> all;
  for (const Row& row : allHidden()) all.emplace_back(row.about.name);
  return all;
}
INSTANTIATE_TEST_SUITE_P(All, EachHidden, testing::ValuesIn(names()),
                         [](const auto& one) { return one.param; });

TEST(Documents, HoldTheTableOfHiddenEffectsAsItIs) {
  std::stringstream page;
  page << std::ifstream{std::string{TOFTWIN_SOURCE_DIR} + "/docs/reference-device.md"}.rdbuf();
  EXPECT_THAT(page.str(), testing::HasSubstr("<!-- hidden: generated -->\n" + documentHidden() + "<!-- end -->"))
      << "reference_device --document prints it";
}

TEST(Sealed, AllSpecificationsOfTheRepositoryAreRead) {
  int count = 0;
  const auto folder = std::filesystem::path{TOFTWIN_SOURCE_DIR} / "tests/reference_device/sealed";
  for (const auto& file : std::filesystem::directory_iterator{folder}) {
    const auto sealed = readSealed(file.path());
    EXPECT_TRUE(sealed.ok()) << sealed.error().message;
    ++count;
  }
  EXPECT_GE(count, 30);
}

TEST(Sealed, OfAnUnknownEffectOrKeyIsRefusedWithItsPlace) {
  const std::string file = testing::TempDir() + "wrong.toml";
  std::ofstream{file} << "[[hidden]]\neffect = 'gremlins'\n[[hidden]]\neffect = 'dust'\nstrenght = 1\n";
  const auto sealed = readSealed(file);
  ASSERT_FALSE(sealed.ok());
  EXPECT_THAT(sealed.error().message, testing::HasSubstr("gremlins"));
  EXPECT_THAT(sealed.error().message, testing::HasSubstr("strenght"));
}

TEST(Datasheet, ThatDeclaresWhatTheDeviceLacksIsRefused) {
  const std::string file = testing::TempDir() + "camera.toml";
  std::ofstream{file} << "[[emitter]]\n[[modulation]]\n[[effect]]\ntype = 'lens_scatter'\n";
  const auto sheet = readDatasheet(file);
  ASSERT_FALSE(sheet.ok());
  EXPECT_THAT(sheet.error().message, testing::HasSubstr("lens_scatter"));
}

}  // namespace
}  // namespace toftwin::reference
