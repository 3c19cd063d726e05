// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/captures/amplitude_unit.h"

#include <cmath>
#include <utility>

#include "calib/compare/statistics.h"
#include "calib/discover/campaign/captures/light_delay.h"
#include "calib/discover/campaign/captures/reading.h"

namespace toftwin::discover {

Result<double> unitOf(const Declared& declared, const std::vector<MeasuredCapture>& captures,
                      const std::vector<std::shared_ptr<const TracedCapture>>& traced) {
  const auto camera = NoiselessCamera::make(declared.model, declaredEffects(declared), captures);
  if (!camera) return camera.error();
  std::vector<double> middles;
  for (std::size_t c = 0; c < captures.size(); ++c) {
    const Image<float>& measured = captures[c].log_amplitude.mean;
    if (measured.empty()) continue;
    const Image<float> own = camera->read(captures[c], traced[c]->light).log_amplitude;
    std::vector<double> larger;
    for (std::size_t i = 0; i < own.size(); ++i)
      if (std::isfinite(measured[i] - own[i])) larger.push_back(static_cast<double>(measured[i] - own[i]));
    if (!larger.empty()) middles.push_back(compare::quantile(std::move(larger), 0.5));
  }
  return middles.empty() ? 0.0 : 100.0 * compare::quantile(std::move(middles), 0.5);
}

void takeUnitOff(double unit_percent, std::vector<MeasuredCapture>& captures) {
  const auto off = static_cast<float>(0.01 * unit_percent);
  for (MeasuredCapture& capture : captures)
    for (float& log : capture.log_amplitude.mean.pixels()) log -= off;
}

}  // namespace toftwin::discover
