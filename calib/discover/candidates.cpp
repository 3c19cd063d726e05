// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/candidates.h"

#include <algorithm>
#include <array>
#include <limits>

#include <fmt/format.h>

namespace toftwin::discover {
namespace {

constexpr std::size_t kStraightColumns = 7;  ///< a number in each of four states

bool isOneOfFew(const CovariateInfo& covariate) {
  return !covariate.levels.empty() && covariate.levels.size() <= kSurfaceKnots;
}

Term one(const CovariateInfo& covariate, Basis basis, std::vector<double> numbers) {
  return {{factorOf(covariate.name, basis, std::move(numbers))}, covariate.stage};
}

/// Places of knots: each level, or quantiles, each once.
std::vector<double> knotsOf(const CovariateInfo& covariate, std::size_t count) {
  std::vector<double> knots;
  if (isOneOfFew(covariate) || (!covariate.levels.empty() && covariate.levels.size() <= count)) return covariate.levels;
  const auto& q = covariate.quantiles;
  if (q.empty()) return knots;
  for (std::size_t i = 0; i < count; ++i) {
    const double place = static_cast<double>(i * (q.size() - 1)) / static_cast<double>(count - 1);
    const auto below = std::min(static_cast<std::size_t>(place), q.size() - 1);
    const double part = place - static_cast<double>(below);
    const double above = q[std::min(below + 1, q.size() - 1)];
    knots.push_back(q[below] + part * (above - q[below]));
  }
  knots.erase(std::ranges::unique(knots).begin(), knots.end());
  return knots;
}

/// Hats that add up to 1.
std::vector<Term> completeBasis(const CovariateInfo& covariate, std::size_t count) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::vector<Term> terms;
  const auto knots = knotsOf(covariate, count);
  for (std::size_t i = 0; i < knots.size(); ++i)
    terms.push_back(one(covariate, Basis::Hat, {i == 0 ? -kFar : knots[i - 1], knots[i], i + 1 < knots.size() ? knots[i + 1] : kFar}));
  return terms;
}

TermGroup waves(const CovariateInfo& covariate, int least, int most) {
  TermGroup group{fmt::format("{} to {} waves over {}", least, most, covariate.name), Kind::Generic, {}, 0};
  const double span = covariate.quantiles.back() - covariate.quantiles.front();
  for (int k = least; k <= most; ++k) {
    group.terms.push_back(one(covariate, Basis::Sine, {span / k}));
    group.terms.push_back(one(covariate, Basis::Cosine, {span / k}));
  }
  return group;
}

/// Harmonics of the modulation whose size changes straight with another covariate.
TermGroup harmonicsTimes(const CovariateInfo& distance, const CovariateInfo& other) {
  std::vector<Term> harmonics;
  for (const int k : {1, 2, 4, 8}) {
    for (const Basis basis : {Basis::Sine, Basis::Cosine})
      harmonics.push_back(one(distance, basis, {distance.period / k}));
  }
  return {fmt::format("harmonics over {} that change with {}", distance.name, other.name), Kind::Generic,
          products(harmonics, completeBasis(other, 2)), 0};
}

TermGroup parity(const CovariateInfo& covariate, int modulus) {
  TermGroup group{fmt::format("{} modulo {}", covariate.name, modulus), Kind::Generic, {}, 0};
  for (int r = 1; r < modulus; ++r)
    group.terms.push_back(
        one(covariate, Basis::Class, {static_cast<double>(modulus), static_cast<double>(r)}));
  return group;
}

bool varies(const CovariateInfo& covariate) {
  return !covariate.quantiles.empty() && covariate.quantiles.back() > covariate.quantiles.front();
}

/// A place of the image with what a pixel sees there: what a lens or the camera's sides change.
bool isPlaceAndSignal(const CovariateInfo& a, const CovariateInfo& b) {
  const auto isSignal = [](const CovariateInfo& x) { return x.word == "range" || x.word == "amplitude"; };
  return (a.word == "position" && isSignal(b)) || (b.word == "position" && isSignal(a));
}

/// Pairs that may act together, the likelier ones first: a state of the camera with a place or a pixel's signal,
/// then two of the pixel's, a place before others, then two states.
std::vector<std::pair<std::size_t, std::size_t>> pairsOf(std::span<const CovariateInfo> covariates,
                                                         const CandidateOptions& options) {
  std::array<std::vector<std::pair<std::size_t, std::size_t>>, 4> ranks;
  for (std::size_t j = 1; j < covariates.size(); ++j) {
    for (std::size_t i = 0; i < j; ++i) {
      const CovariateInfo &a = covariates[i], &b = covariates[j];
      if (!varies(a) || !varies(b)) continue;
      if (isByItself(a) || isByItself(b)) continue;
      const bool are_alike = a.is_of_capture == b.is_of_capture;
      ranks[!are_alike ? 0 : a.is_of_capture ? 3 : isPlaceAndSignal(a, b) ? 1 : 2].emplace_back(i, j);
    }
  }
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t rank = 0; rank < ranks.size(); ++rank) {
    const std::size_t most = rank == 0 ? options.most_state_pairs : options.most_pairs;
    for (const auto& pair : ranks[rank])
      if (pairs.size() < most) pairs.push_back(pair);
  }
  return pairs;
}

}  // namespace

bool isByItself(const CovariateInfo& covariate) {
  return covariate.nature == Nature::Index || covariate.nature == Nature::Rate || covariate.nature == Nature::Share;
}

std::vector<Term> products(const std::vector<Term>& a, const std::vector<Term>& b) {
  std::vector<Term> all;
  for (const Term& left : a) {
    for (const Term& right : b) {
      Term both = left;
      both.factors.insert(both.factors.end(), right.factors.begin(), right.factors.end());
      all.push_back(std::move(both));
    }
  }
  return all;
}

TermGroup smoothIn(const CovariateInfo& covariate, std::size_t knots) {
  const bool is_straight = covariate.nature == Nature::Rate;
  TermGroup group{fmt::format("{} in {}", is_straight ? "straight" : "smooth", covariate.name), Kind::Generic,
                  completeBasis(covariate, is_straight ? 2 : knots), 0};
  if (!group.terms.empty()) group.terms.erase(group.terms.begin());
  return group;
}

TermGroup smoothIn(const CovariateInfo& a, const CovariateInfo& b, std::size_t knots) {
  TermGroup group{fmt::format("smooth in {} and {}", a.name, b.name), Kind::Generic,
                  products(completeBasis(a, knots), completeBasis(b, knots)), 0};
  if (!group.terms.empty()) group.terms.erase(group.terms.begin());
  return group;
}

std::vector<TermGroup> genericCandidates(std::span<const CovariateInfo> covariates,
                                         const CandidateOptions& options) {
  std::vector<TermGroup> groups;
  const std::size_t knots = std::clamp<std::size_t>(options.captures / 5, 4, kSmoothKnots);
  for (const CovariateInfo& covariate : covariates) {
    if (!varies(covariate)) continue;
    groups.push_back(smoothIn(covariate, knots));
    if (covariate.nature == Nature::Index) {
      for (const int modulus : {2, 3, 4}) groups.push_back(parity(covariate, modulus));
    }
    const bool is_continuous = covariate.levels.empty();
    if (!is_continuous || isByItself(covariate)) continue;
    if (options.captures >= 20) groups.push_back(waves(covariate, 1, 4));
    if (options.captures >= 40) groups.push_back(waves(covariate, 5, 10));
    if (options.captures >= 60) groups.push_back(waves(covariate, 11, 20));
  }
  for (const auto& [i, j] : pairsOf(covariates, options)) {
    if (options.has_straight_pairs && options.captures >= 12) {
      TermGroup straight = smoothIn(covariates[i], covariates[j], 2);
      straight.name = fmt::format("straight in {} and {}", covariates[i].name, covariates[j].name);
      if (straight.terms.size() <= kStraightColumns) groups.push_back(std::move(straight));
    }
    if (options.captures >= 30) groups.push_back(smoothIn(covariates[i], covariates[j], kSurfaceKnots));
    for (const auto& [distance, other] : {std::pair{i, j}, std::pair{j, i}}) {
      if (options.captures >= 60 && covariates[distance].period > 0.0 && !isOneOfFew(covariates[other]))
        groups.push_back(harmonicsTimes(covariates[distance], covariates[other]));
    }
  }
  return groups;
}

}  // namespace toftwin::discover
