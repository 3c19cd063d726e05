// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/shape_fit.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

#include <tbb/parallel_for.h>

#include "calib/loop/descend.h"

namespace toftwin::loop {
namespace {

/// While shapes compete their inner numbers are fitted on at most so many rows: they are known well before. Those of the chosen
/// ones are fitted on more.
constexpr Eigen::Index kRows = 1500, kRowsAtLast = 8000;
/// A shape whose parts are so many times larger than their sum says nothing of either part.
constexpr double kCancels = 6.0;
/// Sums have at most so many parts, and so many of each length are followed.
constexpr int kParts = 3;
constexpr std::size_t kBeam = 5;
/// Less than this in the logarithm of a likelihood is no difference [Burnham, Anderson 2002, section 2.6].
constexpr double kAlike = 2.0;

/// Whether parts of the shape are many times larger than their sum: then other parts would do as well. A polynomial is not meant:
/// its powers belong together.
bool cancels(const Beside& beside, const Shape& shape) {
  if (shape.columns.size() < 2 || shape.has("parabola")) return false;
  const Eigen::MatrixXd x = columnsOf(beside.evidence, shape.columns);
  const auto fit = leastSquares(beside.evidence, beside.y, beside.weight, sideBySide(beside.model, x));
  const Eigen::VectorXd coefficient = fit.coefficient.tail(x.cols());
  const double sum = spreadOf(x * coefficient);
  for (Eigen::Index i = 0; i < x.cols(); ++i)
    if (spreadOf(x.col(i)) * std::abs(coefficient[i]) > kCancels * sum) return true;
  return false;
}

/// Whether a place of the shape lies where no row does.
bool isOutside(const Evidence& evidence, const Shape& shape) {
  const Covariate& c = *evidence.find(shape.covariates.front());
  for (const Part& part : partsOf(shape))
    for (std::size_t i = 0; i < part.inner.size(); ++i) {
      const bool is_place = part.family->moves[i] == 'l' && part.family->name != "sawtooth";
      if (is_place && !(part.inner[i] >= c.low() && part.inner[i] <= c.high())) return true;
    }
  return false;
}

/// A family's shapes on its grid, and all their columns side by side.
struct Grid {
  std::vector<Shape> shapes{};
  Eigen::MatrixXd columns{};
};

/// A shape of a grid, and what it leaves beside the rest with two for each column: what that takes of the noise and may cost of
/// what comes [Akaike 1974].
struct Start {
  Shape shape{};
  double left = 0.0;
};

/// Fits shapes over the same covariates beside the same model.
class Fitter {
 public:
  Fitter(const Beside& beside, const std::vector<std::string>& covariates, std::span<const Hint> hints)
      : hints_{hints}, beside_{beside}, left_{beside, kRows}, folds_{beside.evidence, beside.y, beside.weight, beside.scale} {
    folds_.share(beside.model);
    without_ = folds_.with(Eigen::MatrixXd(beside.evidence.rows(), 0));
    for (const std::string& name : covariates) arguments_.push_back(beside.evidence.find(name));
    for (const Family& family : families()) {
      if (static_cast<std::size_t>(family.arguments) != covariates.size() || !family.applies(arguments_)) continue;
      if (Grid grid = gridOf(family); !grid.shapes.empty()) grids_.push_back(std::move(grid));
    }
  }

  /// The families that apply, each at its best inner numbers, beside `parts` of a sum that is known.
  [[nodiscard]] std::vector<FittedShape> all(const Shape& parts) const {
    /// What the grid leaves more than the best by so many units of log-likelihood, fitting does not mend.
    constexpr double kHopeless = 12.0;
    const Left beside_parts{{left_.evidence(), left_.y(), left_.weight(), sideBySide(left_.model(), columnsOf(left_.evidence(), parts.columns)), beside_.scale}, left_.evidence().rows()};
    std::vector<Start> starts;
    for (const Grid& grid : grids_) {
      if (!parts.families.empty() && !grid.shapes.front().families.front()->adds) continue;
      std::ranges::move(startsOf(grid, beside_parts), std::back_inserter(starts));
    }
    // Of those that sums are made of only what is hopeless among them: what one part leaves, another may take.
    double least = std::numeric_limits<double>::infinity();
    for (const Start& start : starts)
      if (start.shape.families.front()->adds) least = std::min(least, start.left);
    std::vector<Shape> wholes;
    for (Start& start : starts) {
      const bool is_fitted = start.shape.moves().find_first_not_of('f') != std::string::npos;
      const double share = 0.15 * (beside_parts.before() / (beside_.scale * beside_.scale) - least);
      if (is_fitted && start.left > least + std::max(2.0 * kHopeless, share)) continue;
      wholes.push_back(parts.families.empty() ? std::move(start.shape) : sumOf(parts, start.shape));
    }
    std::vector<std::optional<FittedShape>> each(wholes.size());
    tbb::parallel_for(std::size_t{0}, wholes.size(), [&](std::size_t i) { each[i] = asItIs(wholes[i]); });
    std::vector<FittedShape> fitted;
    for (auto& one : each)
      if (one) fitted.push_back(*std::move(one));
    return fitted;
  }

  [[nodiscard]] std::optional<FittedShape> asItIs(const Shape& known) const {
    const Shape best = descend(left_, known);
    return held(moved(best, beside_.evidence, best.inner));
  }

  /// A sum without one part, of each part.
  [[nodiscard]] std::vector<FittedShape> shorter(const Shape& sum) const {
    std::vector<FittedShape> fitted;
    const std::vector<Part> parts = partsOf(sum);
    for (std::size_t out = 0; out < parts.size(); ++out) {
      Shape rest{.covariates = sum.covariates};
      for (std::size_t i = 0; i < parts.size(); ++i)
        if (i != out) rest = sumOf(rest, shapeOf(*parts[i].family, arguments_, parts[i].inner));
      rest.price = sum.price * static_cast<double>(rest.families.size()) / static_cast<double>(sum.families.size());
      const Shape best = descend(left_, std::move(rest));
      if (auto one = held(moved(best, beside_.evidence, best.inner))) fitted.push_back(*std::move(one));
    }
    return fitted;
  }

 private:
  [[nodiscard]] Grid gridOf(const Family& family) const {
    Grid grid;
    const auto inners = loop::gridOf(family, arguments_, hints_);
    Eigen::Index count = 0;
    for (const Inner& inner : inners) {
      Shape shape = shapeOf(family, arguments_, inner);
      if (6 * static_cast<Eigen::Index>(shape.columns.size()) > beside_.evidence.rows()) continue;
      shape.price = std::log(static_cast<double>(inners.size()));
      count += static_cast<Eigen::Index>(shape.columns.size());
      grid.shapes.push_back(std::move(shape));
    }
    grid.columns.resize(left_.evidence().rows(), count);
    Eigen::Index at = 0;
    for (const Shape& shape : grid.shapes) {
      const auto k = static_cast<Eigen::Index>(shape.columns.size());
      grid.columns.middleCols(at, k) = columnsOf(left_.evidence(), shape.columns);
      at += k;
    }
    return grid;
  }

  /// The best of the grid; of a grid whose values are shapes of their own, as numbers of knots are, the best few.
  [[nodiscard]] std::vector<Start> startsOf(const Grid& grid, const Left& beside) const {
    const double unit = beside_.scale * beside_.scale;
    const std::vector<double> left = beside.each(grid.columns, grid.shapes, unit);
    std::vector<std::size_t> order(grid.shapes.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto judged = [&](std::size_t i) { return left[i] / unit + 2.0 * static_cast<double>(grid.shapes[i].columns.size()); };
    std::ranges::stable_sort(order, {}, judged);
    const Family& family = *grid.shapes.front().families.front();
    order.resize(std::min<std::size_t>(order.size(), family.moves.find('f') == std::string::npos ? 1 : 4));
    std::vector<Start> best;
    for (const std::size_t i : order) best.push_back({grid.shapes[i], judged(i)});
    return best;
  }

  [[nodiscard]] std::optional<FittedShape> held(Shape shape) const {
    if (isOutside(beside_.evidence, shape) || cancels(beside_, shape)) return std::nullopt;
    const Eigen::MatrixXd columns = columnsOf(beside_.evidence, shape.columns);
    if (!columns.allFinite()) return std::nullopt;
    FittedShape one{.shape = std::move(shape), .held = folds_.with(columns)};
    one.gain = one.held.over(without_);
    one.worth = one.gain.mean - one.shape.price;
    return one;
  }

  std::span<const Hint> hints_;
  const Beside& beside_;
  Left left_;
  Folds folds_;
  HeldOut without_;
  std::vector<const Covariate*> arguments_;
  std::vector<Grid> grids_;
};

/// The shapes that may be part of a sum, the most worth first, of each kind one.
std::vector<FittedShape> bestOf(std::vector<FittedShape> shapes) {
  std::erase_if(shapes, [](const FittedShape& one) {
    return !(one.worth > 0.0) || std::ranges::any_of(one.shape.families, [](const Family* f) { return !f->adds; });
  });
  std::ranges::stable_sort(shapes, [](const FittedShape& a, const FittedShape& b) { return a.worth > b.worth; });
  std::vector<FittedShape> best;
  for (FittedShape& one : shapes) {
    const bool is_there = std::ranges::any_of(best, [&](const FittedShape& b) { return b.shape.name() == one.shape.name(); });
    if (!is_there) best.push_back(std::move(one));
    if (best.size() == kBeam) break;
  }
  return best;
}

}  // namespace

Shape refined(const Beside& beside, const Shape& start) {
  const Left left{beside, kRowsAtLast};
  const Shape shape = descend(left, start);
  return moved(shape, beside.evidence, shape.inner);
}

std::optional<Shape> bestStep(const Beside& beside, const std::string& covariate) {
  const auto step = std::ranges::find(families(), "step", &Family::name);
  const Covariate* argument = beside.evidence.find(covariate);
  const Arguments arguments{&argument, 1};
  if (!argument || !step->applies(arguments)) return std::nullopt;
  const Left left{beside, kRows};
  std::optional<Shape> best;
  double least = std::numeric_limits<double>::infinity();
  const auto grid = step->grid(arguments);
  for (const Inner& inner : grid) {
    Shape one = shapeOf(*step, arguments, inner);
    const double now = left(one);
    if (now < least) least = now, best = std::move(one);
  }
  best = descend(left, *std::move(best));
  best->price = std::log(static_cast<double>(grid.size()));
  return moved(*best, beside.evidence, best->inner);
}

std::vector<FittedShape> fitShapes(const Beside& beside, const std::vector<std::string>& covariates, std::span<const Hint> hints, const Shape* known) {
  const Fitter fitter{beside, covariates, hints};
  std::vector<FittedShape> all = fitter.all({});
  if (known)
    if (auto one = fitter.asItIs(*known)) all.push_back(*std::move(one));
  if (covariates.size() == 2) {
    // Either of two may be the first factor.
    const Fitter other{beside, {covariates[1], covariates[0]}, hints};
    std::ranges::move(other.all({}), std::back_inserter(all));
    return all;
  }
  // Sums over one covariate: the best parts that may be added, then the best beside each of them, as long as that predicts.
  std::vector<FittedShape> beam = bestOf(all);
  for (int count = 1; count < kParts && !beam.empty(); ++count) {
    std::vector<FittedShape> longer;
    for (const FittedShape& parts : beam) {
      for (FittedShape& one : fitter.all(parts.shape))
        if (one.worth > parts.worth + kAlike) longer.push_back(std::move(one));
    }
    beam = bestOf(longer);
    // A part that a later one made useless is left out again.
    for (const FittedShape& sum : beam) std::ranges::move(fitter.shorter(sum.shape), std::back_inserter(all));
    all.insert(all.end(), longer.begin(), longer.end());
  }
  return all;
}

namespace {

/// Families stand in the order of how simple they are to people.
/// A column of the table says more than the order of its lines.
std::ptrdiff_t rankOf(const FittedShape& one) {
  const bool is_order = one.shape.covariates.front() == kLine;
  return (is_order ? 1000 : 0) + (one.shape.families.front() - families().data());
}

}  // namespace

const FittedShape* simplest(const std::vector<FittedShape>& shapes) {
  const FittedShape* best = nullptr;
  for (const FittedShape& one : shapes)
    if (!best || one.worth > best->worth) best = &one;
  if (!best || !(best->worth > 0.0)) return nullptr;
  const FittedShape* chosen = best;
  for (const FittedShape& one : shapes) {
    const auto lost = best->held.over(one.held);
    const bool is_as_good = best->worth - one.worth <= std::max(kAlike, lost.error) && one.worth > 0.0;
    const bool is_simpler = std::pair{one.shape.numbers(), rankOf(one)} < std::pair{chosen->shape.numbers(), rankOf(*chosen)};
    if (is_as_good && is_simpler) chosen = &one;
  }
  return chosen;
}

}  // namespace toftwin::loop
