// SPDX-License-Identifier: Apache-2.0
#include <toftwin/units.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/sensor/sensor_model_impl.h"

namespace toftwin::sim {
namespace {

/// A factory's table g of seen cycles over one turn, and on with the turns before and after it.
double tableAt(const std::vector<float>& table, double seen) {
  const double turn = std::floor(seen), last = static_cast<double>(table.size() - 1);
  const double at = (seen - turn) * last, below = std::min(std::floor(at), last - 1.0);
  const auto i = static_cast<std::size_t>(below);
  const double low = static_cast<double>(table[i]), high = static_cast<double>(table[i + 1]);
  return turn + std::lerp(low, high, at - below);
}

/// ½ g″/g′² where the table gives `cycles`, up to whole turns.
double shiftAt(const std::vector<float>& table, double cycles) {
  constexpr double kStep =
      1.0 / 128.0;  // of a turn: entries are single-precision, waves of an eighth or longer
  const double first = static_cast<double>(table.front());
  const double within = first + (cycles - first - std::floor(cycles - first));
  const auto above = std::upper_bound(table.begin(), table.end() - 1, static_cast<float>(within));
  const double seen = static_cast<double>(above - table.begin()) / static_cast<double>(table.size() - 1);
  const double before = tableAt(table, seen - kStep), here = tableAt(table, seen),
               behind = tableAt(table, seen + kStep);
  const double slope = (behind - before) / (2.0 * kStep),
               bend = (behind - 2.0 * here + before) / (kStep * kStep);
  return 0.5 * bend / (slope * slope);
}

}  // namespace

double SensorModel::noiseShiftPerVariance(Length range) const {
  double per_m = 0.0;
  for (std::size_t f = 0; f < impl_->decoder.true_cycles.size(); ++f) {
    const double turn_m =
        impl_->decoder.speed_of_light / (2.0 * impl_->file.modulations[f].frequency.in(hertz));
    per_m += shiftAt(impl_->decoder.true_cycles[f], range.in(metre) / turn_m) / turn_m;
  }
  return per_m;
}

}  // namespace toftwin::sim
