// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned_range.h"

#include <algorithm>
#include <cmath>

#include <toftwin/nan.h>

#include "sim/effects/temperature.h"
#include "sim/images/rows.h"

namespace toftwin::sim {
namespace {

bool ascends(const std::vector<double>& knots) {
  return std::ranges::adjacent_find(knots, std::greater_equal<>{}) == knots.end();
}

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

/// A covariate of one frame's pixels: either the same for all, or by pixel.
class Along {
 public:
  Along(LearnedRange::Over over, const RangeImage& image, const Conditions& now)
      : over_(over), image_(image), now_(now) {
    const Moment& moment = now.moment;
    const auto degrees = [&](std::string_view name) {
      const auto temperature = temperatureOf(moment, name);
      return temperature ? temperature->in(celsius) : kNaN;
    };
    using Over = LearnedRange::Over;
    if (over == Over::Nothing) same_ = 0.0;
    if (over == Over::Time)
      same_ = moment.since_power_on ? moment.since_power_on->in(second) : kNaN;
    if (over == Over::Illumination) same_ = degrees("illumination");
    if (over == Over::Sensor) same_ = degrees("sensor");
    if (over == Over::Ambient) same_ = moment.ambient ? moment.ambient->in(kilolux) : kNaN;
    if (over == Over::Exposure)
      same_ = moment.exposures.empty() ? kNaN : moment.exposures.front().duration.in(microsecond);
  }
  [[nodiscard]] double at(int x, int y) const {
    using Over = LearnedRange::Over;
    switch (over_) {
      case Over::Range:
        return static_cast<double>(image_.range_m(x, y));
      case Over::Amplitude:
        return static_cast<double>(image_.amplitude(x, y));
      case Over::Column:
        return now_.left + x;
      case Over::Row:
        return now_.top + y;
      case Over::Radius:
        return std::hypot(now_.left + x - now_.camera.cx, now_.top + y - now_.camera.cy);
      default:
        return same_;
    }
  }

 private:
  LearnedRange::Over over_;
  const RangeImage& image_;
  const Conditions& now_;
  double same_ = kNaN;
};

}  // namespace

std::string LearnedRange::problem() const {
  if (!ascends(knots) || !ascends(and_knots)) return "must have knots and and_knots that ascend";
  if ((and_over == Over::Nothing) != and_knots.empty())
    return "has and_over without and_knots, or and_knots without and_over";
  const std::size_t needed = knots.size() * std::max<std::size_t>(1, and_knots.size());
  const auto isWrong = [&](const std::vector<double>& table) { return !table.empty() && table.size() != needed; };
  const bool is_gain = !isWrong(offsets_mm) && isWrong(gains_percent);
  if (isWrong(offsets_mm) || is_gain || (needed > 0 && offsets_mm.empty() && gains_percent.empty()))
    return "has " + std::to_string(is_gain ? gains_percent.size() : offsets_mm.size()) +
           (is_gain ? " gains_percent for " : " offsets_mm for ") + std::to_string(needed) +
           " knots: one for each, or for each pair of knots and and_knots";
  return over == Over::Nothing && needed > 0 ? "has knots over nothing: `over` says what they are of" : "";
}

double LearnedRange::between(const std::vector<double>& table, double x, double y) const {
  if (knots.empty() || table.empty()) return 0.0;
  if (std::isnan(x) || std::isnan(y)) return kNaN;
  const Place i = placeIn(knots, x), j = placeIn(and_knots, y);
  const std::size_t stride = std::max<std::size_t>(1, and_knots.size());
  const auto along_y = [&](std::size_t row) {
    return std::lerp(table[row * stride + j.below], table[row * stride + j.above], j.share);
  };
  return std::lerp(along_y(i.below), along_y(i.above), i.share);
}

RangeImage LearnedRange::apply(RangeImage image, const Conditions& now, const Random&) const {
  if (knots.empty()) return image;
  const Along along{over, image, now}, and_along{and_over, image, now};
  forRows(image.range_m.height(), [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) {
      for (int x = 0; x < image.range_m.width(); ++x) {
        const double at_x = along.at(x, y), at_y = and_along.at(x, y);  // of the image as it came
        const double offset = offset_mm(at_x, at_y), gain = gain_percent(at_x, at_y);
        if (std::isnan(offset) || std::isnan(gain)) continue;
        image.range_m(x, y) += static_cast<float>(1e-3 * offset);
        if (gain != 0.0) image.amplitude(x, y) *= static_cast<float>(1.0 + 1e-2 * gain);
      }
    }
  });
  return image;
}

}  // namespace toftwin::sim
