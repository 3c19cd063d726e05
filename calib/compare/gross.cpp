// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/gross.h"

#include <algorithm>
#include <utility>

#include "calib/compare/statistics.h"

namespace toftwin::compare {

double middleOfCut_mm(std::span<const double> difference_mm, std::vector<double> noise_mm) {
  const double sigma_mm = quantile(std::move(noise_mm), 0.5);
  if (!(sigma_mm > kNoisy_mm)) return 0.0;
  const double middle_mm = meanWithin(difference_mm, kGross_mm);
  const double uncertain_mm = sigma_mm / std::sqrt(static_cast<double>(difference_mm.size()));
  return std::abs(middle_mm) <= std::min(kGross_mm, 0.5 * kGross_mm + 3.0 * uncertain_mm) ? middle_mm : 0.0;
}

}  // namespace toftwin::compare
