// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {

Result<FittedTraits> fittedNoiseLaw(Column signal, Column sigma_mm) {
  auto rows = finiteRows({signal, sigma_mm}, 6, "noise law");
  if (!rows) return rows.error();
  auto &intensity = (*rows)[0], &sigma = (*rows)[1];
  if (std::ranges::min(intensity) <= 0.0 || std::ranges::min(sigma) <= 0.0)
    return undetermined("noise law", "signals and standard deviations must be positive");
  const double most = std::ranges::max(intensity), least_sigma = std::ranges::min(sigma);
  if (!(most > 1.05 * std::ranges::min(intensity)))
    return undetermined("noise law", "all signals are alike");
  std::vector<double> log_sigma;
  for (double& one : intensity) one /= most;
  for (const double one : sigma) log_sigma.push_back(std::log(one));
  // All three parts, else the best of two of them, else of one: a part that does not show in this range of
  // signals has no logarithm, and is not told.
  std::optional<Fit> fit;
  std::vector<int> parts;
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
        if (tried && (!fit || tried->squares < fit->squares)) fit = std::move(tried), parts = of;
      }
    }
    if (fit) break;
  }
  if (!fit) return undetermined("noise law", "a part of it does not show in this range of signals");
  constexpr std::array kParts{"floor", "shot", "read"};
  constexpr std::array kPowers{"", "/I", "/I²"};
  FittedTraits fitted;
  std::array<double, 3> at{};
  std::string terms;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const auto part = static_cast<std::size_t>(parts[k]);
    Trait one = fit->trait(kParts[part], "mm", k);
    for (double* value : {&one.value, &one.low, &one.high}) *value = std::exp(*value);
    at[part] = one.value;
    terms += fmt::format("{}{:.2g}²{}", terms.empty() ? "" : " + ", one.value, kPowers[part]);
    fitted.traits.push_back(std::move(one));
  }
  fitted.curve = {"√(" + terms + ") mm", [at, most](double of_signal) {
                    const double i = of_signal / most;
                    return std::sqrt(at[0] * at[0] + at[1] * at[1] / i + at[2] * at[2] / (i * i));
                  }};
  return fitted;
}

Traits noiseLawTraits(Column signal, Column sigma_mm) {
  auto fitted = fittedNoiseLaw(signal, sigma_mm);
  if (!fitted) return fitted.error();
  return std::move(fitted->traits);
}

}  // namespace toftwin::compare
