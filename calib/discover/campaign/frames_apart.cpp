// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/frames_apart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>

#include <fmt/format.h>

namespace toftwin::discover {
namespace {

constexpr std::size_t kFewestFrames = 4, kFewestCaptures = 3, kFewestOfClass = 6;
constexpr std::size_t kAllPairs = 64;
constexpr std::uint64_t kMostPeriod = 16, kMostInCapture = 4;
constexpr int kDraws = 2000;
constexpr double kMostP = 0.002;
constexpr std::size_t kKinds = 2;  ///< range and gain

using Values = std::array<double, kKinds>;

struct Series {
  std::vector<std::uint64_t> sequence{};
  std::vector<Values> value{};      ///< without their mean and their straight drift, in units of their spread
  std::vector<Values> as_read{};
  Values spread{};
};

double medianOf(std::vector<double> numbers) {
  const auto middle = numbers.begin() + static_cast<std::ptrdiff_t>(numbers.size() / 2);
  std::nth_element(numbers.begin(), middle, numbers.end());
  return *middle;
}

/// The median of the sizes, in standard deviations of Gaussian noise: a frame or two that are off do not make it large.
double spreadOf(std::vector<double> numbers) {
  for (double& one : numbers) one = std::abs(one);
  return medianOf(std::move(numbers)) / 0.6745;
}

/// The drift as the median of the slopes between all pairs (P. K. Sen, J. Am. Stat. Assoc. 63 (1968) 1379): a frame
/// that is off does not tilt it. Of many frames, those half of them apart.
std::vector<double> withoutDrift(std::vector<double> numbers) {
  const std::size_t n = numbers.size();
  std::vector<double> slopes;
  for (std::size_t k = n > kAllPairs ? n / 2 : 1; k < n; ++k)
    for (std::size_t i = n > kAllPairs ? k - n / 2 : 0; i < k; i += n > kAllPairs ? n : 1)
      slopes.push_back((numbers[k] - numbers[i]) / static_cast<double>(k - i));
  const double slope = medianOf(std::move(slopes));
  for (std::size_t k = 0; k < n; ++k) numbers[k] -= slope * static_cast<double>(k);
  const double mean = std::accumulate(numbers.begin(), numbers.end(), 0.0) / static_cast<double>(n);
  for (double& one : numbers) one -= mean;
  return numbers;
}

std::optional<Series> seriesOf(const MeasuredCapture& capture) {
  if (capture.each.size() < kFewestFrames) return std::nullopt;
  Series series;
  std::array<std::vector<double>, kKinds> numbers;
  for (const FrameAlone& frame : capture.each) {
    series.sequence.push_back(frame.sequence);
    series.as_read.push_back({frame.range_mm, frame.gain_percent});
    for (std::size_t kind = 0; kind < kKinds; ++kind) numbers[kind].push_back(series.as_read.back()[kind]);
  }
  series.value.resize(capture.each.size());
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    const std::vector<double> left = withoutDrift(numbers[kind]);
    series.spread[kind] = spreadOf(left);
    for (std::size_t k = 0; k < left.size(); ++k)
      series.value[k][kind] = series.spread[kind] > 0.0 ? left[k] / series.spread[kind] : 0.0;
  }
  return series;
}

std::vector<FrameClass> allClasses() {
  std::vector<FrameClass> all;
  for (std::uint64_t period = 2; period <= kMostPeriod; ++period)
    for (std::uint64_t rest = 0; rest < period; ++rest) all.push_back({period, rest, false});
  for (std::uint64_t period = 2; period <= kMostInCapture; ++period)
    for (std::uint64_t rest = 0; rest < period; ++rest) all.push_back({period, rest, true});
  // The first frames of a capture, of which no other is in the class.
  for (std::uint64_t place = 0; place < kMostInCapture; ++place) all.push_back({1'000'000, place, true});
  return all;
}

/// Where frames of each class stand: capture and place, which no order of their values changes.
using Members = std::vector<std::vector<std::pair<std::size_t, std::size_t>>>;
Members membersOf(const std::vector<FrameClass>& classes, const std::vector<Series>& all) {
  Members members(classes.size());
  for (std::size_t i = 0; i < classes.size(); ++i)
    for (std::size_t c = 0; c < all.size(); ++c)
      for (std::size_t k = 0; k < all[c].sequence.size(); ++k)
        if (classes[i].has(all[c].sequence[k], k)) members[i].emplace_back(c, k);
  return members;
}

/// What any order of the frames leaves as it is: mean and deviation of the values and of their squares.
struct Usual {
  Values mean_of_squares{}, deviation_of_squares{};
};
Usual usualOf(const std::vector<Series>& all) {
  Usual usual;
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    double squares = 0.0, fourth = 0.0, n = 0.0;
    for (const Series& one : all) {
      for (const Values& value : one.value) {
        const double square = value[kind] * value[kind];
        squares += square, fourth += square * square, n += 1.0;
      }
    }
    usual.mean_of_squares[kind] = squares / n;
    usual.deviation_of_squares[kind] = std::sqrt(std::max(0.0, fourth / n - squares * squares / n / n));
  }
  return usual;
}

/// The largest sum of a class's values, or of their squares beyond the usual, in deviations of such sums of frames in any
/// order, and whose it is. The squares are for what is now more, now less, as the scene has it.
std::pair<double, std::size_t> largest(const Members& members, const std::vector<Series>& all, const Usual& usual) {
  std::pair<double, std::size_t> best{0.0, 0};
  for (std::size_t i = 0; i < members.size(); ++i) {
    if (members[i].size() < kFewestOfClass) continue;
    const auto n = static_cast<double>(members[i].size());
    for (std::size_t kind = 0; kind < kKinds; ++kind) {
      if (!(usual.deviation_of_squares[kind] > 0.0)) continue;
      double sum = 0.0, squares = 0.0;
      for (const auto& [c, k] : members[i]) {
        const double value = all[c].value[k][kind];
        sum += value, squares += value * value;
      }
      const double of_sum = std::abs(sum) / std::sqrt(n * usual.mean_of_squares[kind]),
                   of_squares = (squares - n * usual.mean_of_squares[kind]) /
                                (std::sqrt(n) * usual.deviation_of_squares[kind]);
      if (const double most = std::max(of_sum, of_squares); most > best.first) best = {most, i};
    }
  }
  return best;
}

/// The class's mean less that of the others, capture by capture; captures count by their spread.
Difference differenceOf(const FrameClass& which, const std::vector<Series>& all, std::size_t kind) {
  double sum = 0.0, weights = 0.0, squares = 0.0;
  std::vector<std::pair<double, double>> each;  // difference, weight
  for (const Series& one : all) {
    double in = 0.0, out = 0.0, n_in = 0.0, n_out = 0.0;
    for (std::size_t k = 0; k < one.as_read.size(); ++k) {
      const double value = one.as_read[k][kind];
      (which.has(one.sequence[k], k) ? in : out) += value;
      (which.has(one.sequence[k], k) ? n_in : n_out) += 1.0;
    }
    if (n_in == 0.0 || n_out == 0.0 || !(one.spread[kind] > 0.0)) continue;
    const double weight = 1.0 / (one.spread[kind] * one.spread[kind] * (1.0 / n_in + 1.0 / n_out));
    each.emplace_back(in / n_in - out / n_out, weight);
    sum += weight * each.back().first, weights += weight;
  }
  if (each.size() < 2) return {};
  const double mean = sum / weights;
  for (const auto& [value, weight] : each) squares += weight * weight * (value - mean) * (value - mean);
  const auto n = static_cast<double>(each.size());
  return {mean, std::sqrt(squares * n / (n - 1.0)) / weights};
}

std::string ordinal(std::uint64_t number) {
  const std::uint64_t last = number % 10;
  const bool is_teen = number % 100 / 10 == 1;
  return fmt::format("{}{}", number, is_teen || last == 0 || last > 3 ? "th" : last == 1 ? "st" : last == 2 ? "nd" : "rd");
}

}  // namespace

std::string FramesApart::inWords() const {
  if (which.is_in_capture && which.period > kMostPeriod)
    return fmt::format("the {} frame of each capture", ordinal(which.rest + 1));
  if (!which.is_in_capture) return fmt::format("every {} frame", ordinal(which.period));
  return fmt::format("every {} frame of each capture, from the {} on", ordinal(which.period), ordinal(which.rest + 1));
}

std::optional<FramesApart> framesApart(const std::vector<MeasuredCapture>& captures, std::uint64_t seed) {
  std::vector<Series> all;
  for (const MeasuredCapture& capture : captures)
    if (auto series = seriesOf(capture)) all.push_back(*std::move(series));
  if (all.size() < kFewestCaptures) return std::nullopt;
  const std::vector<FrameClass> classes = allClasses();
  const Members members = membersOf(classes, all);
  const Usual usual = usualOf(all);
  const auto [statistic, place] = largest(members, all, usual);
  std::mt19937_64 random{seed};
  std::vector<Series> drawn = all;
  int as_large = 0;
  const auto chance = [&] { return (1.0 + as_large) / (1.0 + kDraws); };
  for (int draw = 0; draw < kDraws; ++draw) {
    for (Series& one : drawn) std::ranges::shuffle(one.value, random);
    if (largest(members, drawn, usual).first >= statistic) ++as_large;
    if (chance() > kMostP) return std::nullopt;  // it can only become more
  }
  FramesApart apart{.which = classes[place], .p = chance()};
  apart.frames = members[place].size();
  std::vector<bool> has(all.size());
  for (const auto& [c, k] : members[place]) has[c] = true;
  apart.captures = static_cast<std::size_t>(std::ranges::count(has, true));
  apart.range_mm = differenceOf(apart.which, all, 0), apart.gain_percent = differenceOf(apart.which, all, 1);
  return apart;
}

FoundEffect effectOf(const FramesApart& apart) {
  FoundEffect found;
  found.found.name = apart.inWords() + " differs from the others";
  found.found.covariates = {"frame"};
  found.found.numbers = {{"range_mm", apart.range_mm.mean, apart.range_mm.error},
                         {"gain_percent", apart.gain_percent.mean, apart.gain_percent.error}};
  found.found.p = apart.p;
  found.is_of_single_frames = true;
  return found;
}

}  // namespace toftwin::discover
