// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/captures/temperature_rates.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <Eigen/Dense>
#include <fmt/format.h>
#include <toftwin/nan.h>

namespace toftwin::discover {
namespace {

struct TimedReading {
  double time_s = 0.0, c = 0.0;
};

/// At `time_s`, in °C a minute.
double slopeAt(std::vector<TimedReading> readings, double time_s) {
  constexpr std::size_t kFewest = 5;
  constexpr double kNear_s = 60.0;
  std::ranges::sort(readings, {}, [&](const TimedReading& one) { return std::abs(one.time_s - time_s); });
  std::size_t count = std::min(kFewest, readings.size());
  while (count < readings.size() && std::abs(readings[count].time_s - time_s) < kNear_s) ++count;
  Eigen::MatrixXd powers(static_cast<Eigen::Index>(count), 3);
  Eigen::VectorXd degrees(static_cast<Eigen::Index>(count));
  for (Eigen::Index i = 0; i < degrees.size(); ++i) {
    const TimedReading& one = readings[static_cast<std::size_t>(i)];
    const double minutes = (one.time_s - time_s) / 60.0;
    powers.row(i) << 1.0, minutes, minutes * minutes;
    degrees[i] = one.c;
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solved{powers};
  return count < kFewest || solved.rank() < 3 ? kNaN : solved.solve(degrees)[1];
}

/// In the order of the captures: the camera was switched off wherever the time since it was switched on falls.
std::vector<int> powerCyclesOf(const std::vector<MeasuredCapture>& captures) {
  std::vector<int> cycles;
  double last_s = -1.0;
  for (const MeasuredCapture& capture : captures) {
    const auto& since = capture.moment.since_power_on;
    const double time_s = since ? since->in(second) : last_s;
    cycles.push_back((cycles.empty() ? 0 : cycles.back()) + (time_s < last_s ? 1 : 0));
    last_s = time_s;
  }
  return cycles;
}

}  // namespace

std::vector<std::vector<TemperatureRate>> temperatureRates(const std::vector<MeasuredCapture>& captures) {
  const std::vector<int> cycles = powerCyclesOf(captures);
  std::map<std::string, std::map<int, std::vector<TimedReading>>> of_place;
  for (std::size_t c = 0; c < captures.size(); ++c) {
    const auto& since = captures[c].moment.since_power_on;
    for (const NamedTemperature& one : captures[c].moment.temperatures)
      if (since && one.where != "room")
        of_place[one.where][cycles[c]].push_back({since->in(second), one.value.in(celsius)});
  }
  std::vector<std::vector<TemperatureRate>> all(captures.size());
  for (std::size_t c = 0; c < captures.size(); ++c) {
    const auto& since = captures[c].moment.since_power_on;
    for (auto& [where, of_cycle] : of_place)
      all[c].push_back({fmt::format("{}{}", kRatePrefix, where),
                        since ? slopeAt(of_cycle[cycles[c]], since->in(second)) : kNaN});
  }
  return all;
}

}  // namespace toftwin::discover
