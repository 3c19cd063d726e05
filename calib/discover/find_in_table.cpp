// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/find_in_table.h"

#include <algorithm>

namespace toftwin::discover {
namespace {

std::vector<Term> allTermsOf(const Finding& finding) {
  std::vector<Term> all;
  for (const Effect& effect : finding.effects)
    for (Term& term : termsOf(effect)) all.push_back(std::move(term));
  return all;
}

std::vector<std::string> namesOf(const Finding& finding) {
  std::vector<std::string> names;
  for (const Effect& effect : finding.effects) names.push_back(effect.name);
  std::ranges::sort(names);
  return names;
}

}  // namespace

Finding findInTable(TableSource& source, FinderOptions options) {
  options.has_straight_pairs = true;
  Finding finding = find(source, options);
  const double first_p = finding.first_p;
  for (int round = 0; round < 2 && !finding.effects.empty(); ++round) {
    const double before = source.noise().typical;
    source.learn(allTermsOf(finding));
    const bool is_quieter = source.noise().typical < 0.97 * before;
    Finding again = find(source, options);
    const bool is_same = namesOf(again) == namesOf(finding);
    // The decision that there is something was the first test's, and is not taken back or repeated.
    if (again.effects.empty()) break;
    finding = std::move(again);
    finding.first_p = first_p;
    if (is_same && !is_quieter) break;
  }
  return finding;
}

}  // namespace toftwin::discover
