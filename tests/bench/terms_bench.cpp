// SPDX-License-Identifier: Apache-2.0
// What terms cost in an image of the Kinect v2's size, on one core.
//   terms_bench [ROUNDS]              default 200
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <toftwin/image.h>

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

double millisecondsOf(const std::vector<std::string>& texts, int rounds) {
  std::vector<Term> terms;
  for (const std::string& text : texts) terms.push_back(*parseTerm(text));
  ImageTerms image{terms, kWidth, kHeight, fieldOf};
  Image<float> range_m{kWidth, kHeight};
  for (std::size_t i = 0; i < range_m.size(); ++i) range_m[i] = 0.5F + 4.0F * static_cast<float>((i * 7919) % 10007) / 10007.0F;
  std::vector<double> took, sums(kWidth);
  double all = 0.0;
  for (int round = 0; round < rounds; ++round) {
    const auto start = std::chrono::steady_clock::now();
    image.setFrame([&](std::string_view) { return Known{100.0 + round, {}}; });
    for (int y = 0; y < kHeight; ++y) {
      std::ranges::fill(sums, 0.0);
      image.addRow(y, [&](std::size_t, std::span<double> row) {
        for (std::size_t x = 0; x < row.size(); ++x) row[x] = 1e3 * static_cast<double>((&range_m(0, y))[x]);
      }, sums);
      for (double sum : sums) all += sum;
    }
    took.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  std::ranges::sort(took);
  if (all == 0.0) std::puts("nothing added");
  return took[took.size() / 2];
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
  fmt::print("{} x {}, one core, median of {} frames\n", toftwin::terms::kWidth, toftwin::terms::kHeight, rounds);
  for (const auto& [name, texts] : sets)
    fmt::print("{:62} {:6.2f} ms\n", name, toftwin::terms::millisecondsOf(texts, rounds));
  return 0;
}
