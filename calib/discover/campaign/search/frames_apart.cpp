// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/search/frames_apart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "calib/discover/campaign/captures/frame_values.h"
#include "calib/discover/draws.h"

namespace toftwin::discover {
namespace {

/// Residuals of four frames after a line and a mean are not alike in any order, and a few captures do not say how far
/// their sums scatter.
constexpr std::size_t kFewestFrames = 6, kFewestCaptures = 6;
constexpr std::uint64_t kMostPeriod = 16, kMostInCapture = 4;
constexpr int kDraws = 2000;
constexpr double kMostP = 0.002;
constexpr std::size_t kKinds = 2, kNumbers = 2 * kKinds;  ///< range and gain, and the size of each

struct Series {
  std::vector<std::uint64_t> sequence{};
  /// Range and gain without their mean and their straight drift, in units of their spread, then their sizes beyond
  /// those of the same place in other captures.
  std::vector<std::array<double, kNumbers>> value{};
  std::array<double, kKinds> spread{};
  std::array<std::vector<double>, kKinds> as_read{};
};

std::optional<Series> seriesOf(const MeasuredCapture& capture) {
  if (capture.each.size() < kFewestFrames) return std::nullopt;
  Series series;
  for (const FrameAlone& frame : capture.each) {
    series.sequence.push_back(frame.sequence);
    series.as_read[0].push_back(frame.range_mm), series.as_read[1].push_back(frame.gain_percent);
  }
  series.value.resize(capture.each.size());
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    const std::vector<double> left = withoutDrift(series.as_read[kind]);
    series.spread[kind] = spreadOf(left);
    for (std::size_t k = 0; k < left.size(); ++k)
      series.value[k][kind] = series.spread[kind] > 0.0 ? left[k] / series.spread[kind] : 0.0;
  }
  return series;
}

/// What wanders or bends is farthest from its mean where captures begin and end: sizes count against those of the same
/// place in captures that are as long.
void addSizes(std::vector<Series>& all) {
  std::map<std::size_t, std::vector<Series*>> as_long;
  for (Series& one : all) as_long[one.value.size()].push_back(&one);
  for (const auto& [length, group] : as_long) {
    for (std::size_t k = 0; k < length; ++k) {
      for (std::size_t kind = 0; kind < kKinds; ++kind) {
        double sum = 0.0;
        for (const Series* one : group) sum += std::abs(one->value[k][kind]);
        for (Series* one : group)
          one->value[k][kKinds + kind] = std::abs(one->value[k][kind]) - sum / static_cast<double>(group.size());
      }
    }
  }
}

/// Of those that are the same frames the first is told: where each capture begins with a multiple of a number, every
/// frame with such a one is the first of its capture.
std::vector<FrameClass> allClasses() {
  using enum FrameClass::Kind;
  std::vector<FrameClass> all;
  for (std::uint64_t place = 0; place < kMostPeriod; ++place) all.push_back({.kind = AtPlace, .rest = place});
  for (const auto& [kind, most] : {std::pair{InCapture, kMostInCapture}, {OfSource, kMostPeriod}})
    for (std::uint64_t period = 2; period <= most; ++period)
      for (std::uint64_t rest = 0; rest < period; ++rest) all.push_back({kind, period, rest});
  return all;
}

/// A class, and where its frames stand in each capture that has some: no order of their values changes it.
struct Members {
  FrameClass which{};
  std::vector<std::pair<std::size_t, std::vector<std::size_t>>> of_capture{};
  std::size_t frames = 0;
};
std::vector<Members> membersIn(const std::vector<Series>& all) {
  std::vector<Members> classes;
  for (const FrameClass& which : allClasses()) {
    Members members{which};
    for (std::size_t c = 0; c < all.size(); ++c) {
      std::vector<std::size_t> places;
      for (std::size_t k = 0; k < all[c].sequence.size(); ++k)
        if (which.has(all[c].sequence[k], k)) places.push_back(k);
      members.frames += places.size();
      if (!places.empty()) members.of_capture.emplace_back(c, std::move(places));
    }
    if (members.of_capture.size() >= kFewestCaptures) classes.push_back(std::move(members));
  }
  return classes;
}

/// The mean square of each number, which any order of the frames leaves as it is.
std::array<double, kNumbers> usualOf(const std::vector<Series>& all) {
  std::array<double, kNumbers> usual{};
  std::size_t n = 0;
  for (const Series& one : all) {
    for (const auto& value : one.value)
      for (std::size_t number = 0; number < kNumbers; ++number) usual[number] += value[number] * value[number];
    n += one.value.size();
  }
  for (double& one : usual) one /= static_cast<double>(n);
  return usual;
}

/// The class's sum in its deviations: those of frames in any order, and of a class by the source, whose frames may go
/// with those before them, no less than the sums of captures scatter. What is wrong with one place scatters as the
/// scene has it, which is no reason to doubt it.
double deviationsOf(const Members& members, const std::vector<Series>& all, std::size_t number, double usual) {
  double sum = 0.0, squares = 0.0;
  for (const auto& [c, places] : members.of_capture) {
    double of_capture = 0.0;
    for (const std::size_t k : places) of_capture += all[c].value[k][number];
    sum += of_capture, squares += of_capture * of_capture;
  }
  const auto n = static_cast<double>(members.of_capture.size());
  const double in_any_order = usual * static_cast<double>(members.frames);
  const double scatter = (squares - sum * sum / n) * n / (n - 1.0);
  const bool is_of_source = members.which.kind == FrameClass::Kind::OfSource;
  return sum / std::sqrt(is_of_source ? std::max(in_any_order, scatter) : in_any_order);
}

/// The largest of all classes, and its place among them. Sizes, for what is now more, now less, as the scene has it,
/// tell of classes by the source alone: they are beyond those of the same place.
std::pair<double, std::size_t> largest(const std::vector<Members>& classes, const std::vector<Series>& all,
                                       const std::array<double, kNumbers>& usual) {
  std::pair<double, std::size_t> best{0.0, 0};
  for (std::size_t i = 0; i < classes.size(); ++i) {
    const bool has_sizes = classes[i].which.kind == FrameClass::Kind::OfSource;
    for (std::size_t number = 0; number < (has_sizes ? kNumbers : kKinds); ++number) {
      if (!(usual[number] > 0.0)) continue;
      const double by = deviationsOf(classes[i], all, number, usual[number]);
      if (const double most = number < kKinds ? std::abs(by) : by; most > best.first) best = {most, i};
    }
  }
  return best;
}

/// Frames of one capture, in the class or not: their means, and how what they read goes with their place.
struct Alike {
  double n = 0.0, place = 0.0, value = 0.0, places = 0.0, products = 0.0;

  void add(std::size_t k, double read) {
    const auto at = static_cast<double>(k);
    n += 1.0, place += at, value += read, places += at * at, products += at * read;
  }
  [[nodiscard]] double spreadOfPlaces() const { return n > 0.0 ? places - place * place / n : 0.0; }
  [[nodiscard]] double withPlace() const { return n > 0.0 ? products - place * value / n : 0.0; }
};

/// What the first have more than the others beside a straight drift of both (least squares): where the class is its
/// capture's first frame, a drift that were taken off all of them would have a share of it.
double differenceOf(const Alike& in, const Alike& out) {
  const double drift = (in.withPlace() + out.withPlace()) / (in.spreadOfPlaces() + out.spreadOfPlaces());
  return in.value / in.n - out.value / out.n - drift * (in.place / in.n - out.place / out.n);
}

/// Over all captures, which count by their spread.
std::optional<Difference> meanDifference(const FrameClass& which, const std::vector<Series>& all, std::size_t kind) {
  std::vector<std::pair<double, double>> each;  // difference, weight
  for (const Series& one : all) {
    Alike in, out;
    for (std::size_t k = 0; k < one.sequence.size(); ++k)
      (which.has(one.sequence[k], k) ? in : out).add(k, one.as_read[kind][k]);
    if (in.n == 0.0 || out.n == 0.0 || !(one.spread[kind] > 0.0)) continue;
    const double weight = 1.0 / (one.spread[kind] * one.spread[kind] * (1.0 / in.n + 1.0 / out.n));
    each.emplace_back(differenceOf(in, out), weight);
  }
  if (each.size() < 2) return std::nullopt;
  return weightedMean(each);
}

std::string ordinal(std::uint64_t number) {
  const std::uint64_t last = number % 10;
  const bool is_teen = number % 100 / 10 == 1;
  const char* ending = is_teen || last == 0 || last > 3 ? "th" : last == 1 ? "st" : last == 2 ? "nd" : "rd";
  return fmt::format("{}{}", number, ending);
}

}  // namespace

std::string FramesApart::inWords() const {
  const std::string from = ordinal(which.rest + 1), period = ordinal(which.period);
  switch (which.kind) {
    case FrameClass::Kind::AtPlace:
      return fmt::format("the {} frame of each capture", from);
    case FrameClass::Kind::InCapture:
      return fmt::format("every {} frame of each capture, from the {} on", period, from);
    case FrameClass::Kind::OfSource:
      break;
  }
  return fmt::format("every {} frame", period);
}

std::optional<FramesApart> framesApart(const std::vector<MeasuredCapture>& captures, std::uint64_t seed) {
  std::vector<Series> all;
  for (const MeasuredCapture& capture : captures)
    if (auto series = seriesOf(capture)) all.push_back(*std::move(series));
  if (all.size() < kFewestCaptures) return std::nullopt;
  addSizes(all);
  const std::vector<Members> classes = membersIn(all);
  const auto usual = usualOf(all);
  const auto [statistic, place] = largest(classes, all, usual);
  Draws draws{seed};
  std::vector<Series> drawn = all;
  int as_large = 0;
  const auto chance = [&] { return (1.0 + as_large) / (1.0 + kDraws); };
  for (int draw = 0; draw < kDraws; ++draw) {
    for (Series& one : drawn) draws.shuffle(one.value);
    if (largest(classes, drawn, usual).first >= statistic) ++as_large;
    if (chance() > kMostP) return std::nullopt;  // it can only become more
  }
  const Members& members = classes[place];
  return FramesApart{.which = members.which,
                     .frames = members.frames,
                     .captures = members.of_capture.size(),
                     .range_mm = meanDifference(members.which, all, 0),
                     .gain_percent = meanDifference(members.which, all, 1),
                     .p = chance()};
}

FoundEffect effectOf(const FramesApart& apart) {
  FoundEffect found;
  found.found.name = apart.inWords() + " differs from the others";
  found.found.covariates = {"frame"};
  if (const auto& by = apart.range_mm) found.found.numbers.push_back({"range_mm", by->mean, by->error});
  if (const auto& by = apart.gain_percent) found.found.numbers.push_back({"gain_percent", by->mean, by->error});
  found.found.p = apart.p;
  found.is_of_single_frames = true;
  return found;
}

}  // namespace toftwin::discover
