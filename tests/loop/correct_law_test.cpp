// SPDX-License-Identifier: Apache-2.0
// One law for both ways of taking a model off: rows of a table, and pixels of a frame.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <fmt/format.h>

#include "calib/loop/correct.h"
#include "sim/effects/learned/correction.h"

namespace toftwin::loop {
namespace {

constexpr int kWidth = 32, kHeight = 24;

/// Terms of the kinds that discover writes for a camera's columns; r + t(r) rises.
std::vector<std::string> drawTerms(std::mt19937_64& random) {
  const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>{low, high}(random); };
  std::string curve = "range_mm += 1 * curve(range_mm";
  for (double x = 500.0; x < 4500.0; x += between(150.0, 500.0)) curve += fmt::format(", {}, {}", x, between(-9.0, 9.0));
  const std::vector<std::string> all{
      fmt::format("range_mm += {}", between(-40.0, 40.0)),
      fmt::format("range_mm += {} * range_mm", between(-0.2, 0.2)),
      fmt::format("range_mm += {} * sine(range_mm, {})", between(-9.0, 9.0), between(300.0, 2000.0)),
      fmt::format("range_mm += {} * decay(range_mm, {}) * column", between(-0.1, 0.1), between(300.0, 2000.0)),
      fmt::format("range_mm += {} * class(column + row, 2, 1)", between(-9.0, 9.0)),
      fmt::format("range_mm += {} * decay(time_s, {}) * power(range_mm, 0.5)", between(-0.2, 0.2), between(50.0, 400.0)),
      fmt::format("range_mm += {} * bump(row, {}, 4)", between(-9.0, 9.0), between(0.0, 24.0)),
      curve + ")"};
  std::vector<std::string> some;
  for (const std::string& one : all)
    if (random() % 2 == 0) some.push_back(one);
  if (some.empty()) some.push_back(all[2]);
  return some;
}

/// A row for each pixel.
table::Readings tableOf(const Image<float>& range_m, double time_s) {
  table::Readings readings{.file = "pixels.csv", .unit = "mm", .measured_name = "depth_mm"};
  table::Column column{.header = "column", .nature = table::Nature::Index}, row{.header = "row", .nature = table::Nature::Index}, time{.header = "time_s", .unit = "s", .nature = table::Nature::Time};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      readings.measured.push_back(1e3 * static_cast<double>(range_m(x, y)));
      column.values.push_back(x), row.values.push_back(y), time.values.push_back(time_s);
      readings.line.push_back(readings.line.size() + 2);
    }
  }
  readings.error = readings.measured;
  readings.covariates = {column, row, time};
  return readings;
}

TEST(CorrectLaw, RowsOfATableAndPixelsOfAFrameAreCorrectedAlike) {
  constexpr std::uint64_t kSeed = 45;
  std::mt19937_64 random{kSeed};
  for (int set = 0; set < 120; ++set) {
    const std::vector<std::string> texts = drawTerms(random);
    std::string listed;
    for (const std::string& text : texts) listed += "\"" + text + "\", ";
    const auto model = parseModel("unit = \"mm\"\n[[effect]]\ntype = \"learned\"\nterms = [" + listed + "]\n", "m.toml");
    ASSERT_TRUE(model.ok()) << model.error().message;
    Image<float> range_m{kWidth, kHeight};
    for (float& r : range_m.pixels()) r = std::uniform_real_distribution<float>{0.7F, 4.2F}(random);
    const double time_s = std::uniform_real_distribution<double>{0.0, 300.0}(random);

    const table::Readings readings = tableOf(range_m, time_s);
    const auto rows = corrected(evidenceOf(readings), readings, *model, termsOf(*model));
    ASSERT_TRUE(rows.ok()) << rows.error().message;
    const auto correction = sim::Correction::of({sim::Learned{.title = {}, .terms = termsOf(*model)}});
    ASSERT_TRUE(correction.ok()) << correction.error().message;
    Moment moment;
    moment.since_power_on = time_s * second;
    CameraInfo camera;
    camera.width = kWidth, camera.height = kHeight;
    const auto pixels = correction->undone({range_m, {}}, {.moment = moment, .camera = camera});
    for (std::size_t i = 0; i < range_m.size(); ++i) {
      // A pixel is found to 1e-4 mm and is a 32-bit number of metres: 2.4e-4 mm at 4 m.
      ASSERT_NEAR(1e3 * static_cast<double>(pixels.range_m[i]), (*rows)[static_cast<Eigen::Index>(i)], 5e-4)
          << "seed " << kSeed << ", set " << set << ", pixel " << i << ": " << listed;
    }
  }
}

}  // namespace
}  // namespace toftwin::loop
