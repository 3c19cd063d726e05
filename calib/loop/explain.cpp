// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/explain.h"

#include <algorithm>
#include <cmath>

#include "calib/linear/linear.h"
#include "calib/loop/noise.h"
#include "calib/loop/projection.h"
#include "calib/loop/wander.h"

namespace toftwin::loop {
namespace {

/// Sets of covariates whose shapes are fitted after each test.
constexpr std::size_t kShortlist = 3;
/// Blocks: enough that signs of a hundred of them are a distribution.
constexpr int kMostBlocks = 150;

/// Whether both name the same covariates, in any order.
bool areSame(std::vector<std::string> a, std::vector<std::string> b) {
  std::ranges::sort(a), std::ranges::sort(b);
  return a == b;
}

/// The search's state: evidence, what was found, and what all of that leaves.
class Search {
 public:
  Search(Evidence& evidence, const ExplainOptions& options) : evidence_{evidence}, options_{options} {
    weight_ = judge();
  }

  Explanation run() {
    for (int round = 0; static_cast<int>(out_.effects.size()) < options_.most_effects && round < 2 * options_.most_effects; ++round) {
      update();
      // What covariates do alone comes first: two that only act together leave nothing of each alone.
      const bool has_added = addStep() || look(Order::Alone, round) || look(Order::Together, round);
      if (!has_added) break;
      out_.unexplained.clear();
      unite();
      judge();
      reshapeAll();
      dropUseless();
    }
    update();
    finish();
    return std::move(out_);
  }

 private:
  /// Noise beside what is known so far: how far apart rows err independently, and by how much. Gives rows' robust weights.
  Eigen::VectorXd judge() {
    const Noise noise = judgeNoise(evidence_, model());
    out_.block_length = noise.length, out_.correlation = noise.correlation;
    block(evidence_, noise.length, std::min<int>(kMostBlocks, std::max<int>(10, static_cast<int>(evidence_.rows() / 3))));
    scale_ = noise.scale;
    if (options_.is_robust) return robustWeights(noise.residual, evidence_.sigma);
    scale_ = std::max(1e-300, std::sqrt(noise.residual.cwiseQuotient(evidence_.sigma).squaredNorm() / static_cast<double>(evidence_.rows())));
    return evidence_.sigma.array().square().inverse();
  }

  /// Columns of everything but the effect of this number.
  [[nodiscard]] Eigen::MatrixXd modelWithout(std::size_t which) const {
    Eigen::MatrixXd all(evidence_.rows(), 0);
    for (std::size_t i = 0; i < out_.effects.size(); ++i)
      if (i != which) all = sideBySide(all, columnsOf(evidence_, out_.effects[i].shape.columns));
    return all;
  }
  [[nodiscard]] Eigen::MatrixXd model() const { return modelWithout(out_.effects.size()); }

  /// The model and its derivatives by the fitted inner numbers: an effect whose period is a little off is no new effect.
  [[nodiscard]] Eigen::MatrixXd tangents() const {
    Eigen::MatrixXd all = model();
    for (const Effect& effect : out_.effects) {
      const Eigen::MatrixXd at = columnsOf(evidence_, effect.shape.columns);
      const std::string moves = effect.shape.moves();
      for (std::size_t i = 0; i < effect.shape.inner.size(); ++i) {
        const char move = moves[i];
        if (move == 'f' || move == 'b') continue;
        Inner inner = effect.shape.inner;
        const double step = move == 's' ? 1e-3 * inner[i] : 1e-3 * evidence_.find(effect.shape.covariates.front())->span();
        inner[i] += step;
        const Eigen::MatrixXd beside = columnsOf(evidence_, moved(effect.shape, evidence_, inner).columns);
        if (beside.allFinite()) all = sideBySide(all, (beside - at) / step);
      }
    }
    return all;
  }

  /// What the effects leave, and the weights of rows by it.
  void update() {
    LeastSquares fit = leastSquares(evidence_, evidence_.y, weight_, model());
    for (int turn = 0; turn < 3; ++turn) {
      // Until something is found the flexible model's residual knows better which rows are far.
      if (!out_.effects.empty() && options_.is_robust) weight_ = robustWeights(fit.residual, evidence_.sigma);
      fit = leastSquares(evidence_, evidence_.y, weight_, model());
    }
    out_.residual = fit.residual;
    if (!options_.is_robust) return;
    out_.scale = robustScale(Eigen::VectorXd(fit.residual.cwiseQuotient(evidence_.sigma)));
    scale_ = std::max(1e-300, std::min(scale_, out_.scale));
  }

  /// The parts of what was found over single covariates.
  [[nodiscard]] std::vector<Hint> hints() const {
    std::vector<Hint> all;
    for (const Effect& effect : out_.effects)
      for (const Part& part : partsOf(effect.shape))
        if (part.family->arguments == 1) all.push_back({part.family->name, effect.shape.covariates.front(), part.inner});
    return all;
  }

  [[nodiscard]] std::vector<FittedShape> shapesFor(const Eigen::MatrixXd& beside, const std::vector<std::string>& covariates, const Shape* known = nullptr) const {
    return fitShapes({evidence_, evidence_.y, weight_, beside, scale_}, covariates, hints(), known);
  }

  /// Where rows of long stretches err alike, few stretches tell too little to draw signs of. A step is another thing than a wander,
  /// which the rows' likelihood tells: over a column that goes with the lines if that says as much as the line itself.
  bool addStep() {
    if (out_.block_length == 1) return false;
    const Eigen::MatrixXd beside = model();
    std::optional<Shape> best;
    double most = 0.0;
    for (const Covariate& c : evidence_.covariates) {
      if (!c.goes_with_lines || !c.varies_within_groups) continue;
      auto shape = bestStep({evidence_, evidence_.y, weight_, beside, scale_}, c.name);
      if (!shape) continue;
      const double more = beyondWander(*shape, beside) - (c.is_order ? 2.0 : 0.0);
      if (more > most) most = more, best = *std::move(shape);
    }
    if (!best) return false;
    out_.p = std::min(out_.p, std::exp(-most)), out_.last_p = std::min(out_.last_p, out_.p);
    Effect effect{.shape = *std::move(best), .p = std::max(1e-6, std::exp(-most))};
    effect.gain = {most, 0.0};
    out_.effects.push_back(std::move(effect));
    return true;
  }

  /// Effects of the same covariates are one, a sum.
  void unite() {
    for (std::size_t i = 0; i < out_.effects.size(); ++i)
      for (std::size_t j = i + 1; j < out_.effects.size(); ++j) {
        if (out_.effects[i].shape.covariates != out_.effects[j].shape.covariates) continue;
        out_.effects[i].shape = sumOf(out_.effects[i].shape, out_.effects[j].shape);
        out_.effects.erase(out_.effects.begin() + static_cast<std::ptrdiff_t>(j));
        --j;
      }
  }

  /// Whether something stands out and could be added.
  bool look(Order order, int round) {
    const Scores scores = screen(evidence_, out_.residual, weight_, tangents(), order, hints(), options_.draws, options_.seed + static_cast<std::uint64_t>(round));
    if (round == 0) out_.p = std::min(1.0, order == Order::Alone ? scores.p : std::min(out_.p, scores.p));
    out_.last_p = order == Order::Alone ? scores.p : std::min(out_.last_p, scores.p);
    // Half of the chance of a false alarm is for each order.
    if (scores.all.empty() || scores.p > std::max(0.5 * options_.alpha, 1.0 / options_.draws)) return false;
    if (add(scores)) return true;
    noteUnexplained(scores);
    return false;
  }

  /// The three sets of covariates that stand out most, each once: it is not of interest by how many families. What stands out half as far
  /// as the first may be chance.
  void noteUnexplained(const Scores& scores) {
    constexpr std::size_t kMost = 3;
    for (const Score& score : scores.all) {
      if (out_.unexplained.size() >= kMost || score.deviate < 0.5 * scores.all.front().deviate) return;
      const bool is_there = std::ranges::any_of(out_.unexplained, [&](const Score& one) { return areSame(one.covariates, score.covariates); });
      if (!is_there) out_.unexplained.push_back(score);
    }
  }

  /// The shape that predicts best, of the covariates that stand out. False if none predicts.
  bool add(const Scores& scores) {
    std::vector<std::vector<std::string>> sets;
    for (const Score& score : scores.all) {
      if (std::ranges::find(sets, score.covariates) == sets.end()) sets.push_back(score.covariates);
      if (sets.size() == kShortlist) break;
    }
    const Eigen::MatrixXd beside = model();
    std::vector<FittedShape> all;
    for (const auto& set : sets) {
      auto more = shapesFor(beside, set);
      std::ranges::move(more, std::back_inserter(all));
    }
    // What only mends what a covariate does alone is no acting together.
    std::erase_if(all, [&](const FittedShape& one) { return one.shape.covariates.size() == 2 && !actsTogether(one.shape, beside); });
    const FittedShape* chosen = simplest(all);
    // Held-out rows must say it, too, by two of their standard errors.
    if (!chosen || (options_.is_robust && chosen->gain.mean < 2.0 * chosen->gain.error) || wandersAsWell(*chosen, beside)) return false;
    Effect effect{.shape = chosen->shape, .p = scores.p, .gain = chosen->gain};
    effect.alternatives = alternativesOf(*chosen, all, beside);
    out_.effects.push_back(std::move(effect));
    return true;
  }

  /// Whether the products of a shape predict held-out rows beside each of their factors by itself.
  [[nodiscard]] bool actsTogether(const Shape& shape, const Eigen::MatrixXd& beside) const {
    std::vector<Product> alone;
    for (const Product& product : shape.columns)
      for (const terms::Factor& factor : product)
        if (product.size() == 2 && std::ranges::find(alone, Product{factor}) == alone.end()) alone.push_back({factor});
    if (alone.empty()) return true;
    Folds folds{evidence_, evidence_.y, weight_, scale_};
    folds.share(sideBySide(beside, columnsOf(evidence_, alone)));
    const auto gain = folds.with(columnsOf(evidence_, shape.columns)).over(folds.with(Eigen::MatrixXd(evidence_.rows(), 0)));
    return gain.mean > std::max(shape.price, 2.0 * gain.error);
  }

  /// By how much the shape makes the rows likelier than a wander alone does, in logarithms and beyond its numbers, what was looked
  /// through, and what is clear: a wander has no steps, and no waves that keep their phase.
  [[nodiscard]] double beyondWander(const Shape& shape, const Eigen::MatrixXd& beside) const {
    /// What wanders has been seen to look likelier as a curve by up to e⁸ in 90 series of AR(0.9) noise.
    constexpr double kClear = 10.0;
    const auto likelihood = [&](const Eigen::MatrixXd& columns) {
      const Eigen::VectorXd left = leastSquares(evidence_, evidence_.y, weight_, columns).residual.cwiseQuotient(evidence_.sigma) / scale_;
      return fitWander(left.cwiseMin(8.0).cwiseMax(-8.0), evidence_.group).likelihood;
    };
    const double more = likelihood(sideBySide(beside, columnsOf(evidence_, shape.columns))) - likelihood(beside);
    // That was of all shapes. A wander that looks like one of a few waves of a known period is as rare as a false alarm may be.
    const bool is_known = std::ranges::all_of(shape.families, [](const Family* family) { return family->name == "harmonic"; });
    return more - shape.price - shape.numbers() - (is_known ? -std::log(options_.alpha) : kClear);
  }

  /// Of the blocks of rows, how many lose less with the shape.
  [[nodiscard]] double shareThatGains(const FittedShape& chosen, const Eigen::MatrixXd& beside) const {
    const HeldOut without = Folds{evidence_, evidence_.y, weight_, scale_}.with(beside);
    return static_cast<double>((chosen.held.loss.array() < without.loss.array()).count()) / std::max(1, evidence_.blocks);
  }

  /// Whether errors that wander from row to row predict blocks of rows as well as the shape does. Along the lines of the file both
  /// are the same curve: then it must be clear that blocks are predicted at all, and the answer says that it may be a wander.
  [[nodiscard]] bool wandersAsWell(const FittedShape& chosen, const Eigen::MatrixXd& beside) const {
    /// Gains of few long blocks have a tail: of 90 series of AR(0.9) noise the largest was 4.3 errors.
    constexpr double kClear = 4.5;
    /// An effect that is large in a few blocks gains unevenly; of 20 blocks 17 gain by chance once in 800 times.
    constexpr double kMostGain = 0.85;
    if (out_.block_length == 1 || beyondWander(chosen.shape, beside) > 0.0) return false;
    const bool goes_with_lines = std::ranges::any_of(chosen.shape.covariates, [&](const std::string& name) { return evidence_.find(name)->goes_with_lines; });
    if (goes_with_lines) return chosen.gain.mean < kClear * chosen.gain.error && shareThatGains(chosen, beside) < kMostGain;
    Folds folds{evidence_, evidence_.y, weight_, scale_};
    const HeldOut without = folds.with(beside), with = folds.with(sideBySide(beside, columnsOf(evidence_, chosen.shape.columns)));
    const auto gain = folds.wandering(with).over(folds.wandering(without));
    return gain.mean < std::max(chosen.shape.price, gain.error);
  }

  [[nodiscard]] Eigen::VectorXd curveOf(const Shape& shape, const Eigen::MatrixXd& beside) const {
    const Eigen::MatrixXd x = columnsOf(evidence_, shape.columns);
    const auto fit = leastSquares(evidence_, evidence_.y, weight_, sideBySide(beside, x));
    return x * fit.coefficient.tail(x.cols());
  }

  /// Other sets of covariates whose best shape loses less than two standard errors, and whose curve is much the same.
  [[nodiscard]] std::vector<Alternative> alternativesOf(const FittedShape& chosen, const std::vector<FittedShape>& all,
                                                        const Eigen::MatrixXd& beside) const {
    std::vector<Alternative> out;
    const Eigen::VectorXd curve = curveOf(chosen.shape, beside);
    for (const FittedShape& one : all) {
      if (areSame(one.shape.covariates, chosen.shape.covariates) || one.shape.covariates.front() == kLine || !(one.worth > 0.0)) continue;
      if (std::ranges::any_of(out, [&](const Alternative& other) { return areSame(other.covariates, one.shape.covariates); })) continue;
      const auto lost = chosen.held.over(one.held);
      if (lost.mean > 2.0 * lost.error) continue;
      const Eigen::VectorXd other = curveOf(one.shape, beside);
      const double together = ((curve.array() - curve.mean()) * (other.array() - other.mean())).mean() / std::max(1e-300, spreadOf(curve) * spreadOf(other));
      if (std::abs(together) >= 0.5) out.push_back({one.shape.covariates, together});
    }
    return out;
  }

  /// Each effect's shape is chosen once more beside the others.
  void reshapeAll() {
    for (std::size_t i = 0; i < out_.effects.size(); ++i) {
      const auto shapes = shapesFor(modelWithout(i), out_.effects[i].shape.covariates, &out_.effects[i].shape);
      if (const FittedShape* chosen = simplest(shapes)) out_.effects[i].shape = chosen->shape, out_.effects[i].gain = chosen->gain;
    }
  }

  /// Effects that the others make useless go, and of effects that cancel the one that is missed less.
  void dropUseless() {
    for (bool has_dropped = true; has_dropped && out_.effects.size() > 1;) {
      has_dropped = false;
      Folds folds{evidence_, evidence_.y, weight_, scale_};
      const HeldOut all = folds.with(model());
      for (std::size_t i = 0; i < out_.effects.size(); ++i) {
        const auto gain = all.over(folds.with(modelWithout(i)));
        out_.effects[i].gain = gain;
        const bool is_useless = gain.mean < std::max(out_.effects[i].shape.price, gain.error);
        const bool is_larger = spreadOf(curveOf(out_.effects[i].shape, modelWithout(i))) > 1.5 * spreadOf(evidence_.y) && gain.mean < 4.0 * gain.error;
        if (!is_useless && !is_larger) continue;
        out_.effects.erase(out_.effects.begin() + static_cast<std::ptrdiff_t>(i));
        has_dropped = true;
        break;
      }
    }
  }

  /// Numbers with their covariance, of everything at once.
  void finish() {
    for (int turn = 0; turn < 2; ++turn)
      for (std::size_t i = 0; i < out_.effects.size(); ++i)
        out_.effects[i].shape = refined({evidence_, evidence_.y, weight_, modelWithout(i), scale_}, out_.effects[i].shape);
    update();
    const LeastSquares fit = leastSquares(evidence_, evidence_.y, weight_, model());
    const double freedom = std::max(1.0, static_cast<double>(evidence_.rows() - model().cols() - evidence_.groups()));
    const double variance = (out_.residual.array().square() * weight_.array()).sum() / freedom;
    takeNumbers(out_.effects, fit, variance);
  }

  Evidence& evidence_;
  ExplainOptions options_;
  Eigen::VectorXd weight_;
  double scale_ = 1.0;
  Explanation out_;
};

}  // namespace

Eigen::MatrixXd columnsOf(const Evidence& evidence, const std::vector<Effect>& effects) {
  Eigen::MatrixXd all(evidence.rows(), 0);
  for (const Effect& effect : effects) all = sideBySide(all, columnsOf(evidence, effect.shape.columns));
  return all;
}

Eigen::VectorXd lessEffects(const Evidence& evidence, const std::vector<Effect>& effects) {
  Eigen::VectorXd left = evidence.y;
  for (const Effect& effect : effects) left -= columnsOf(evidence, effect.shape.columns) * effect.coefficient;
  return left;
}

void takeNumbers(std::vector<Effect>& effects, const LeastSquares& fit, double variance) {
  Eigen::Index at = 0;
  for (Effect& effect : effects) {
    const auto k = static_cast<Eigen::Index>(effect.shape.columns.size());
    effect.coefficient = fit.coefficient.segment(at, k);
    effect.covariance = variance * fit.covariance.block(at, at, k, k);
    at += k;
  }
}

Explanation explain(Evidence& evidence, const ExplainOptions& options) { return Search{evidence, options}.run(); }

}  // namespace toftwin::loop
