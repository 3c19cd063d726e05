// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/frame_traits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/veil.h"
#include "calib/plan/change_traits.h"
#include "calib/plan/corner_traits.h"

namespace toftwin::plan {
namespace {

using compare::TraitCollector;

void append(std::vector<double>& to, const std::vector<double>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

/// A value of the cells of a camera's own wall at several distances, by their range. Cells where it is not
/// finite are left out.
class OverRange {
 public:
  OverRange(const Captures& walls, std::size_t camera,
            const std::function<double(const CameraSeen&, std::size_t)>& value_of) {
    std::map<long, compare::Running> bins;
    for (const ComparedCapture* one : walls) {
      const CameraSeen& seen = one->seen[camera];
      for (std::size_t i = 0; i < seen.wall_range_m.size(); ++i) {
        if (const double value = value_of(seen, i); std::isfinite(value))
          bins[std::lround(seen.wall_range_m[i] / kBin_m)].add(value);
      }
    }
    for (const auto& [bin, values] : bins)
      range_m_.push_back(kBin_m * static_cast<double>(bin)), mean_.push_back(values.mean());
  }
  /// Linear between bins; the nearest one's at most three bins beyond; NaN farther away.
  [[nodiscard]] double at(double range_m) const {
    const auto after = std::ranges::lower_bound(range_m_, range_m);
    const auto i = static_cast<std::size_t>(after - range_m_.begin());
    const auto isNear = [&](std::size_t k) { return std::abs(range_m_[k] - range_m) <= 3.0 * kBin_m; };
    const bool has_low = i > 0 && isNear(i - 1), has_high = i < range_m_.size() && isNear(i);
    if (has_low && has_high) {
      const double share = (range_m - range_m_[i - 1]) / (range_m_[i] - range_m_[i - 1]);
      return mean_[i - 1] + share * (mean_[i] - mean_[i - 1]);
    }
    return has_low ? mean_[i - 1] : has_high ? mean_[i] : kNaN;
  }
  [[nodiscard]] bool isKnown() const { return range_m_.size() > 1; }

 private:
  static constexpr double kBin_m = 0.025;
  std::vector<double> range_m_, mean_;
};

/// What a camera is off by at a range: corners and plates are judged beside it.
OverRange ownErrorOf(const Captures& walls, std::size_t camera) {
  return {walls, camera, [](const CameraSeen& seen, std::size_t i) { return seen.wall_error_mm[i]; }};
}

/// Where no wall is known, 0.
std::function<double(double)> beside(OverRange own) {
  return [own = std::move(own)](double range_m) { return own.isKnown() ? own.at(range_m) : 0.0; };
}

void addTiming(const ComparedRun& run, std::size_t camera, TraitCollector& all) {
  std::vector<std::vector<double>> series;
  for (const auto* captures : {&run.captures, &run.moving}) {
    for (const ComparedCapture& one : *captures) series.push_back(one.seen[camera].starts_s);
  }
  all.add("frame timing", kCameras[camera], compare::timingTraits(series));
}

/// Pixels of a capture wrap together: each capture is a row.
void addWraps(const Captures& walls, std::size_t camera, TraitCollector& all) {
  std::vector<double> shares;
  for (const ComparedCapture* one : walls) {
    const CameraSeen& seen = one->seen[camera];
    if (seen.wall_readings > 0.0) shares.push_back(seen.wall_wraps / seen.wall_readings);
  }
  all.add("wraps", kCameras[camera], compare::wrapTraits(shares));
}

/// All captures below each other, a row of nothing between them: what looks along rows takes them for one
/// image.
Image<float> belowEachOther(const Captures& captures, std::size_t camera) {
  int width = 1, height = 0;
  for (const ComparedCapture* one : captures) {
    const Image<float>& image = one->seen[camera].over_split;
    width = std::max(width, image.width()), height += image.height() + 1;
  }
  Image<float> together(width, std::max(1, height), kNaN);
  int top = 0;
  for (const ComparedCapture* one : captures) {
    const Image<float>& image = one->seen[camera].over_split;
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) together(x, top + y) = image(x, y);
    }
    top += image.height() + 1;
  }
  return together;
}

/// A wall by itself: what a camera is off by at a range, and by how much a veil of 1 would move it there.
/// Both of the same cells: where one is not known, as that of a cell without an amplitude, the other does not
/// count.
class WallAlone {
 public:
  WallAlone(const Captures& walls, std::size_t camera, std::size_t frequencies)
      : error_{walls, camera, [](const CameraSeen& seen, std::size_t i) {
                 return isWhole(seen, i) ? seen.wall_error_mm[i] : kNaN;
               }} {
    for (std::size_t f = 0; f < frequencies; ++f) {
      veil_.emplace_back(walls, camera, [f](const CameraSeen& seen, std::size_t i) {
        return isWhole(seen, i) ? seen.wall_veil_mm[f][i] : kNaN;
      });
    }
  }
  /// NaN at ranges at which no wall was seen; 0 where none was seen at all.
  [[nodiscard]] double error_mm(double range_m) const { return error_.isKnown() ? error_.at(range_m) : 0.0; }
  [[nodiscard]] double veil_mm(std::size_t f, double range_m) const {
    return error_.isKnown() ? veil_[f].at(range_m) : 0.0;
  }

 private:
  static bool isWhole(const CameraSeen& seen, std::size_t i) {
    return std::isfinite(seen.wall_error_mm[i]) &&
           std::ranges::all_of(seen.wall_veil_mm, [i](const auto& of) { return std::isfinite(of[i]); });
  }
  OverRange error_;
  std::vector<OverRange> veil_{};
};

/// Errors of the wall beside the plate and what a veil would do to them, both less what they are at the same
/// range before the wall alone: what goes with the range is the camera's own error, and the wall's light
/// veils it, too.
void addScatter(const Captures& plates, const Captures& walls, const std::vector<double>& frequency_hz,
                std::size_t camera, TraitCollector& all) {
  const WallAlone alone{walls, camera, frequency_hz.size()};
  std::vector<double> error_mm;
  std::vector<std::vector<double>> veil_mm(frequency_hz.size());
  std::vector<std::size_t> capture;
  for (const ComparedCapture* one : plates) {
    const CameraSeen& seen = one->seen[camera];
    for (std::size_t i = 0; i < seen.wall_range_m.size(); ++i) {
      const double range_m = seen.wall_range_m[i];
      error_mm.push_back(seen.wall_error_mm[i] - alone.error_mm(range_m));
      for (std::size_t f = 0; f < veil_mm.size(); ++f)
        veil_mm[f].push_back(seen.wall_veil_mm[f][i] - alone.veil_mm(f, range_m));
      capture.push_back(one->record.number);
    }
  }
  all.add("lens scatter", kCameras[camera], compare::veilTraits(veil_mm, error_mm, frequency_hz, capture));
}

void addPlates(const ComparedRun& run, std::size_t camera, TraitCollector& all) {
  const Captures captures = allCapturesOf(run, "foreground");
  if (captures.empty()) return;
  std::vector<double> place, value;
  for (const ComparedCapture* one : captures) {
    const CameraSeen& seen = one->seen[camera];
    append(place, seen.edge_place_px), append(value, seen.edge_value);
  }
  const Image<float> together = belowEachOther(captures, camera);
  all.add("flying pixels", kCameras[camera], compare::flyingTraits(together));
  all.add("emitter shadow", kCameras[camera], compare::shadowTraits(together, 1.0));
  all.add("edge in the amplitude", kCameras[camera], compare::edgeTraits(place, value));
}

/// Before a dark wall a plate's light is far more beside the wall's own; a bright wall is the next best.
Captures platesForScatter(const ComparedRun& run) {
  Captures plates = allCapturesOf(run, "scatter");
  if (plates.empty()) plates = allCapturesOf(run, "foreground");
  std::erase_if(plates, [](const auto* one) { return isPoseFromPlanes(one->record); });
  return plates;
}

}  // namespace

void addFrameTraits(const ComparedRun& run, TraitCollector& all) {
  Captures walls = allCapturesOf(run, "distance");
  if (walls.empty()) walls = allCapturesOf(run, "warm_up");
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    addTiming(run, camera, all);
    if (!walls.empty()) addWraps(walls, camera, all);
    addPlates(run, camera, all);
    if (const Captures plates = platesForScatter(run); !plates.empty())
      addScatter(plates, walls, run.frequency_hz[camera], camera, all);
    addChangeTraits(run, camera, all);
  }
  addCornerTraits(run, {beside(ownErrorOf(walls, 0)), beside(ownErrorOf(walls, 1))}, all);
  addLatency(run, all);
}

}  // namespace toftwin::plan
