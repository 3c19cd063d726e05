// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/odd_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "calib/compare/traits/uneven.h"
#include "calib/linear/linear.h"

namespace toftwin::compare {
namespace {

using Eigen::Index;

constexpr Index kFewestFree = 12;
/// More of them are no slips, but how rows scatter.
constexpr Index kMost = 5, kRowsForEach = 20;

/// A row that was taken out, and what is left then.
struct Odd {
  Index row = 0;
  double gain = 0.0;      ///< by how much Σ r² is less without it
  double variance = 0.0;  ///< of the others
  double chance = 0.0;    ///< so many of their standard deviations may be chance
  bool is_beyond_chance = false;
};

/// Rows that were not taken out yet, as least squares leave them.
class Others {
 public:
  Others(MatrixXd jacobian, VectorXd left) : jacobian_{std::move(jacobian)}, left_{std::move(left)} {
    for (Index i = 0; i < left_.size(); ++i) rows_.push_back(i);
  }

  [[nodiscard]] Index free() const { return left_.size() - jacobian_.cols(); }
  [[nodiscard]] double squares() {
    left_ -= (jacobian_ * linear::leastSquares(jacobian_, left_)).eval();
    return left_.squaredNorm();
  }
  /// The oddest one, which is taken out.
  Odd takeOddest() {
    const double all = squares(), free_of_others = static_cast<double>(free() - 1);
    const MatrixXd basis = linear::basisOf(jacobian_);
    double most = 0.0;
    Index odd = 0;
    for (Index i = 0; i < left_.size(); ++i) {
      const double own = 1.0 - basis.row(i).squaredNorm();  // what the row does not tell of itself
      if (own < kTold) continue;
      const double gain = left_[i] * left_[i] / own;
      if (gain > most) most = gain, odd = i;
    }
    Odd one{.row = rows_[static_cast<std::size_t>(odd)],
            .gain = most,
            .variance = std::max(0.0, all - most) / free_of_others};
    one.chance = studentT(free_of_others, 1.0 - kWrong / static_cast<double>(left_.size()));
    one.is_beyond_chance = most > one.chance * one.chance * one.variance;
    leaveOut(odd);
    return one;
  }

 private:
  static constexpr double kWrong = 1e-3, kTold = 1e-6;

  void leaveOut(Index odd) {
    const Index after = left_.size() - 1 - odd;
    MatrixXd jacobian(left_.size() - 1, jacobian_.cols());
    jacobian << jacobian_.topRows(odd), jacobian_.bottomRows(after);
    VectorXd left(left_.size() - 1);
    left << left_.head(odd), left_.tail(after);
    jacobian_ = std::move(jacobian), left_ = std::move(left);
    rows_.erase(rows_.begin() + odd);
  }

  MatrixXd jacobian_;
  VectorXd left_;
  std::vector<Index> rows_{};
};

struct BeyondChance {
  std::vector<Odd> odd{};
  bool are_more = false;  ///< the next one would be, too
};

/// Rows beyond chance, the oddest first: of so many taken out one after the other, as an odd one may hide
/// behind another, up to the last that is.
BeyondChance beyondChance(const MatrixXd& jacobian, const VectorXd& left) {
  constexpr double kShare = 0.1, kOfEach = 0.01;  // of Σ r²
  Others others{jacobian, left};
  const double all = others.squares();
  const Index most = std::clamp<Index>(left.size() / kRowsForEach, 1, kMost);
  const auto isOdd = [&](const Odd& last) {
    return last.is_beyond_chance && last.gain > kOfEach * all && others.squares() < (1.0 - kShare) * all;
  };
  BeyondChance found;
  std::vector<Odd>& taken = found.odd;
  std::size_t odd = 0;
  for (Index i = 0; i < most && others.free() > kFewestFree; ++i) {
    taken.push_back(others.takeOddest());
    if (isOdd(taken.back())) odd = taken.size();
  }
  taken.resize(odd);
  if (static_cast<Index>(odd) == most && others.free() > kFewestFree) found.are_more = isOdd(others.takeOddest());
  return found;
}

/// What a fit of the rows that are not odd leaves of them, and what they go with.
struct Rest {
  std::vector<Index> rows{};
  std::vector<double> at{};
  VectorXd off{};

  Rest(const std::vector<Odd>& odd, const MatrixXd& jacobian, const VectorXd& left, Column x) {
    for (Index i = 0; i < left.size(); ++i) {
      if (std::ranges::find(odd, i, &Odd::row) != odd.end()) continue;
      rows.push_back(i), at.push_back(x[static_cast<std::size_t>(i)]);
    }
    const MatrixXd others = jacobian(rows, Eigen::all);
    off = left(rows);
    off -= (others * linear::leastSquares(others, off)).eval();
  }
  /// Those nearest to a place.
  [[nodiscard]] std::vector<Index> near(double place, std::size_t count) const {
    std::vector<Index> order(rows.size());
    std::iota(order.begin(), order.end(), Index{0});
    const auto away = [&](Index i) { return std::abs(at[static_cast<std::size_t>(i)] - place); };
    std::ranges::partial_sort(order, order.begin() + static_cast<std::ptrdiff_t>(count), {}, away);
    order.resize(count);
    return order;
  }
};

/// Whether fewer than four rows are farther along, or before it: how rows scatter there is known from one side only.
bool isAtAnEnd(Column x, Index row) {
  constexpr std::ptrdiff_t kFewest = 4;
  const double at = x[static_cast<std::size_t>(row)];
  const auto before = std::ranges::count_if(x, [at](double one) { return one <= at; }) - 1,
             after = std::ranges::count_if(x, [at](double one) { return one >= at; }) - 1;
  return std::min(before, after) < kFewest;
}

/// Those that are odd among their neighbours, too: where these scatter more than rows elsewhere, the row may
/// be as they are. At an end it may be of those that scatter still more, as at the edge of a corner.
std::vector<Odd> oddAmongNeighbours(std::vector<Odd> odd, const Rest& rest, Column x) {
  constexpr std::size_t kNeighbours = 8;  // fewer than there are rows, as kFewestFree are to spare
  constexpr double kFarther = 1.2;        // σ of so few is known by a quarter
  constexpr double kFarthest = 2.5;       // σ of 8, 5.3, 3.8, 2.9, … mm: the first one is 2.4 times the next eight's
  std::erase_if(odd, [&](const Odd& one) {
    const VectorXd near = rest.off(rest.near(x[static_cast<std::size_t>(one.row)], kNeighbours));
    const double farther = isAtAnEnd(x, one.row) ? kFarthest : kFarther;
    return one.gain <= std::pow(farther * one.chance, 2) * near.squaredNorm() / static_cast<double>(kNeighbours);
  });
  return odd;
}

/// σ of every row by how the rest scatters; an odd one has that of the nearest of them. Empty: evenly.
std::vector<double> sigmasBeside(const std::vector<Odd>& odd, const Rest& rest, Column x,
                                 std::size_t parameters) {
  const auto sigmas = unevenSigmas({rest.off.data(), rest.rows.size()}, rest.at, parameters);
  if (sigmas.empty()) return {};
  std::vector<double> all(x.size());
  for (std::size_t k = 0; k < rest.rows.size(); ++k) all[static_cast<std::size_t>(rest.rows[k])] = sigmas[k];
  for (const Odd& one : odd) {
    const auto row = static_cast<std::size_t>(one.row);
    all[row] = sigmas[static_cast<std::size_t>(rest.near(x[row], 1).front())];
  }
  return all;
}

OddRows named(const std::vector<Odd>& odd, bool are_more, Index of) {
  OddRows all;
  double least = odd.front().gain;
  std::vector<std::size_t> numbers;  // as a person counts them
  for (const Odd& one : odd) all.rows.push_back(static_cast<std::size_t>(one.row)), least = std::min(least, one.gain);
  std::ranges::sort(all.rows);
  for (const std::size_t row : all.rows) numbers.push_back(row + 1);
  const double times = std::sqrt(least / std::max(odd.back().variance, 1e-300));
  const bool is_one = numbers.size() == 1;
  all.doubt = fmt::format(
      "{} {} of {} {} {}{:.3g} times as far off as the others scatter, and in all numbers, which may be "
      "others without {}{}",
      is_one ? "row" : "rows", fmt::join(numbers, ", "), of, is_one ? "is" : "are", is_one ? "" : "at least ", times,
      is_one ? "it" : "them", are_more ? "; there may be more such rows" : "");
  return all;
}

}  // namespace

OddRows oddRowsOf(const MatrixXd& jacobian, const VectorXd& left, Column x) {
  if (left.size() - jacobian.cols() <= kFewestFree || !jacobian.allFinite() || !left.allFinite()) return {};
  BeyondChance found = beyondChance(jacobian, left);
  std::vector<Odd>& odd = found.odd;
  if (odd.empty()) return {};
  const Rest rest{odd, jacobian, left, x};
  const auto sigmas = sigmasBeside(odd, rest, x, static_cast<std::size_t>(jacobian.cols()));
  odd = oddAmongNeighbours(std::move(odd), rest, x);
  if (!sigmas.empty() && !odd.empty()) {
    const VectorXd lighter = Eigen::Map<const VectorXd>(sigmas.data(), left.size()).cwiseInverse();
    auto by_sigma = beyondChance(lighter.asDiagonal() * jacobian, lighter.cwiseProduct(left));
    std::erase_if(by_sigma.odd,
                  [&](const Odd& one) { return std::ranges::find(odd, one.row, &Odd::row) == odd.end(); });
    found = std::move(by_sigma);
  }
  if (odd.empty()) return {};
  return named(odd, found.are_more, left.size());
}

OddRows oddRowsOf(const Model& model, Column y, std::span<const double> at, Column x) {
  const VectorXd left = residuals(model, y, at);
  // What is left of an exact curve says nothing of errors.
  if (!(left.squaredNorm() > kRoundingOfSquares * squaresOf(y))) return {};
  return oddRowsOf(jacobian(model, y.size(), {at.begin(), at.end()}), left, x);
}

}  // namespace toftwin::compare
