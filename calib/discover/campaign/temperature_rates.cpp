// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/temperature_rates.h"

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

}  // namespace

std::vector<std::vector<TemperatureRate>> temperatureRates(const std::vector<MeasuredCapture>& captures) {
  std::map<std::string, std::vector<TimedReading>> of_place;
  for (const MeasuredCapture& capture : captures) {
    if (!capture.moment.since_power_on) continue;
    for (const NamedTemperature& one : capture.moment.temperatures)
      if (one.where != "room")
        of_place[one.where].push_back({capture.moment.since_power_on->in(second), one.value.in(celsius)});
  }
  std::vector<std::vector<TemperatureRate>> all(captures.size());
  for (std::size_t c = 0; c < captures.size(); ++c) {
    const auto& since = captures[c].moment.since_power_on;
    for (const auto& [where, readings] : of_place)
      all[c].push_back({fmt::format("{}{}", kRatePrefix, where), since ? slopeAt(readings, since->in(second)) : kNaN});
  }
  return all;
}

}  // namespace toftwin::discover
