// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/rows/told_apart.h"

#include <utility>

namespace toftwin::discover {

NormalEquations normalEquationsOf(const Marginal& marginal, std::size_t free) {
  Columns others;
  for (Eigen::Index i = 0; i < marginal.moment.size() - static_cast<Eigen::Index>(free); ++i)
    others.push_back(i);
  NormalEquations all;
  all.others = fit(marginal, others);
  all.deviance = all.others.deviance, all.freedom = all.others.freedom;
  const auto n = static_cast<Eigen::Index>(free);
  const Eigen::MatrixXd cross = marginal.gram(others, Eigen::lastN(n));
  all.others_by_free = all.others.inverse * cross;
  all.gram = marginal.gram.bottomRightCorner(n, n) - cross.transpose() * all.others_by_free;
  all.moment = marginal.moment.tail(n) - cross.transpose() * all.others.inverse * marginal.moment(others);
  all.own = marginal.gram.diagonal().tail(n);
  return all;
}

ToldApart toldApart(const std::vector<FreeNumber>& free, const NormalEquations& at,
                    const std::function<bool(const FreeNumber&)>& stays) {
  constexpr double kLeast = 1e-4;  // of a column's square
  ToldApart apart;
  std::vector<Eigen::Index> rows, others;
  for (std::size_t i = 0; i < free.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    double left = at.gram(row, row);
    if (!rows.empty()) {
      const Eigen::VectorXd cross = at.gram(rows, row);
      left -= cross.dot(pseudoInverse(at.gram(rows, rows), 1e-9).inverse * cross);
    }
    if (!(at.own[row] > 0.0)) continue;
    (left > kLeast * at.own[row] && !stays(free[i]) ? rows : others).push_back(row);
  }
  for (const Eigen::Index row : rows) apart.kept.push_back(free[static_cast<std::size_t>(row)]);
  const Eigen::MatrixXd inverse = pseudoInverse(at.gram(rows, rows), 1e-9).inverse;
  for (const Eigen::Index row : others) {
    Untold one{free[static_cast<std::size_t>(row)], -inverse * at.gram(rows, row)};
    for (std::size_t i = 0; i < apart.kept.size(); ++i)
      one.change[static_cast<Eigen::Index>(i)] *= apart.kept[i].step / one.number.step;
    apart.untold.push_back(std::move(one));
  }
  return apart;
}

}  // namespace toftwin::discover
