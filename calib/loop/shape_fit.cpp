// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/shape_fit.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

#include <tbb/parallel_for.h>

#include "calib/linear/linear.h"
#include "calib/loop/projection.h"

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

Eigen::MatrixXd joined(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd both(a.rows(), a.cols() + b.cols());
  both << a, b;
  return both;
}

/// Sum of squares that is left beside the model, of some rows.
class Left {
 public:
  explicit Left(const Beside& beside, Eigen::Index most = kRows) : evidence_{&beside.evidence}, weight_{beside.weight}, y_{beside.y} {
    model_ = beside.model;
    if (beside.evidence.rows() > most) {
      // Steps that differ do not alias a short period of the rows.
      std::vector<Eigen::Index> rows;
      const Eigen::Index every = beside.evidence.rows() / most + 1;
      for (Eigen::Index i = 0; i < beside.evidence.rows(); i += 1 + (i * 2654435761LL >> 7) % (2 * every - 1)) rows.push_back(i);
      part_ = rowsOf(beside.evidence, rows);
      evidence_ = &part_;
      weight_ = beside.weight(rows).eval(), y_ = beside.y(rows).eval(), model_ = beside.model(rows, Eigen::all).eval();
    }
    projection_.emplace(*evidence_, weight_, model_);
    left_ = (*projection_)(y_);
  }
  [[nodiscard]] const Evidence& evidence() const { return *evidence_; }
  [[nodiscard]] double before() const { return left_.squaredNorm(); }
  /// Of these columns, beside the model.
  [[nodiscard]] Eigen::VectorXd coefficients(const Eigen::MatrixXd& columns) const {
    // Of columns that are projected out the coefficients beside them are those of the projected ones [Frisch, Waugh, Lovell].
    Eigen::MatrixXd x = (*projection_)(columns);
    const Eigen::VectorXd length = x.colwise().norm().transpose().cwiseMax(1e-300);
    x = x * length.cwiseInverse().asDiagonal();
    const auto pairs = linear::eigenpairs(x.transpose() * x);
    const double least = 1e-11 * std::max(1e-300, pairs.values.maxCoeff());
    const Eigen::VectorXd inverse = pairs.values.unaryExpr([&](double v) { return v > least ? 1.0 / v : 0.0; });
    const Eigen::VectorXd unit = pairs.vectors * (inverse.asDiagonal() * (pairs.vectors.transpose() * (x.transpose() * left_)));
    return unit.cwiseQuotient(length);
  }

  [[nodiscard]] const Eigen::VectorXd& y() const { return y_; }
  [[nodiscard]] const Eigen::VectorXd& weight() const { return weight_; }
  [[nodiscard]] const Eigen::MatrixXd& model() const { return model_; }

  [[nodiscard]] double operator()(const Shape& shape) const {
    Eigen::MatrixXd x = columnsOf(*evidence_, shape.columns);
    return x.allFinite() ? after((*projection_)(std::move(x))) : before();
  }
  /// Of several shapes whose columns stand side by side. Of many shapes of one or two columns those that hardly go with the
  /// residual are not looked at, and leave all.
  [[nodiscard]] std::vector<double> each(const Eigen::MatrixXd& columns, const std::vector<Shape>& shapes, double unit) const {
    constexpr std::size_t kLookedAt = 24;
    const Eigen::VectorXd weighted = left_.cwiseProduct(weight_.cwiseSqrt());
    const Eigen::VectorXd moment = columns.transpose() * weighted;
    const Eigen::VectorXd mean = columns.colwise().mean();
    std::vector<std::pair<double, std::size_t>> order;
    std::vector<Eigen::Index> from;
    Eigen::Index at = 0;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(shapes[i].columns.size());
      double with = -2.0 * static_cast<double>(k) * unit;
      for (Eigen::Index c = at; c < at + k; ++c) {
        const double size = columns.col(c).squaredNorm() - static_cast<double>(columns.rows()) * mean[c] * mean[c];
        if (size > 0.0) with += moment[c] * moment[c] / size;
      }
      order.emplace_back(k > 2 ? -std::numeric_limits<double>::infinity() : -with, i);
      from.push_back(at);
      at += k;
    }
    std::ranges::sort(order);
    std::vector<double> left(shapes.size(), before());
    for (std::size_t rank = 0; rank < order.size(); ++rank) {
      if (rank >= kLookedAt && std::isfinite(order[rank].first)) break;
      const std::size_t i = order[rank].second;
      const Eigen::MatrixXd part = columns.middleCols(from[i], static_cast<Eigen::Index>(shapes[i].columns.size()));
      if (part.allFinite()) left[i] = after((*projection_)(part));
    }
    return left;
  }

 private:
  /// Of columns beside the model.
  [[nodiscard]] double after(Eigen::MatrixXd x) const {
    for (Eigen::Index c = 0; c < x.cols(); ++c) x.col(c) /= std::max(1e-300, x.col(c).norm());
    const auto pairs = linear::eigenpairs(x.transpose() * x);
    const Eigen::VectorXd moment = pairs.vectors.transpose() * (x.transpose() * left_);
    double explained = 0.0;
    for (Eigen::Index i = 0; i < moment.size(); ++i)
      if (pairs.values[i] > 1e-9 * pairs.values.maxCoeff()) explained += moment[i] * moment[i] / pairs.values[i];
    return before() - explained;
  }

  const Evidence* evidence_;
  Evidence part_{};
  Eigen::VectorXd weight_, y_;
  Eigen::MatrixXd model_;
  std::optional<Projection> projection_;
  Eigen::VectorXd left_;
};

/// The middle between the values on both sides of a place.
double betweenRows(const Covariate& c, double place) {
  const auto above = std::ranges::lower_bound(c.sorted, place);
  if (above == c.sorted.begin() || above == c.sorted.end()) return place;
  return 0.5 * (*(above - 1) + *above);
}

/// A place where the shape jumps goes to where less is left, by steps that shrink to a row.
void moveJump(const Left& left, const Covariate& c, std::size_t which, Shape& shape, double& least) {
  for (double step = c.span() / 96.0; step > 0.25 * c.spacing && step > 1e-5 * c.span();) {
    bool has_moved = false;
    for (const double sign : {1.0, -1.0}) {
      Inner inner = shape.inner;
      inner[which] = betweenRows(c, inner[which] + sign * step);
      Shape other = moved(shape, left.evidence(), inner);
      const double now = left(other);
      if (now >= least) continue;
      least = now, shape = std::move(other), has_moved = true;
      break;
    }
    if (!has_moved) step *= 0.5;
  }
}

/// By how much an inner number is moved to see what that changes.
double differenceOf(char move, double value, const Covariate& c) { return move == 's' ? 1e-4 * value : 1e-4 * c.span(); }

/// One step of Gauss and Newton by all smooth inner numbers at once: the shape's derivatives are columns beside it, and their
/// coefficients say how far to go. Halved until less is left. False if none does.
bool stepSmooth(const Left& left, const Covariate& c, const std::string& moves, Shape& shape, double& least) {
  const Eigen::MatrixXd at = columnsOf(left.evidence(), shape.columns);
  const Eigen::VectorXd coefficient = left.coefficients(at);
  std::vector<std::size_t> which;
  Eigen::MatrixXd slopes(at.rows(), 0);
  for (std::size_t i = 0; i < moves.size(); ++i) {
    if (moves[i] != 's' && moves[i] != 'l') continue;
    Inner inner = shape.inner;
    const double difference = differenceOf(moves[i], inner[i], c);
    inner[i] += difference;
    const Eigen::MatrixXd beside = columnsOf(left.evidence(), moved(shape, left.evidence(), inner).columns);
    if (!beside.allFinite()) continue;
    slopes.conservativeResize(Eigen::NoChange, slopes.cols() + 1);
    slopes.col(slopes.cols() - 1) = (beside - at) * coefficient / difference;
    which.push_back(i);
  }
  if (which.empty()) return false;
  Eigen::MatrixXd both(at.rows(), at.cols() + slopes.cols());
  both << at, slopes;
  const Eigen::VectorXd step = left.coefficients(both).tail(slopes.cols());
  for (double share = 1.0; share > 0.01; share *= 0.4) {
    Inner inner = shape.inner;
    for (std::size_t k = 0; k < which.size(); ++k) {
      const double to = share * step[static_cast<Eigen::Index>(k)];
      const std::size_t i = which[k];
      // What must stay positive goes by at most a third.
      inner[i] += moves[i] == 's' ? std::clamp(to, -0.33 * inner[i], 0.5 * inner[i]) : std::clamp(to, -0.2 * c.span(), 0.2 * c.span());
    }
    Shape other = moved(shape, left.evidence(), inner);
    const double now = left(other);
    if (!(now < least)) continue;
    const bool is_little = least - now < 1e-7 * least;
    least = now, shape = std::move(other);
    return !is_little;
  }
  return false;
}

Shape descend(const Left& left, Shape shape) {
  constexpr int kSteps = 12;
  const std::string moves = shape.moves();
  const Covariate& c = *left.evidence().find(shape.covariates.front());
  double least = left(shape);
  for (int round = 0; round < 2; ++round) {
    for (std::size_t i = 0; i < moves.size(); ++i)
      if (moves[i] == 'b') moveJump(left, c, i, shape, least);
    for (int step = 0; step < kSteps && stepSmooth(left, c, moves, shape, least); ++step) {}
    if (moves.find('b') == std::string::npos) break;
  }
  return shape;
}

double spreadOf(const Eigen::VectorXd& v) { return std::sqrt((v.array() - v.mean()).square().mean()); }

/// Whether parts of the shape are many times larger than their sum: then other parts would do as well. A polynomial is not meant:
/// its powers belong together.
bool cancels(const Beside& beside, const Shape& shape) {
  if (shape.columns.size() < 2 || shape.has("parabola")) return false;
  const Eigen::MatrixXd x = columnsOf(beside.evidence, shape.columns);
  Eigen::MatrixXd all(x.rows(), beside.model.cols() + x.cols());
  all << beside.model, x;
  const auto fit = leastSquares(beside.evidence, beside.y, beside.weight, all);
  const Eigen::VectorXd coefficient = fit.coefficient.tail(x.cols());
  const double sum = spreadOf(x * coefficient);
  for (Eigen::Index i = 0; i < x.cols(); ++i)
    if (spreadOf(x.col(i)) * std::abs(coefficient[i]) > kCancels * sum) return true;
  return false;
}

/// Whether a place of the shape lies where no row does.
bool isOutside(const Evidence& evidence, const Shape& shape) {
  const Covariate& c = *evidence.find(shape.covariates.front());
  std::size_t at = 0;
  for (const Family* family : shape.families) {
    for (const char move : family->moves) {
      const double place = shape.inner[at++];
      if (move == 'l' && family->name != "sawtooth" && !(place >= c.low() && place <= c.high())) return true;
    }
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
      : hints_{hints}, beside_{beside}, left_{beside}, folds_{beside.evidence, beside.y, beside.weight, beside.scale} {
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
    const Left beside_parts{{left_.evidence(), left_.y(), left_.weight(), joined(left_.model(), columnsOf(left_.evidence(), parts.columns)), beside_.scale}, left_.evidence().rows()};
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
    for (std::size_t out = 0; out < sum.families.size(); ++out) {
      Shape rest;
      std::size_t at = 0;
      for (std::size_t i = 0; i < sum.families.size(); ++i) {
        const auto from = sum.inner.begin() + static_cast<std::ptrdiff_t>(at);
        at += sum.families[i]->moves.size();
        if (i == out) continue;
        Shape part = shapeOf(*sum.families[i], arguments_, {from, from + static_cast<std::ptrdiff_t>(sum.families[i]->moves.size())});
        rest = rest.families.empty() ? std::move(part) : sumOf(rest, part);
      }
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
  const Left left{beside};
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
