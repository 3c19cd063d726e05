// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/common_reference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>
#include <variant>

#include <fmt/format.h>

#include "calib/compare/traits/difference.h"
#include "calib/compare/traits/least_squares.h"
#include "calib/compare/traits/phasor.h"

namespace toftwin::compare {
namespace {

Trait toldAt(const Trait& one, const OnLine& line, double to_m) {
  const double by_m = to_m - line.at_m;
  const double variance = line.variance + 2.0 * by_m * line.covariance + by_m * by_m * line.slope_variance;
  Trait moved = one;
  moved.value += line.slope * by_m;
  const double half = studentT(line.degrees) * std::sqrt(std::max(0.0, variance));
  moved.low = moved.value - half, moved.high = moved.value + half;
  return moved;
}

/// B's less A's, of lines that are known apart from each other.
OnLine lessOf(const OnLine& of_b, const OnLine& of_a, double from_m, double to_m) {
  const double at_m = 0.5 * (from_m + to_m);
  const auto varianceAt = [at_m](const OnLine& line) {
    const double by_m = at_m - line.at_m;
    return line.variance + 2.0 * by_m * line.covariance + by_m * by_m * line.slope_variance;
  };
  const auto covarianceAt = [at_m](const OnLine& line) {
    return line.covariance + (at_m - line.at_m) * line.slope_variance;
  };
  return {.at_m = at_m,
          .from_m = from_m,
          .to_m = to_m,
          .slope = of_b.slope - of_a.slope,
          .variance = varianceAt(of_a) + varianceAt(of_b),
          .slope_variance = of_a.slope_variance + of_b.slope_variance,
          .covariance = covarianceAt(of_a) + covarianceAt(of_b),
          .degrees = std::min(of_a.degrees, of_b.degrees)};
}

HeldTogether heldAt(const Trait& a, const OnLine& of_a, const Trait& b, const OnLine& of_b, double wider) {
  const double from_m = std::max(of_a.from_m, of_b.from_m), to_m = std::min(of_a.to_m, of_b.to_m);
  if (!(from_m <= to_m)) {
    return {.why_not = fmt::format(
                "the distances of A, {:.3g} to {:.3g} m, and of B, {:.3g} to {:.3g} m, have none in "
                "common",
                of_a.from_m, of_a.to_m, of_b.from_m, of_b.to_m)};
  }
  const OnLine line = lessOf(of_b, of_a, from_m, to_m);
  return {.difference = differenceOf(toldAt(a, of_a, line.at_m), toldAt(b, of_b, line.at_m), wider),
          .line = line,
          .at = placeInWords(line.at_m)};
}

HeldTogether heldAt(const Trait& a, const WaveParts& of_a, const Trait& b, const WaveParts& of_b,
                    double wider) {
  const double first = of_a.sigma * of_a.sigma, second = of_b.sigma * of_b.sigma, both = first + second;
  // Satterthwaite's, of a sum of two variances.
  const double degrees = both > 0.0
                             ? both * both / (first * first / of_a.degrees + second * second / of_b.degrees)
                             : std::min(of_a.degrees, of_b.degrees);
  const WaveParts less{of_b.cosine - of_a.cosine, of_b.sine - of_a.sine, std::sqrt(both), degrees};
  Trait wave = amplitudeOf(less, wider);
  wave.name = b.name, wave.n = std::min(a.n, b.n);
  return {.difference = std::move(wave), .is_size = true};
}

Trait toldAt(Trait one, const AtSignal& of, double signal) {
  const double times = std::pow(of.most / signal, of.power);
  one.value *= times, one.low *= times, one.high *= times;
  return one;
}

/// "at a signal of 2.78", "at the signal of capture 64", "at 0.5 times the signal of capture 64".
std::string signalInWords(double signal, const std::string& unit) {
  const std::string shown = fmt::format("{:.3g}", signal);
  if (unit.empty()) return "at a signal of " + shown;
  return shown == "1" ? "at " + unit : fmt::format("at {} times {}", shown, unit);
}

HeldTogether heldAt(const Trait& a, const AtSignal& of_a, const Trait& b, const AtSignal& of_b,
                    double wider) {
  const double signal = std::min(of_a.most, of_b.most);
  if (!(signal > 0.0))
    return {.why_not = "A and B have no capture in common by which their signals are compared"};
  return {.difference = differenceOf(toldAt(a, of_a, signal), toldAt(b, of_b, signal), wider),
          .at = signalInWords(signal, of_b.unit)};
}

/// The law at that signal.
Trait toldAt(const Trait& one, const LawAtSignal& law, double signal) {
  const double x = law.at.most / signal;
  const std::array along{1.0, x, x * x};
  double variance = 0.0, of_variance = 0.0;
  for (std::size_t i = 0; i < along.size(); ++i) {
    variance += along[i] * law.parts[i];
    for (std::size_t j = 0; j < along.size(); ++j) of_variance += along[i] * along[j] * law.covariance[3 * i + j];
  }
  const double half = studentT(law.degrees) * std::sqrt(std::max(0.0, of_variance));
  Trait told = one;
  tellRoot(told, variance, half);
  return told;
}

HeldTogether heldAt(const Trait& a, const LawAtSignal& of_a, const Trait& b, const LawAtSignal& of_b,
                    double wider) {
  const double signal = std::min(of_a.at.most, of_b.at.most);
  if (!(signal > 0.0)) return heldAt(a, of_a.at, b, of_b.at, wider);
  return {.difference = differenceOf(toldAt(a, of_a, signal), toldAt(b, of_b, signal), wider),
          .at = signalInWords(signal, of_b.at.unit)};
}

/// Spans that differ by less are one: a drift goes on by no more of itself there, unless it is over long
/// before.
constexpr double kSameSpan = 0.01;

HeldTogether heldAt(const Trait& a, const OverSpan& of_a, const Trait& b, const OverSpan& of_b,
                    double wider) {
  const double longer_s = std::max(of_a.length_s, of_b.length_s);
  if (std::abs(of_a.length_s - of_b.length_s) <= kSameSpan * longer_s)
    return {.difference = differenceOf(a, b, wider)};
  return {.why_not = fmt::format("A's rows are over {:.4g} s and B's over {:.4g} s, and a drift goes on",
                                 of_a.length_s, of_b.length_s)};
}

}  // namespace

const AtSignal* signalOf(const Trait& trait) {
  const auto* law = std::get_if<LawAtSignal>(&trait.refers_to);
  return law != nullptr ? &law->at : std::get_if<AtSignal>(&trait.refers_to);
}
AtSignal* signalOf(Trait& trait) {
  auto* law = std::get_if<LawAtSignal>(&trait.refers_to);
  return law != nullptr ? &law->at : std::get_if<AtSignal>(&trait.refers_to);
}

std::string placeInWords(double at_m) { return fmt::format("at {:.3g} m", at_m); }

bool goesThroughNothing(double value, const OnLine& line, double wider) {
  const double at_0 = value - line.slope * line.at_m;
  const double variance =
      line.variance - 2.0 * line.at_m * line.covariance + line.at_m * line.at_m * line.slope_variance;
  return std::abs(at_0) <= wider * studentT(line.degrees) * std::sqrt(std::max(0.0, variance));
}

HeldTogether heldTogether(const Trait& first, const Trait& second, double wider) {
  return std::visit(
      [&]<class A, class B>([[maybe_unused]] const A& of_first,
                            [[maybe_unused]] const B& of_second) -> HeldTogether {
        if constexpr (std::is_same_v<A, B> && !std::is_same_v<A, std::monostate>)
          return heldAt(first, of_first, second, of_second, wider);
        return {.difference = differenceOf(first, second, wider)};
      },
      first.refers_to, second.refers_to);
}

}  // namespace toftwin::compare
