// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {

Traits noiseLawTraits(Column signal, Column sigma_mm) {
  auto rows = finiteRows({signal, sigma_mm}, 6, "noise law");
  if (!rows) return rows.error();
  auto &intensity = (*rows)[0], &sigma = (*rows)[1];
  if (std::ranges::min(intensity) <= 0.0 || std::ranges::min(sigma) <= 0.0)
    return undetermined("noise law", "signals and standard deviations must be positive");
  const double most = std::ranges::max(intensity), least_sigma = std::ranges::min(sigma);
  std::vector<double> log_sigma;
  for (double& one : intensity) one /= most;
  for (const double one : sigma) log_sigma.push_back(std::log(one));
  // Parameters are ln a, ln b, ln c: every part stays positive, and their intervals too.
  const Model model = [&](std::span<const double> p, std::size_t i) {
    const double x = intensity[i];
    return 0.5 * std::log(std::exp(2.0 * p[0]) + std::exp(2.0 * p[1]) / x + std::exp(2.0 * p[2]) / (x * x));
  };
  std::optional<Fit> fit;
  for (const double share : {1.0, 0.1, 0.01}) {
    const double floor = std::log(0.6 * least_sigma);
    auto tried =
        fitLeastSquares(model, log_sigma, {floor, floor + 0.5 * std::log(share), floor + std::log(share)});
    if (tried && (!fit || tried->squares < fit->squares)) fit = std::move(tried);
  }
  if (!fit) return undetermined("noise law", "a part of it does not show in this range of signals");
  std::vector<Trait> traits;
  for (const auto& [name, k] : {std::pair{"floor", 0u}, {"shot", 1u}, {"read", 2u}}) {
    Trait one = fit->trait(name, "mm", k);
    for (double* value : {&one.value, &one.low, &one.high}) *value = std::exp(*value);
    traits.push_back(std::move(one));
  }
  return traits;
}

}  // namespace toftwin::compare
