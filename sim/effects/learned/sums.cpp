// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned/sums.h"

#include <algorithm>
#include <utility>

#include "sim/effects/learned/covariates.h"

namespace toftwin::sim {
namespace {

terms::ImageTerms readied(const std::vector<terms::Term>& alike, int width, int height, const Conditions& now) {
  terms::ImageTerms sum{alike, width, height, [&](std::string_view name) { return fieldOf(name, now); }};
  sum.setFrame([&](std::string_view name) { return knownOfFrame(name, now); });
  return sum;
}

}  // namespace

std::vector<CarriedTerms> carriedTermsOf(const std::vector<terms::Term>& all, terms::Quantity quantity, int width,
                                         int height, const Conditions& now) {
  std::vector<std::vector<terms::Term>> groups;
  for (const terms::Term& term : all) {
    if (term.quantity != quantity) continue;
    const auto group = std::ranges::find_if(groups, [&](const auto& one) {
      return one.front().carrier == term.carrier && one.front().carried == term.carried;
    });
    if (group == groups.end()) groups.push_back({term});
    else group->push_back(term);
  }
  std::vector<CarriedTerms> ready;
  for (const auto& group : groups)
    ready.push_back({group.front().carrier, group.front().carried, readied(group, width, height, now)});
  return ready;
}

std::optional<terms::ImageTerms> plainTermsOf(const std::vector<terms::Term>& all, terms::Quantity quantity, int width,
                                              int height, const Conditions& now) {
  for (CarriedTerms& group : carriedTermsOf(all, quantity, width, height, now))
    if (group.carrier == terms::Carrier::One) return std::move(group.sum);
  return std::nullopt;
}

}  // namespace toftwin::sim
