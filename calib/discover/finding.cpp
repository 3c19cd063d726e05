// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/finding.h"

#include <algorithm>

namespace toftwin::discover {

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

}  // namespace toftwin::discover
