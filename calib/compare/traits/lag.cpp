// SPDX-License-Identifier: Apache-2.0
// What is left of the frames before.
#include <algorithm>
#include <cmath>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {

Traits lagTraits(Column frames_after, Column value) {
  const auto rows = finiteRows({frames_after, value}, 5, "lag");
  if (!rows) return rows.error();
  const auto &k = (*rows)[0], &y = (*rows)[1];
  if (std::ranges::min(k) < 0.0) return undetermined("lag", "frames are counted from the change of light on");
  const Model model = [&](std::span<const double> p, std::size_t i) {
    return p[0] + p[1] * std::pow(std::max(p[2], 1e-9), k[i]);
  };
  std::optional<Fit> fit;
  for (const double lambda : {0.05, 0.3, 0.8}) {
    auto tried = fitLeastSquares(model, y, {y.back(), y.front() - y.back(), lambda});
    if (tried && (!fit || tried->squares < fit->squares)) fit = std::move(tried);
  }
  if (fit) fit = fitInOrder(model, y, fit->at);
  if (!fit || !(fit->at[2] > 0.0) || !(fit->at[2] < 1.0))
    return undetermined("lag", "nothing dies away after the change");
  return std::vector{fit->trait("lag", "1", 2), fit->trait("rest", "", 0)};
}

Traits afterImageTraits(Column first, Column rest, Column before, const char* name) {
  const auto rows = finiteRows({first, rest, before}, 2, "lag");
  if (!rows) return rows.error();
  std::vector<double> shares;
  for (std::size_t i = 0; i < rows->front().size(); ++i) {
    const double change = (*rows)[2][i] - (*rows)[1][i];
    // A change of less than a tenth tells little of a share of it.
    if (std::abs(change) > 0.1 * std::abs((*rows)[1][i])) shares.push_back(((*rows)[0][i] - (*rows)[1][i]) / change);
  }
  if (shares.size() < 2) return undetermined("lag", "the light hardly changed");
  return std::vector{meanTrait(name, "1", shares)};
}

}  // namespace toftwin::compare
