// SPDX-License-Identifier: Apache-2.0
// What a table showed, in a camera file that the simulator runs.
#include "calib/discover/table_camera.h"

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include <gmock/gmock.h>

#include "tests/discover/discovered.h"

namespace toftwin::discover {
namespace {

using testing::Contains;
using testing::HasSubstr;

/// Measured less reference, in mm, over the reference and a temperature; noise of 0.5 mm.
TableDiscovery tableOf(const std::function<double(double reference_m, double temperature_c)>& error_mm,
                       const std::string& headers = "reference_m,measured_mm,temperature_sensor_c") {
  std::mt19937_64 bits{11};
  const auto uniform = [&] { return static_cast<double>(bits() >> 11) * 0x1p-53; };
  std::string text = headers + "\n";
  for (int i = 0; i < 600; ++i) {
    const double reference = 0.5 + 4.0 * uniform(), temperature = 20.0 + 25.0 * uniform();
    double noise = -6.0;
    for (int k = 0; k < 12; ++k) noise += uniform();
    text += fmt::format("{:.5f},{:.4f},{:.3f}\n", reference,
                        1e3 * reference + error_mm(reference, temperature) + 0.5 * noise, temperature);
  }
  return discovered(text);
}

/// What a camera's learned ranges add to a flat wall there.
double addedBy(const std::string& toml, double range_m, double temperature_c) {
  const auto model = sim::SensorModel::parse(toml, "camera.toml");
  if (!model) throw std::runtime_error(model.error().message);
  sim::RangeImage image{.range_m = Image<float>(1, 1, static_cast<float>(range_m)),
                        .amplitude = Image<float>(1, 1, 1000.0F),
                        .ambient = Image<float>(1, 1),
                        .flags = Image<std::uint8_t>(1, 1),
                        .phasors = {}};
  Moment moment;
  moment.temperatures = {{"sensor", temperature_c * celsius}};
  double added_mm = 0.0;
  for (const sim::AnyEffect& effect : model->effects()) {
    const auto* learned = std::get_if<sim::Learned>(&effect);
    if (learned == nullptr) continue;
    const sim::RangeImage after = learned->apply(image, {moment, model->camera()}, sim::Random{1, 1, 1});
    added_mm += 1e3 * (static_cast<double>(after.range_m[0]) - range_m);
  }
  return added_mm;
}

/// Offset, gain, a wave over the range and a slope over the temperature: all of them, in millimetres, are what the
/// simulated camera errs by. Tables are straight between 17 places and more, which costs a wave of 4 mm 0.15 mm at most;
/// 480 rows of 0.5 mm know each of a dozen numbers to 0.1 mm.
TEST(TableCamera, ErrsAsTheTableDid) {
  const auto error_mm = [](double reference, double temperature) {
    return 7.0 + 2.0 * reference + 4.0 * std::sin(2.0 * std::numbers::pi * reference / 1.249) + 0.3 * (temperature - 30.0);
  };
  const TableDiscovery discovery = tableOf(error_mm);
  ASSERT_EQ(discovery.finding.effects.size(), 2U) << verdictOf(discovery);
  const auto camera = loadCamera("preset:generic_cw");
  ASSERT_TRUE(camera) << camera.error().message;
  const auto mended = cameraWith(discovery, *camera);
  ASSERT_TRUE(mended) << mended.error().message;
  for (const double range : {0.7, 1.3, 2.2, 3.1, 4.3})
    for (const double temperature : {22.0, 31.0, 43.0})
      EXPECT_NEAR(addedBy(mended->toml, range, temperature), error_mm(range, temperature), 0.6)
          << range << " m, " << temperature << " degrees";
}

TEST(TableCamera, SaysWhatAColumnWasTakenForAndWhatIsNotWritten) {
  const auto slope = [](double, double temperature) { return 0.3 * temperature; };
  const auto camera = loadCamera("generic_cw");
  ASSERT_TRUE(camera);
  const auto plain = cameraWith(tableOf(slope, "reference_m,measured_mm,temp_c"), *camera);
  ASSERT_TRUE(plain);
  EXPECT_THAT(plain->notes, Contains(HasSubstr("takes temp_c for the sensor's temperature")));
  const auto unknown = cameraWith(tableOf(slope, "reference_m,measured_mm,voltage"), *camera);
  ASSERT_TRUE(unknown);
  EXPECT_THAT(unknown->notes, Contains(HasSubstr("what goes with voltage is not in camera.toml")));
  EXPECT_NEAR(addedBy(unknown->toml, 2.0, 25.0), 0.3 * 32.5, 0.5) << "the offset is, at the mean temperature";
}

TEST(TableCamera, NeedsLengths) {
  const auto camera = loadCamera("generic_cw");
  const auto none = cameraWith(tableOf([](double, double) { return 1.0; }, "x,error_lsb,y"), *camera);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("a camera file takes lengths"));
  EXPECT_THAT(loadCamera("nowhere.toml").error().message, HasSubstr("--model takes a camera file or one of the presets"));
}

}  // namespace
}  // namespace toftwin::discover
