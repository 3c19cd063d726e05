// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/special_functions/digamma.hpp>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <toftwin/units.h>

#include "calib/compare/fits.h"
#include "calib/compare/statistics.h"
#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {
namespace {

constexpr std::size_t kFewestOfLaw = 6;
/// Up to this noise s of a phase σ goes as 1/amplitude. A phasor with normal noise on both of its parts has a
/// phase that scatters by s²/2 of s more, 0.5 % there, and a mean amplitude that is as much too large; by 12
/// % more at 1 rad, and by π/√3 = 1.81 rad however little light there is (S. O. Rice, Bell Syst. Tech. J. 27
/// (1948) 109). With several frequencies (2 : 10 : 15, 3 : 4) the nearest wrong period is six times as far.
constexpr double kMostPhase_rad = 0.1;

/// That noise as one of the range, of the best of decoders, r = Σ w_f c φ_f/4πf with w_f as f²: by any other,
/// the same noise of the range is of less noisy phases. Infinite where no frequency is known.
double mostSigma_mm(std::span<const double> frequency_hz) {
  double squares = 0.0;
  for (const double f : frequency_hz) squares += f * f;
  return 1e3 * kMostPhase_rad * kSpeedOfLight_m_per_s / (4.0 * std::numbers::pi * std::sqrt(squares));
}

/// All three parts, else the best of two of them, else of one: a part that does not show in this range of
/// signals has no logarithm, and is not told.
struct Law {
  std::vector<int> parts{};  ///< powers of 1/I, ascending
  Fit fit{};                 ///< of their roots' logarithms

  [[nodiscard]] double logarithm(double intensity) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < parts.size(); ++k) sum += std::exp(2.0 * fit.at[k]) / std::pow(intensity, parts[k]);
    return 0.5 * std::log(sum);
  }
};
std::optional<Law> fittedLaw(Column intensity, Column sigma) {
  const double least_sigma = std::ranges::min(sigma);
  std::vector<double> log_sigma;
  for (const double one : sigma) log_sigma.push_back(std::log(one));
  std::optional<Law> law;
  for (const auto& tried_parts :
       {std::vector<std::vector<int>>{{0, 1, 2}}, {{0, 1}, {0, 2}, {1, 2}}, {{0}, {1}, {2}}}) {
    for (const std::vector<int>& of : tried_parts) {
      // Parameters are logarithms: every part stays positive, and so does its interval.
      const Model model = [&](std::span<const double> p, std::size_t i) {
        double sum = 0.0;
        for (std::size_t k = 0; k < of.size(); ++k)
          sum += std::exp(2.0 * p[k]) / std::pow(intensity[i], of[k]);
        return 0.5 * std::log(sum);
      };
      for (const double share : {1.0, 0.1, 0.01}) {
        std::vector<double> start;
        for (const int part : of) start.push_back(std::log(0.6 * least_sigma) + 0.5 * part * std::log(share));
        auto tried = fitLeastSquares(model, log_sigma, start);
        if (tried && (!law || tried->squares < law->fit.squares)) law = Law{of, *std::move(tried)};
      }
    }
    if (law) break;
  }
  return law;
}

double quartilesApart(double readings) {
  const boost::math::chi_squared squares{readings};
  return 0.5 * std::log(boost::math::quantile(squares, 0.75) / boost::math::quantile(squares, 0.25));
}

/// By how much ln s of so many degrees of freedom is less than ln σ on the mean: ½ (ln ν/2 − ψ(ν/2)), ν that of which
/// the quartiles are so far apart. Two readings scatter most.
double shortBy(double apart) {
  constexpr double kFewest = 1.0, kMost = 1e5;
  constexpr int kHalvings = 60;
  double low = std::log(kFewest), high = std::log(kMost);
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (quartilesApart(std::exp(middle)) > apart ? low : high) = middle;
  }
  const double half = 0.5 * std::exp(high);
  return 0.5 * (std::log(half) - boost::math::digamma(half));
}

/// How likely it is that rows are off as ln s of few readings is, which lie farther below than above, and not evenly
/// about the law: by the likelihoods of ½ ln χ² and of a normal distribution, each with its best place and width, and
/// as likely beforehand.
double shareOfReadings(Column left) {
  const double n = static_cast<double>(left.size());
  const auto meanOf = [&](auto&& of) {
    double sum = 0.0;
    for (const double one : left) sum += of(one) / n;
    return sum;
  };
  const double mean = meanOf([](double one) { return one; }),
               square = meanOf([](double one) { return std::exp(2.0 * one); }),
               variance = meanOf([=](double one) { return (one - mean) * (one - mean); });
  // Its best σ² is the mean of s²: Σ (s/σ)² is n.
  const auto ofReadings = [=](double log_degrees) {
    const double half = 0.5 * std::exp(log_degrees);
    return -n * (std::numbers::ln2 + half * std::log(half) - std::lgamma(half) +
                 2.0 * half * (mean - 0.5 * std::log(square)) - half);
  };
  const double readings = ofReadings(minimum1d(ofReadings, 0.0, std::log(1e4))),
               evenly = 0.5 * n * (std::log(2.0 * std::numbers::pi * variance) + 1.0);
  return 1.0 / (1.0 + std::exp(readings - evenly));
}

/// What of ln σ rows are short on the mean, and how uncertain that is.
struct Short {
  double by = 0.0, variance = 0.0;
};
/// Of s of few readings, as far as rows look like that. By the quartiles of what they are off from the law, which a
/// few odd rows do not move; of normal numbers their distance is known to 1.17/√n of itself.
Short shortOfLogarithm(Column intensity, Column sigma, const Law& law) {
  std::vector<double> left;
  for (std::size_t i = 0; i < sigma.size(); ++i) left.push_back(std::log(sigma[i]) - law.logarithm(intensity[i]));
  const double n = static_cast<double>(sigma.size()), low = quantile(left, 0.25), high = quantile(left, 0.75),
               apart = (high - low) * std::sqrt(n / std::max(1.0, law.fit.degrees)),
               known = std::exp(1.17 / std::sqrt(n));
  constexpr double kFarOut = 3.0;  // J. W. Tukey, Exploratory Data Analysis, 1977
  std::erase_if(left, [=](double one) {
    return one < low - kFarOut * (high - low) || one > high + kFarOut * (high - low);
  });
  if (!(high > low)) return {};
  const double by = shortBy(apart), by_quartiles = 0.5 * (shortBy(apart * known) - shortBy(apart / known)),
               share = shareOfReadings(left);
  return {share * by, share * by_quartiles * by_quartiles + share * (1.0 - share) * by * by};
}

/// All three parts, each of which may be less than nothing: what is told of one of them is then told whether
/// or not the others are there, and of one that is not there 0 is in the interval. From the law on; nothing
/// where the signals do not tell the parts apart. In units of the least σ².
std::optional<Fit> signedParts(Column intensity, Column sigma, const Law& law) {
  const double least = std::pow(std::ranges::min(sigma), 2);
  std::vector<double> log_sigma, start(3, 0.0);
  for (const double one : sigma) log_sigma.push_back(std::log(one));
  for (std::size_t k = 0; k < law.parts.size(); ++k)
    start[static_cast<std::size_t>(law.parts[k])] = std::exp(2.0 * law.fit.at[k]) / least;
  const Model model = [=](std::span<const double> p, std::size_t i) {
    const double x = intensity[i];
    return 0.5 * std::log(least * (p[0] + p[1] / x + p[2] / (x * x)));
  };
  return fitInOrder(model, log_sigma, start, intensity);
}

/// Parts of σ² that are as uncertain, too, as ln σ is altogether.
void addVarianceOfLogarithm(Fit& parts, double variance) {
  const std::size_t k = parts.at.size();
  const auto add = [&](std::vector<double>& covariance) {
    for (std::size_t a = 0; a < k; ++a)
      for (std::size_t b = 0; b < k; ++b) covariance[a * k + b] += 4.0 * variance * parts.at[a] * parts.at[b];
  };
  add(parts.covariance);
  for (Fit::Possible& one : parts.possible) add(one.covariance);
}

/// The root of a part of the variance. Where its interval holds 0, the part does not show: 0, up to what it
/// may be.
Trait partOf(const Fit& parts, const char* name, std::size_t part, double scale) {
  Trait one = parts.trait(name, "mm", part, scale);
  const double half = one.high - one.value;
  if (one.low <= 0.0) one.value = one.low = 0.0;
  if (one.high <= 0.0) one.high = half;  // it came out far below 0: no more is known than how well it is
  for (double* value : {&one.value, &one.low, &one.high}) *value = std::sqrt(*value);
  return one;
}

/// σ at the largest signal: parts of which one stands in for another make the same of it.
Trait wholeOf(const Fit& parts, double scale, double most) {
  LawAtSignal law{.at = {.most = most}, .degrees = parts.degrees};
  double variance = 0.0;
  for (std::size_t i = 0; i < law.parts.size(); ++i) {
    law.parts[i] = scale * parts.at[i], variance += law.parts[i];
    for (std::size_t j = 0; j < law.parts.size(); ++j) {
      std::array<double, 3> both{}, first{}, second{};
      first[i] = second[j] = 1.0, both[i] += 1.0, both[j] += 1.0;
      law.covariance[3 * i + j] =
          0.5 * scale * scale *
          (parts.varianceOf(both, 0) - parts.varianceOf(first, 0) - parts.varianceOf(second, 0));
    }
  }
  const std::array all{1.0, 1.0, 1.0};
  const double half = studentT(parts.degrees) * scale * std::sqrt(parts.varianceOf(all, 0));
  Trait whole{.name = kWholeLaw, .unit = "mm", .n = parts.n};
  tellRoot(whole, variance, half);
  whole.refers_to = law;
  return whole;
}

/// Of rows that are finite and positive.
Result<FittedTraits> describedLaw(std::vector<double> intensity, std::vector<double> sigma) {
  const double most = std::ranges::max(intensity);
  if (!(most > 1.05 * std::ranges::min(intensity))) return undetermined("noise law", "all signals are alike");
  for (double& one : intensity) one /= most;
  auto law = fittedLaw(intensity, sigma);
  const Short rows = law ? shortOfLogarithm(intensity, sigma, *law) : Short{};
  if (law) {
    for (double& one : sigma) one *= std::exp(rows.by);
    for (double& one : law->fit.at) one += rows.by;
  }
  auto all = law ? signedParts(intensity, sigma, *law) : std::nullopt;
  if (all) addVarianceOfLogarithm(*all, rows.variance);
  if (!all) return undetermined("noise law", "this range of signals does not tell its parts apart");
  constexpr std::array kPowers{"", "/I", "/I²"};
  FittedTraits fitted;
  std::array<double, 3> at{};
  std::string terms;
  for (std::size_t k = 0; k < law->parts.size(); ++k) {
    const auto part = static_cast<std::size_t>(law->parts[k]);
    at[part] = std::exp(law->fit.at[k]);
    terms += fmt::format("{}{:.2g}²{}", terms.empty() ? "" : " + ", at[part], kPowers[part]);
  }
  for (std::size_t part = 0; part < kLawParts.size(); ++part) {
    Trait one = partOf(*all, kLawParts[part], part, std::pow(std::ranges::min(sigma), 2));
    if (part > 0) one.refers_to = AtSignal{.most = most, .power = 0.5 * static_cast<double>(part)};
    fitted.traits.push_back(std::move(one));
  }
  fitted.traits.push_back(wholeOf(*all, std::pow(std::ranges::min(sigma), 2), most));
  fitted.curve = {"√(" + terms + ") mm", [at, most](double of_signal) {
                    const double i = of_signal / most;
                    return std::sqrt(at[0] * at[0] + at[1] * at[1] / i + at[2] * at[2] / (i * i));
                  }};
  return fitted;
}

/// Rows at which this noise is expected to go as 1/amplitude.
struct Kept {
  std::vector<double> intensity{}, sigma{};
  std::string left_out{};  ///< which are not among them, and why; empty: none

  Kept(Column of_intensity, Column of_sigma, Column expected_mm, double most_mm) {
    double up_to = 0.0;
    for (std::size_t i = 0; i < of_intensity.size(); ++i) {
      if (expected_mm[i] <= most_mm)
        intensity.push_back(of_intensity[i]), sigma.push_back(of_sigma[i]);
      else
        up_to = std::max(up_to, of_intensity[i]);
    }
    if (intensity.size() == of_intensity.size()) return;
    left_out = fmt::format(
        "{} of {} rows are left out, of signals up to {:.2g} of the largest: there the phase's noise is over "
        "{} "
        "rad, {:.3g} mm of range, and no longer goes as 1/amplitude",
        of_intensity.size() - intensity.size(), of_intensity.size(), up_to / std::ranges::max(of_intensity),
        kMostPhase_rad, most_mm);
  }
};

}  // namespace

Result<FittedTraits> fittedNoiseLaw(Column signal, Column sigma_mm, std::span<const double> frequency_hz) {
  auto rows = finiteRows({signal, sigma_mm}, kFewestOfLaw, "noise law");
  if (!rows) return rows.error();
  const auto &intensity = (*rows)[0], &sigma = (*rows)[1];
  if (std::ranges::min(intensity) <= 0.0 || std::ranges::min(sigma) <= 0.0)
    return undetermined("noise law", "signals and standard deviations must be positive");
  // Rows are chosen by what the law has at their signal: a choice by what each shows would shift it. The
  // first law can only be of those that show little.
  constexpr int kRounds = 20;
  const double most_mm = mostSigma_mm(frequency_hz);
  std::vector<double> expected_mm = sigma;
  for (int round = 1;; ++round) {
    const Kept kept{intensity, sigma, expected_mm, most_mm};
    if (kept.sigma.size() < kFewestOfLaw)
      return undetermined("noise law",
                          fmt::format("it takes {}, and {}", kFewestOfLaw, kept.left_out).c_str());
    auto fitted = describedLaw(kept.intensity, kept.sigma);
    if (!fitted) return fitted;
    fitted->not_told = kept.left_out;
    bool is_settled = true;
    for (std::size_t i = 0; i < intensity.size(); ++i) {
      const double now_mm = fitted->curve.at(intensity[i]);
      is_settled = is_settled && (now_mm <= most_mm) == (expected_mm[i] <= most_mm);
      expected_mm[i] = now_mm;
    }
    if (is_settled || round == kRounds) return fitted;
  }
}

Traits noiseLawTraits(Column signal, Column sigma_mm, std::span<const double> frequency_hz) {
  auto fitted = fittedNoiseLaw(signal, sigma_mm, frequency_hz);
  if (!fitted) return fitted.error();
  return std::move(fitted->traits);
}

}  // namespace toftwin::compare
