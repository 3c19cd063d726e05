// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/finder.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "calib/discover/candidates.h"
#include "calib/discover/estimate.h"
#include "calib/discover/shape_choice.h"

namespace toftwin::discover {
namespace {

constexpr int kMostParts = 8;  ///< over all effects

class Search {
 public:
  Search(const RowSource& source, const FinderOptions& options) : options_(options) {
    // The caller keeps it.
    context_.original = context_.source = std::shared_ptr<const RowSource>{std::shared_ptr<void>{}, &source};
    context_.covariates = source.covariates();
    context_.test = {options.null_model, options.draws, options.seed};
    context_.alpha = options.alpha;
    const std::size_t captures = source.withoutCatalogue({}).captures.size();
    context_.generic = genericCandidates(
        context_.covariates, {.captures = captures, .has_straight_pairs = options.has_straight_pairs});
    for (TermGroup& own : source.ownGroups()) context_.generic.push_back(std::move(own));
  }

  Finding run() {
    for (int step = 0; step < kMostParts; ++step) {
      updateKnown();
      updateScales();
      const Significance significance = testNow(step);
      // The first test has all of alpha; each later one a half, so that all of a run's stay below a few
      // alpha.
      if (significance.p > (step == 0 ? options_.alpha : 0.5 * options_.alpha)) break;
      if (static_cast<int>(finding_.effects.size()) >= options_.most_effects) break;
      if (!addEffect(significance.p)) break;
    }
    if (finding_.effects.size() > 1) {
      revise();
      prune();
      if (context_.original->named() != nullptr) markRests();
    }
    finding_.nuisances = estimate(*context_.source, context_.scales, finding_.effects);
    finding_.scales = context_.scales;
    updateKnown();
    finding_.dispersion = dispersionNow();
    return std::move(finding_);
  }

 private:
  /// Effects' groups and their tangents; catalogue effects are columns of the evidence already.
  void updateKnown() {
    context_.known = groupsOf(finding_.effects);
    for (TermGroup& tangent : tangentsOf(finding_.effects)) context_.known.push_back(std::move(tangent));
    for (std::size_t i = 0; i < context_.known.size(); ++i)
      context_.known[i].name = fmt::format("known {}", i + 1);
    context_.catalogue.clear();
    for (const Effect& effect : finding_.effects) {
      if (effect.is_catalogue && !effect.fit) context_.catalogue.push_back(effect.name);
    }
  }

  /// Scales of random effects, with everything known and, where captures are many, a smooth function of each
  /// covariate projected out: what is an effect must not make poses look worse than they are.
  void updateScales() {
    std::vector<TermGroup> extra = context_.known;
    std::vector<std::string> names;
    for (const TermGroup& known : context_.known) names.push_back(known.name);
    const Evidence plain = context_.source->withoutCatalogue({});
    const bool has_random = std::ranges::any_of(plain.groups, [](const Group& group) {
      return group.kind == Kind::PerCapture || group.kind == Kind::Shared;
    });
    if (!has_random) return;
    std::size_t columns = 0, knots = 5;
    for (const CovariateInfo& covariate : context_.covariates)
      columns += smoothIn(covariate, knots).terms.size();
    // Few captures show a slope of each covariate rather than curves of the first ones.
    if (options_.has_straight_pairs && columns > plain.captures.size() / 3) knots = 2;
    columns = 0;
    for (const CovariateInfo& covariate : context_.covariates) {
      TermGroup smooth = smoothIn(covariate, knots);
      columns += smooth.terms.size();
      if (columns > plain.captures.size() / 3) break;
      names.push_back(smooth.name);
      extra.push_back(std::move(smooth));
    }
    context_.scales = estimateScales(context_.catalogue.empty() ? context_.source->withoutCatalogue(extra)
                                                                : context_.source->evidence(extra),
                                     names);
  }

  Significance testNow(int step) {
    Test test{
        {options_.null_model, options_.draws, options_.seed + 1000003U * static_cast<std::uint64_t>(step)}};
    inParts(context_, context_.generic, [&](const Part& part) { test.add(part.marginal, part.model); });
    Significance significance = test.result();
    finding_.last_p = significance.p;
    if (step == 0) {
      finding_.first_p = significance.p;
      finding_.by_sign_flips = significance.by_sign_flips, finding_.draws = significance.draws;
      finding_.odd_captures = significance.odd_captures;
      finding_.scores = significance.scores;
      finding_.score_names = test.names();
    }
    return significance;
  }

  /// One more effect, or one more part of one; false: nothing predicts what it was not fitted to.
  bool addEffect(double p) {
    auto explanations = compete(context_);
    const auto chosen = chosenOf(context_, explanations);
    if (!chosen) return false;
    Effect effect = effectOf(context_, explanations, *chosen);
    if (!holds(effect.gain) || isWhatACurveLeaves(effect)) return false;
    if (const auto part = partOfAKnown(explanations, effect)) {
      Effect more = effectOf(context_, explanations, *part);
      if (holds(more.gain)) effect = std::move(more);
    }
    settle(effect);
    effect.p = p;
    const auto same = std::ranges::find_if(finding_.effects, [&](const Effect& known) {
      return goAlongTheSame(known, effect) && known.is_catalogue == effect.is_catalogue && !known.fit &&
             !effect.fit;
    });
    if (same == finding_.effects.end()) {
      finding_.effects.push_back(std::move(effect));
      include();
    } else if (effect.is_catalogue) {
      return false;
    } else {
      reshape(*same, effect);
    }
    estimate(*context_.source, context_.scales, finding_.effects);
    return true;
  }

  /// One cause, one effect: what cannot be told from more of an effect that is known to first order or as a
  /// curve is more of it, whatever else may explain it as well. Its place among the explanations.
  [[nodiscard]] std::optional<std::size_t> partOfAKnown(const std::vector<Explanation>& explanations,
                                                        const Effect& effect) const {
    const auto isMoreOfAKnown = [&](const Alternative& other) {
      return std::ranges::any_of(finding_.effects, [&](const Effect& known) {
        return !known.is_catalogue && isApproximate(known) &&
               goAlongTheSame(known, Effect{.name = other.name, .covariates = other.covariates});
      });
    };
    for (const Alternative& other : effect.alternatives) {  // the best first
      if (other.group.terms.empty() || !isMoreOfAKnown(other)) continue;
      const auto place = std::ranges::find_if(explanations, [&](const Explanation& one) {
        return !one.is_catalogue && one.name == other.name && one.covariates == other.covariates;
      });
      if (place != explanations.end()) return static_cast<std::size_t>(place - explanations.begin());
    }
    return std::nullopt;
  }

  /// The covariates along which it goes, without what light does there: what moves the range and dims the light
  /// along the same covariate is one effect.
  [[nodiscard]] std::vector<std::string> alongOf(const Effect& effect) const {
    std::vector<std::string> along;
    for (const std::string& name : effect.covariates)
      if (infoOf(context_, name) != nullptr) along.push_back(name);
    return along.empty() ? effect.covariates : along;
  }

  /// What effects of the catalogue call that along which it goes.
  [[nodiscard]] std::set<std::string> wordsOf(const Effect& effect) const {
    std::set<std::string> words;
    for (const std::string& name : alongOf(effect)) {
      const CovariateInfo* info = infoOf(context_, name);
      words.insert(info != nullptr ? info->word : context_.source->wordOfCarrier(name));
    }
    return words;
  }
  /// A carrier without a covariate stands for all that its word means: light from neighbours for how bright the
  /// surroundings are, a pattern of pixels for columns and rows.
  [[nodiscard]] bool goAlongTheSame(const Effect& a, const Effect& b) const {
    const auto along_a = alongOf(a), along_b = alongOf(b);
    if (along_a == along_b) return true;
    const auto isCarrier = [&](const std::vector<std::string>& along) {
      return std::ranges::all_of(along, [&](const std::string& name) { return infoOf(context_, name) == nullptr; });
    };
    return (isCarrier(along_a) || isCarrier(along_b)) && !wordsOf(a).contains("") && wordsOf(a) == wordsOf(b);
  }

  /// Its terms as they are written once they are known. What was estimated from all captures has had its share of
  /// their noise, so that it competes no more.
  void settle(Effect& effect) {
    for (FittedForm& part : effect.parts) {
      for (Term& term : part.group.terms) {
        const std::string carrier = term.carrier;
        term = context_.source->settled(std::move(term));
        if (term.carrier == carrier) continue;
        std::erase_if(context_.generic, [&](const TermGroup& group) {
          return !group.terms.empty() && group.terms.front().carrier == carrier;
        });
      }
    }
  }

  /// A curve without a formula is known to some per cent, since between its knots it is straight, and so is what
  /// light does, since it is added to first order: what little is left beside it is not called another effect.
  static bool isOfLight(const Effect& effect) {
    return std::ranges::any_of(termsOf(effect), [](const Term& term) { return !term.carrier.empty(); });
  }
  bool isWhatACurveLeaves(const Effect& effect) const {
    constexpr double kKnown = 0.05;
    return std::ranges::any_of(finding_.effects, [&](const Effect& known) {
      return !known.is_catalogue && isApproximate(known) && alongOf(known) != alongOf(effect) &&
             effect.gain.mean < kKnown * known.gain.mean;
    });
  }

  static std::optional<std::size_t> chosenOf(const Context& context, std::vector<Explanation>& explanations) {
    fitCatalogue(context, explanations);
    if (const auto named = chooseNamed(context, explanations)) return named;
    return choose(explanations);
  }

  /// Effects that were fitted as themselves are in the source's model from now on.
  void include() {
    context_.included = fitsOf(finding_.effects);
    context_.source = sourceWith(context_.included);
  }
  static std::vector<std::shared_ptr<const NamedFit>> fitsOf(const std::vector<Effect>& effects) {
    std::vector<std::shared_ptr<const NamedFit>> fits;
    for (const Effect& effect : effects)
      if (effect.fit) fits.push_back(effect.fit);
    return fits;
  }
  std::shared_ptr<const RowSource> sourceWith(const std::vector<std::shared_ptr<const NamedFit>>& fits) const {
    if (fits.empty()) return context_.original;
    std::vector<const NamedFit*> plain;
    for (const auto& fit : fits) plain.push_back(fit.get());
    return context_.original->named()->including(plain, true);
  }

  /// The same of some of those that are included.
  std::shared_ptr<const RowSource> sourceOf(const std::vector<std::shared_ptr<const NamedFit>>& some) const {
    return some.size() == context_.included.size() ? context_.source : sourceWith(some);
  }

  /// What is left goes with the covariates of an effect that is known: its shape was not it. Another single
  /// shape, if one does as well as both together; else their sum.
  void reshape(Effect& effect, const Effect& more) {
    if (effect.covariates != more.covariates) return addPart(effect, more);
    std::vector<Effect> others;
    for (const Effect& one : finding_.effects)
      if (&one != &effect) others.push_back(one);
    Context without = context_;
    without.known = groupsOf(others);
    for (TermGroup& tangent : tangentsOf(others)) without.known.push_back(std::move(tangent));
    auto explanations = competeFor(without, effect.covariates);
    const Gain both = gainOfSum(without, effect, more);
    const auto chosen = choose(explanations);
    if (chosen) {
      const Difference worse = difference(both, explanations[*chosen].gain);
      if (both.total - explanations[*chosen].gain.total < worse.error) {
        Effect again = effectOf(without, explanations, *chosen);
        settle(again);
        again.p = effect.p;
        effect = std::move(again);
        return;
      }
    }
    addPart(effect, more);
  }

  static void addPart(Effect& effect, const Effect& more) {
    effect.parts.insert(effect.parts.end(), more.parts.begin(), more.parts.end());
    for (const std::string& name : more.covariates)
      if (std::ranges::count(effect.covariates, name) == 0) effect.covariates.push_back(name);
    std::ranges::sort(effect.covariates);
    // No effect on ranges changes amplitudes.
    if (effect.stage != more.stage) effect.stage = Stage::Light;
    const std::string along = fmt::format("{}", fmt::join(effect.covariates, " and "));
    effect.name = isFormula(effect) ? effect.name + " + " + more.name : "smooth in " + along;
  }

  static Evidence evidenceOf(const Context& context, std::span<const TermGroup> extra) {
    return context.catalogue.empty() ? context.source->withoutCatalogue(extra)
                                     : context.source->evidence(extra);
  }

  static Gain gainOfSum(const Context& without, const Effect& effect, const Effect& more) {
    TermGroup sum{"sum", Kind::Generic, termsOf(effect), 0};
    for (const Term& term : termsOf(more)) sum.terms.push_back(term);
    std::vector<TermGroup> extra = without.known;
    extra.push_back(std::move(sum));
    const Marginal marginal = marginalise(evidenceOf(without, extra), without.scales);
    const Columns model = modelOf(without, marginal, extra.size());
    Gain gain = crossValidate(marginal, model, {marginal.groups.size() - 1}).front();
    for (const std::vector<FittedForm>* parts : {&effect.parts, &more.parts})
      for (const FittedForm& part : *parts)
        for (const Inner& inner : part.form.inner) gain.total -= inner.price;
    return gain;
  }

  /// Each effect's shape once more, now that the others no longer stand in its way.
  void revise() {
    for (Effect& effect : finding_.effects) {
      if (effect.is_catalogue || effect.parts.size() != 1) continue;
      std::vector<Effect> others;
      for (const Effect& one : finding_.effects)
        if (&one != &effect) others.push_back(one);
      Context without = context_;
      without.known = groupsOf(others);
      for (TermGroup& tangent : tangentsOf(others)) without.known.push_back(std::move(tangent));
      // What else it could be, too: until now the other effects were among its rivals.
      std::erase_if(effect.alternatives, [&](const Alternative& other) {
        return std::ranges::find(others, other.covariates, &Effect::covariates) != others.end();
      });
      if (effect.alternatives.empty()) effect.experiment.reset();
      auto explanations = compete(without);
      const auto chosen = chosenOf(without, explanations);
      if (!chosen) continue;
      const Explanation& now = explanations[*chosen];
      if (now.is_catalogue ? !now.named : now.covariates != effect.covariates) continue;
      Effect again = effectOf(without, explanations, *chosen);
      settle(again);
      again.p = effect.p;
      effect = std::move(again);
      if (effect.fit) include();
    }
  }

  /// An effect that the others explain as well was a step on the way to them: it goes, the least useful
  /// first.
  void prune() {
    while (finding_.effects.size() > 1) {
      std::size_t least = finding_.effects.size();
      double smallest = 2.0;
      for (std::size_t i = 0; i < finding_.effects.size(); ++i) {
        if (finding_.effects[i].is_catalogue && !finding_.effects[i].fit) continue;
        const Difference gain = against0(gainBeside(i, {i}));
        const double z = gain.mean / std::max(gain.error, 1e-9);
        if (gain.mean < 4.0 || z < smallest) smallest = std::min(z, smallest), least = i;
      }
      if (least == finding_.effects.size()) return;
      finding_.effects.erase(finding_.effects.begin() + static_cast<std::ptrdiff_t>(least));
      include();
    }
  }

  /// One cause, one effect. A form without a name describes its cause to first order and along its own
  /// covariates alone. What that leaves goes with something else, and needs no cause of its own while it is
  /// less than a quarter of what the form explains and both share a part: it stays in the model, as the rest
  /// of that effect. An effect that is named for certain describes itself, and leaves nothing.
  void markRests() {
    constexpr double kRest = 0.25;
    std::vector<double> gains;
    for (std::size_t i = 0; i < finding_.effects.size(); ++i) {
      const Effect& effect = finding_.effects[i];
      gains.push_back(effect.is_catalogue && !effect.fit ? effect.gain.mean : gainBeside(i, {i}).total);
    }
    for (std::size_t i = 0; i < gains.size(); ++i) {
      for (std::size_t k = 0; k < gains.size(); ++k) {
        if (i == k || !mayBeUndeclared(finding_.effects[i]) || !isApproximate(finding_.effects[k])) continue;
        if (gains[i] < kRest * gains[k] && shareAPart(i, k)) finding_.effects[i].is_rest = true;
      }
    }
    std::ranges::stable_sort(finding_.effects, {}, &Effect::is_rest);  // behind what they are the rest of
  }

  static bool mayBeUndeclared(const Effect& effect) {
    return !effect.is_catalogue || std::ranges::any_of(effect.alternatives, [](const Alternative& other) {
      return !other.group.terms.empty();
    });
  }
  /// A curve, what light does to first order, or a name that is not certain.
  static bool isApproximate(const Effect& effect) {
    return effect.is_catalogue ? mayBeUndeclared(effect) : !isFormula(effect) || isOfLight(effect);
  }

  /// Whether much of the weaker one's curve is the stronger one's, too, whatever its sign: more of it, ρ², than
  /// covariates that have nothing to do with each other have over so many captures, |ρ| > 2/√n. What has a
  /// cause of its own goes its own way.
  [[nodiscard]] bool shareAPart(std::size_t weaker, std::size_t stronger) const {
    std::vector<Effect> others;
    for (std::size_t i = 0; i < finding_.effects.size(); ++i)
      if (i != weaker && i != stronger) others.push_back(finding_.effects[i]);
    Context beside = context_;
    beside.known = groupsOf(others);
    beside.source = sourceOf(fitsOf(others));
    const double shared =
        correlationOf(beside, curveOf(finding_.effects[weaker]), curveOf(finding_.effects[stronger]));
    const auto captures = static_cast<double>(beside.source->withoutCatalogue({}).captures.size());
    return shared * shared * captures > 4.0;
  }
  /// Its terms; of an effect of the catalogue those of the curve that it is not told from.
  static TermGroup curveOf(const Effect& effect) {
    TermGroup curve{effect.name, Kind::Generic, termsOf(effect), 0};
    for (const Alternative& other : effect.alternatives)
      if (curve.terms.empty()) curve = other.group;
    return curve;
  }

  /// What an effect explains of held-out captures beside all but those at `without`.
  [[nodiscard]] Gain gainBeside(std::size_t which, const std::set<std::size_t>& without) const {
    std::vector<Effect> others;
    for (std::size_t i = 0; i < finding_.effects.size(); ++i)
      if (!without.contains(i)) others.push_back(finding_.effects[i]);
    Context beside = context_;
    beside.known = groupsOf(others);
    auto fits = fitsOf(others);
    beside.source = sourceOf(fits);
    const Effect& effect = finding_.effects[which];
    if (effect.fit) {
      const auto left = [&](const RowSource& source) {
        const Marginal marginal = marginalise(source.withoutCatalogue(beside.known), beside.scales);
        return heldOut(marginal, modelOf(beside, marginal, beside.known.size()));
      };
      const auto before = left(*beside.source);
      fits.push_back(effect.fit);
      return gainOf(before, left(*sourceOf(fits)));
    }
    std::vector<TermGroup> extra = beside.known;
    extra.push_back({"this", Kind::Generic, termsOf(effect), 0});
    const Marginal marginal = marginalise(evidenceOf(beside, extra), beside.scales);
    return crossValidate(marginal, modelOf(beside, marginal, extra.size()), {marginal.groups.size() - 1})
        .front();
  }

  double dispersionNow() const {
    const Marginal marginal =
        marginalise(context_.catalogue.empty() ? context_.source->withoutCatalogue(context_.known)
                                               : context_.source->evidence(context_.known),
                    context_.scales);
    return fit(marginal, modelOf(context_, marginal, context_.known.size())).dispersion();
  }

  FinderOptions options_;
  Context context_;
  Finding finding_;
};

}  // namespace

std::vector<Term> termsOf(const Effect& effect) {
  std::vector<Term> terms;
  for (const FittedForm& part : effect.parts)
    terms.insert(terms.end(), part.group.terms.begin(), part.group.terms.end());
  return terms;
}

bool isFormula(const Effect& effect) {
  return !effect.parts.empty() &&
         std::ranges::all_of(effect.parts, [](const FittedForm& part) { return part.form.build != nullptr; });
}

Finding find(const RowSource& source, const FinderOptions& options) { return Search{source, options}.run(); }

}  // namespace toftwin::discover
