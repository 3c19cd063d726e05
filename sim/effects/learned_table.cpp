// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned_table.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include <toftwin/nan.h>

#include "sim/effects/temperature.h"
#include "sim/images/box_mean.h"

namespace toftwin::sim {
namespace {

/// The knot at or before x, and how far x is to the next; constant beyond the ends.
struct Place {
  std::size_t below = 0, above = 0;
  double share = 0.0;
};
Place placeIn(const std::vector<double>& knots, double x) {
  if (knots.size() < 2 || x <= knots.front()) return {};
  if (x >= knots.back()) return {knots.size() - 1, knots.size() - 1, 0.0};
  const auto next = static_cast<std::size_t>(std::ranges::upper_bound(knots, x) - knots.begin());
  return {next - 1, next, (x - knots[next - 1]) / (knots[next] - knots[next - 1])};
}

}  // namespace

double ofFrame(LearnedOver over, const Moment& moment) {
  const auto degrees = [&](std::string_view name) {
    const auto temperature = temperatureOf(moment, name);
    return temperature ? temperature->in(celsius) : kNaN;
  };
  switch (over) {
    case LearnedOver::Nothing:
      return 0.0;
    case LearnedOver::Time:
      return moment.since_power_on ? moment.since_power_on->in(second) : kNaN;
    case LearnedOver::Illumination:
      return degrees("illumination");
    case LearnedOver::Sensor:
      return degrees("sensor");
    case LearnedOver::Ambient:
      return moment.ambient ? moment.ambient->in(kilolux) : kNaN;
    case LearnedOver::Exposure:
      return moment.exposures.empty() ? kNaN : moment.exposures.front().duration.in(microsecond);
    default:
      return kNaN;
  }
}

double ofPlace(LearnedOver over, const Conditions& now, int x, int y) {
  const int column = now.left + x, row = now.top + y;
  if (over == LearnedOver::Column) return column;
  if (over == LearnedOver::Row) return row;
  if (over == LearnedOver::Radius) return std::hypot(column - now.camera.cx, row - now.camera.cy);
  return kNaN;
}

double incidenceAt(const CameraInfo& camera, const Vec3f& normal, int x, int y) {
  const Vec3d ray = rayThroughPixel(camera, x, y).v;
  const double cosine = -(ray.x * static_cast<double>(normal.x) + ray.y * static_cast<double>(normal.y) +
                          ray.z * static_cast<double>(normal.z));
  return 1.0 / std::max(0.05, cosine);
}

Image<float> surroundings(const Image<float>& amplitude, int reach) {
  Image<float> ratio = boxMean(amplitude, reach);
  for (std::size_t i = 0; i < ratio.size(); ++i)
    ratio[i] = amplitude[i] > 0.0F ? std::log(ratio[i] / amplitude[i]) : kNaN;
  return ratio;
}

int reachOf(LearnedOver surround, int width, int height) {
  if (surround == LearnedOver::Surround4) return 4;
  return surround == LearnedOver::Surround16 ? 16 : std::max(width, height);
}

bool LearnedKnots::ascend() const {
  const auto ascends = [](const std::vector<double>& knots) {
    return std::ranges::adjacent_find(knots, std::greater_equal<>{}) == knots.end();
  };
  return ascends(x) && ascends(y);
}

double LearnedKnots::valueIn(const std::vector<double>& table, double at_x, double at_y) const {
  if (x.empty() || table.empty()) return 0.0;
  if (std::isnan(at_x) || std::isnan(at_y)) return kNaN;
  const Place i = placeIn(x, at_x), j = placeIn(y, at_y);
  const std::size_t stride = std::max<std::size_t>(1, y.size());
  const auto along_y = [&](std::size_t row) {
    return std::lerp(table[row * stride + j.below], table[row * stride + j.above], j.share);
  };
  return std::lerp(along_y(i.below), along_y(i.above), i.share);
}

std::string problemOf(const LearnedKnots& knots, LearnedOver over, LearnedOver and_over,
                      std::pair<std::string_view, const std::vector<double>&> offsets,
                      const std::vector<double>& gains_percent) {
  if (!knots.ascend()) return "must have knots and and_knots that ascend";
  if ((and_over == LearnedOver::Nothing) != knots.y.empty())
    return "has and_over without and_knots, or and_knots without and_over";
  const std::size_t needed = knots.x.size() * std::max<std::size_t>(1, knots.y.size());
  const auto isWrong = [&](const std::vector<double>& table) {
    return !table.empty() && table.size() != needed;
  };
  const auto& [key, table] = offsets;
  const bool is_gain = !isWrong(table) && isWrong(gains_percent);
  if (isWrong(table) || is_gain || (needed > 0 && table.empty() && gains_percent.empty()))
    return "has " + std::to_string(is_gain ? gains_percent.size() : table.size()) + " " +
           std::string{is_gain ? "gains_percent" : key} + " for " + std::to_string(needed) +
           " knots: one for each, or for each pair of knots and and_knots";
  return over == LearnedOver::Nothing && needed > 0 ? "has knots over nothing: `over` says what they are of"
                                                    : "";
}

}  // namespace toftwin::sim
