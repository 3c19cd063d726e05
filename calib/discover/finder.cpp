// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/finder.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "calib/discover/cancelling_effects.h"
#include "calib/discover/candidates.h"
#include "calib/discover/crossed_shape.h"
#include "calib/discover/estimate.h"
#include "calib/discover/found_effects.h"
#include "calib/discover/light_shape.h"
#include "calib/discover/reshape_effects.h"
#include "calib/discover/same_cause.h"
#include "calib/discover/shape_choice.h"

namespace toftwin::discover {
namespace {

constexpr int kMostParts = 8;  ///< over all effects

class Search {
 public:
  Search(const RowSource& source, const FinderOptions& options) : options_(options) {
    // The caller keeps it.
    found_.context.original = found_.context.source =
        std::shared_ptr<const RowSource>{std::shared_ptr<void>{}, &source};
    found_.context.covariates = source.covariates();
    found_.context.test = {options.null_model, options.draws, options.seed, options.least_dispersion};
    found_.context.alpha = options.alpha;
    const std::size_t captures = source.withoutCatalogue({}).captures.size();
    found_.context.generic = genericCandidates(
        found_.context.covariates, {.captures = captures, .has_straight_pairs = options.has_straight_pairs});
    for (TermGroup& own : source.ownGroups()) found_.context.generic.push_back(std::move(own));
  }

  Finding run() {
    for (int step = 0; step < kMostParts; ++step) {
      updateKnown();
      updateScales();
      const Significance significance = testNow(step);
      // The first test has all of alpha; each later one a half, so that all of a run's stay below a few
      // alpha.
      if (significance.p > (step == 0 ? options_.alpha : 0.5 * options_.alpha)) break;
      if (static_cast<int>(found_.effects.size()) >= options_.most_effects) break;
      if (!addEffect(significance.p)) break;
    }
    dropNeedlessParts(found_);
    if (found_.effects.size() > 1) {
      revise(found_);
      prune(found_);
      joinCancelling(found_);
      if (found_.context.original->named() != nullptr) markRests(found_);
    }
    const auto estimated = [&] { return estimate(*found_.context.source, found_.context.scales, found_.effects); };
    finding_.nuisances = estimated();
    if (retellUndetermined(found_)) finding_.nuisances = estimated();
    finding_.scales = found_.context.scales;
    updateKnown();
    finding_.dispersion = dispersionNow();
    finding_.effects = std::move(found_.effects);
    return std::move(finding_);
  }

 private:
  /// Effects' groups and their tangents; catalogue effects are columns of the evidence already.
  void updateKnown() {
    found_.context.known = groupsOf(found_.effects);
    for (TermGroup& tangent : tangentsOf(found_.effects)) found_.context.known.push_back(std::move(tangent));
    for (std::size_t i = 0; i < found_.context.known.size(); ++i)
      found_.context.known[i].name = fmt::format("known {}", i + 1);
    found_.context.catalogue.clear();
    for (const Effect& effect : found_.effects) {
      if (effect.is_catalogue && !effect.fit) found_.context.catalogue.push_back(effect.name);
    }
  }

  /// Scales of random effects, with everything known and, where captures are many, a smooth function of each
  /// covariate projected out: what is an effect must not make poses look worse than they are.
  void updateScales() {
    std::vector<TermGroup> extra = found_.context.known;
    std::vector<std::string> names;
    for (const TermGroup& known : found_.context.known) names.push_back(known.name);
    const Evidence plain = found_.context.source->withoutCatalogue({});
    const bool has_random = std::ranges::any_of(plain.groups, [](const Group& group) {
      return group.kind == Kind::PerCapture || group.kind == Kind::Shared;
    });
    if (!has_random) return;
    std::size_t columns = 0, knots = 5;
    for (const CovariateInfo& covariate : found_.context.covariates)
      columns += smoothIn(covariate, knots).terms.size();
    // Few captures show a slope of each covariate rather than curves of the first ones.
    if (options_.has_straight_pairs && columns > plain.captures.size() / 3) knots = 2;
    columns = 0;
    for (const CovariateInfo& covariate : found_.context.covariates) {
      TermGroup smooth = smoothIn(covariate, knots);
      columns += smooth.terms.size();
      if (columns > plain.captures.size() / 3) break;
      names.push_back(smooth.name);
      extra.push_back(std::move(smooth));
    }
    found_.context.scales = estimateScales(evidenceOf(found_.context, extra), names);
    if (!found_.effects.empty()) return;
    for (double& scale : found_.context.scales) scale = std::min(scale, options_.most_scale);
  }

  Significance testNow(int step) {
    TestOptions options = found_.context.test;
    options.seed += 1000003U * static_cast<std::uint64_t>(step);
    Test test{options};
    inParts(found_.context, found_.context.generic, [&](const Part& part) {
      const std::span tested = std::span{found_.context.generic}.subspan(part.begin, part.end - part.begin);
      test.add(
          part.marginal, part.model,
          found_.context.source->nullMoments(withKnown(found_.context, tested), options.draws, options.seed));
    });
    Significance significance = test.result();
    finding_.last_p = significance.p;
    if (step == 0) {
      finding_.first_p = significance.p;
      finding_.null_model = significance.null_model, finding_.has_of_source = significance.has_of_source;
      finding_.draws = significance.draws;
      finding_.scores = significance.scores;
      finding_.score_names = test.names();
    }
    return significance;
  }

  /// One more effect, or one more part of one; false: nothing predicts what it was not fitted to.
  bool addEffect(double p) {
    auto explanations = compete(found_.context);
    auto chosen = chosenOf(found_.context, explanations);
    if (!chosen) return false;
    if (const auto along = alongOne(found_.context, explanations, *chosen)) chosen = along;
    if (mayBeCrossed(explanations[*chosen]))
      if (const auto crossed = crossedShape(found_.context, explanations, *chosen)) chosen = crossed;
    if (const auto of_light = lightShape(found_.context, explanations, *chosen)) chosen = of_light;
    Effect effect = effectOf(found_.context, explanations, *chosen);
    if (!effect.predicts || isWhatACurveLeaves(found_, effect)) return false;
    if (const auto part = partOfAKnown(found_, explanations, effect)) {
      Effect more = effectOf(found_.context, explanations, *part);
      if (more.predicts) effect = std::move(more);
    }
    if (const auto doubtful = nameInDoubt(found_, effect)) {
      // What a right name leaves by chance, or for being right to some per cent, is no reason to doubt it.
      const double enough = std::max(2.0 * effect.gain.error, 0.02 * found_.effects[*doubtful].gain.mean);
      if (effect.gain.mean < enough) return false;
      withdraw(*doubtful);
      return true;
    }
    settle(found_, effect);
    effect.p = p;
    const auto same = std::ranges::find_if(found_.effects, [&](const Effect& known) {
      return goAlongTheSame(found_.context, known, effect) && known.is_catalogue == effect.is_catalogue &&
             !known.fit && !effect.fit;
    });
    if (same == found_.effects.end()) {
      found_.effects.push_back(std::move(effect));
      include(found_);
    } else if (effect.is_catalogue) {
      return false;
    } else {
      reshape(found_, *same, effect);
    }
    estimate(*found_.context.source, found_.context.scales, found_.effects);
    return true;
  }

  /// Tables have pairs enough. And what a much stronger effect leaves goes with all that the stronger one goes with.
  bool mayBeCrossed(const Explanation& one) const {
    return found_.context.original->named() != nullptr &&
           std::ranges::none_of(found_.effects, [&](const Effect& known) {
             return one.gain.total < kRest * known.gain.mean;
           });
  }

  /// The name goes, and its effect is looked for anew.
  void withdraw(std::size_t place) {
    found_.context.withdrawn.push_back(found_.effects[place].name);
    found_.effects.erase(found_.effects.begin() + static_cast<std::ptrdiff_t>(place));
    include(found_);
    estimate(*found_.context.source, found_.context.scales, found_.effects);
  }

  double dispersionNow() const {
    const Marginal marginal =
        marginalise(evidenceOf(found_.context, found_.context.known), found_.context.scales);
    return fit(marginal, modelOf(found_.context, marginal, found_.context.known.size())).dispersion();
  }

  FinderOptions options_;
  Found found_;
  Finding finding_;
};

}  // namespace

Finding find(const RowSource& source, const FinderOptions& options) { return Search{source, options}.run(); }

}  // namespace toftwin::discover
