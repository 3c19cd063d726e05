// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/find_in_table.h"

#include <algorithm>
#include <cmath>

#include "calib/discover/estimate.h"

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

/// Of a curve without a formula over the reference and a gain, which part is whose is not in the data: waves with the
/// gain that suits them best are no gain of the camera. The curve takes it, with a straight line of its own.
void takeGain(const TableSource& source, Finding& finding) {
  const std::string& reference = source.data().reference_name;
  const auto gain = std::ranges::find(finding.nuisances, "gain", &Estimate::name);
  if (gain == finding.nuisances.end() || std::isnan(gain->error)) return;
  for (Effect& effect : finding.effects) {
    for (FittedForm& part : effect.parts) {
      if (part.form.build != nullptr || covariatesOf(part.group) != std::vector{reference}) continue;
      part.group.terms.push_back({{{reference, Shape::Power, {1.0}}}, effect.stage});
      finding.nuisances = estimate(source, finding.scales, finding.effects);
      return;
    }
  }
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
  takeGain(source, finding);
  return finding;
}

}  // namespace toftwin::discover
