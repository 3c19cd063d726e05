// SPDX-License-Identifier: Apache-2.0
// What terms cost in an image of the Kinect v2's size, in milliseconds of processor time (of all cores together): evaluated,
// added as the effect `learned`, and taken off again as a source's correction.
//   terms_bench [ROUNDS]              default 200
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <toftwin/image.h>

#include "sim/effects/learned/correction.h"
#include "sim/effects/learned/ready_correction.h"
#include "sim/terms/image_terms.h"

namespace toftwin::terms {
namespace {

constexpr int kWidth = 512, kHeight = 424;

Field fieldOf(std::string_view name) {
  if (name == "column") return {Varies::Column, [](int x, int) { return x; }};
  if (name == "row") return {Varies::Row, [](int, int y) { return y; }};
  return {name == "time_s" ? Varies::Frame : Varies::Pixel, {}};
}

/// 32 knots over 0.5 to 4.5 m.
std::string curveText() {
  std::string text = "range_mm += 1 * curve(range_mm";
  for (int k = 0; k < 32; ++k) text += fmt::format(", {}, {}", 500.0 + 4000.0 / 31.0 * k, 5.0 - 0.3 * ((k * 7) % 32));
  return text + ")";
}

double processor_ms() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double medianOf(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

double millisecondsOf(const std::vector<std::string>& texts, int rounds) {
  std::vector<Term> terms;
  for (const std::string& text : texts) terms.push_back(*parseTerm(text));
  ImageTerms image{terms, kWidth, kHeight, fieldOf};
  Image<float> range_m{kWidth, kHeight};
  for (std::size_t i = 0; i < range_m.size(); ++i) range_m[i] = 0.5F + 4.0F * static_cast<float>((i * 7919) % 10007) / 10007.0F;
  std::vector<double> took, sums(kWidth);
  double all = 0.0;
  for (int round = 0; round < rounds; ++round) {
    const double start = processor_ms();
    image.setFrame([&](std::string_view) { return Known{100.0 + round, {}}; });
    for (int y = 0; y < kHeight; ++y) {
      std::ranges::fill(sums, 0.0);
      image.addRow(y, [&](std::size_t, std::span<double> row) {
        for (std::size_t x = 0; x < row.size(); ++x) row[x] = 1e3 * static_cast<double>((&range_m(0, y))[x]);
      }, sums);
      for (double sum : sums) all += sum;
    }
    took.push_back(processor_ms() - start);
  }
  if (all == 0.0) std::puts("nothing added");
  return medianOf(took);
}

struct Both {
  double added_ms, taken_off_ms;
};
Both wholeFrames(const std::vector<std::string>& texts, int rounds) {
  const sim::Learned learned{.title = {}, .terms = sim::LearnedTerms::parsed(texts)};
  const auto correction = sim::Correction::of({learned});
  CameraInfo camera;
  camera.width = kWidth, camera.height = kHeight;
  Moment moment;
  moment.since_power_on = 100.0 * second;
  const sim::Conditions now{moment, camera};
  sim::RangeImage image{.range_m = {kWidth, kHeight}, .amplitude = {kWidth, kHeight, 1000.0F}, .ambient = {kWidth, kHeight},
                        .flags = {kWidth, kHeight}, .phasors = {}};
  for (std::size_t i = 0; i < image.range_m.size(); ++i)
    image.range_m[i] = 0.5F + 4.0F * static_cast<float>((i * 7919) % 10007) / 10007.0F;
  sim::ReadyCorrection ready{correction->effects(), kWidth, kHeight, now};
  std::vector<double> added, taken_off;
  const auto timed = [](std::vector<double>& into, const auto& work) {
    const double start = processor_ms();
    work();
    into.push_back(processor_ms() - start);
  };
  for (int round = 0; round < rounds; ++round) {
    sim::RangeImage after = image;
    timed(added, [&] { after = learned.apply(std::move(after), now, sim::Random{1, 1, 1}); });
    sim::Correction::Images images{after.range_m, after.amplitude};
    timed(taken_off, [&] { images = ready.undone(std::move(images), now); });
  }
  return {medianOf(added), medianOf(taken_off)};
}

}  // namespace
}  // namespace toftwin::terms

int main(int argc, char** argv) {
  using toftwin::terms::curveText;
  const int rounds = argc > 1 ? std::max(1, std::atoi(argv[1])) : 200;
  const std::vector<std::pair<const char*, std::vector<std::string>>> sets{
      {"curve of 32 knots over range, column class, decay over time",
       {curveText(), "range_mm += 1.5 * class(column, 8, 3)", "range_mm += 12 * decay(time_s, 400)"}},
      {"the three as a product", {curveText() + " * class(column, 8, 3) * decay(time_s, 400)"}},
      {"sine over range", {"range_mm += -5.95 * sine(range_mm, 1250)"}},
      {"decay over range", {"range_mm += -5.95 * decay(range_mm, 1250)"}},
      {"checkerboard times range", {"range_mm += 0.001 * class(column + row, 2, 1) * range_mm"}}};
  fmt::print("{} x {}, median of {} frames, ms of processor time\n{:62} {:>9} {:>9} {:>9}\n", toftwin::terms::kWidth, toftwin::terms::kHeight,
             rounds, "", "evaluated", "added", "taken off");
  for (const auto& [name, texts] : sets) {
    const auto [added_ms, taken_off_ms] = toftwin::terms::wholeFrames(texts, rounds);
    fmt::print("{:62} {:9.2f} {:9.2f} {:9.2f}\n", name, toftwin::terms::millisecondsOf(texts, rounds), added_ms, taken_off_ms);
  }
  return 0;
}
