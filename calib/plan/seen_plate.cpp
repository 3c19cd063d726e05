// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/seen_plate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "calib/compare/statistics.h"

namespace toftwin::plan {
namespace {

constexpr double kBefore_m = 0.25;   ///< so far before the wall a pixel is of the plate
constexpr std::size_t kFewest = 30;  ///< pixels of a plate
constexpr int kAround = 6;           ///< pixels to either side of an edge
constexpr int kBeside = 4;           ///< pixels from the plate that the wall is not taken from
constexpr int kCells = 8;            ///< pixels along a side of the wall's cells

struct Plate {
  Image<std::uint8_t> is{};
  double range_m = 0.0;
  std::size_t pixels = 0;
};

/// Pixels well before the wall; their median range. Nothing where there are too few.
std::optional<Plate> plateIn(const Image<float>& range_m, const Image<float>& wall_m) {
  Plate plate{.is = Image<std::uint8_t>(range_m.width(), range_m.height())};
  std::vector<double> ranges;
  for (std::size_t i = 0; i < range_m.size(); ++i) {
    if (!(static_cast<double>(range_m[i]) < static_cast<double>(wall_m[i]) - kBefore_m)) continue;
    plate.is[i] = 1;
    ranges.push_back(static_cast<double>(range_m[i]));
  }
  plate.pixels = ranges.size();
  if (plate.pixels < kFewest) return std::nullopt;
  plate.range_m = compare::quantile(std::move(ranges), 0.5);
  return plate;
}

/// First and last column of the plate in a row; first < 0 where there is none.
struct Reach {
  int first = -1, last = -1;
};
Reach reachIn(const Plate& plate, int y) {
  Reach reach;
  for (int x = 0; x < plate.is.width(); ++x) {
    if (plate.is(x, y) == 0) continue;
    if (reach.first < 0) reach.first = x;
    reach.last = x;
  }
  return reach;
}

/// Amplitude across an edge of the plate, 0 on the wall and 1 on the plate. Rows see it at places that differ
/// by parts of a pixel: the places where they cross one half are fitted by a line, and rows are laid over
/// each other.
void addEdge(const Image<float>& amplitude, const Plate& plate, bool is_left, CameraSeen& seen) {
  struct Row {
    int y, x;
    double crossing, wall, own;
  };
  std::vector<Row> rows;
  for (int y = 0; y < amplitude.height(); ++y) {
    const Reach reach = reachIn(plate, y);
    if (reach.first < 0 || reach.last - reach.first < 2 * kAround) continue;
    const int x = is_left ? reach.first : reach.last, inwards = is_left ? 1 : -1;
    if (x - kAround < 0 || x + kAround >= amplitude.width()) continue;
    const auto at = [&](int k) { return static_cast<double>(amplitude(x + k * inwards, y)); };
    const double own = 0.5 * (at(kAround) + at(kAround - 1)), wall = 0.5 * (at(-kAround) + at(1 - kAround));
    if (!(own > 1.2 * wall)) continue;
    for (int k = -kAround; k < kAround; ++k) {
      const double before = (at(k) - wall) / (own - wall), after = (at(k + 1) - wall) / (own - wall);
      if (!(before < 0.5 && after >= 0.5)) continue;
      rows.push_back({y, x, x + inwards * (k + (0.5 - before) / (after - before)), wall, own});
      break;
    }
  }
  if (rows.size() < 8) return;
  // A line through the crossings by the median of slopes and places (Theil and Sen): corners of the plate
  // fall away.
  std::vector<double> slopes, places;
  const std::size_t half = rows.size() / 2;
  for (std::size_t i = 0; i + half < rows.size(); ++i)
    slopes.push_back((rows[i + half].crossing - rows[i].crossing) / (rows[i + half].y - rows[i].y));
  const double slope = compare::quantile(slopes, 0.5);
  for (const Row& row : rows) places.push_back(row.crossing - slope * row.y);
  const double place = compare::quantile(places, 0.5);
  for (const Row& row : rows) {
    if (std::abs(row.crossing - place - slope * row.y) > 0.5) continue;
    for (int k = -kAround; k <= kAround; ++k) {
      const int x = row.x + k;
      const double away = (x - place - slope * row.y) * (is_left ? 1.0 : -1.0);
      seen.edge_place_px.push_back(away);
      seen.edge_value.push_back((static_cast<double>(amplitude(x, row.y)) - row.wall) / (row.own - row.wall));
    }
  }
}

/// Cells of the wall that the plate is not near.
void addBehind(const Image<float>& range_m, const Image<float>& wall_m, const Image<float>& amplitude,
               const Plate& plate, std::span<const double> frequency_hz, CameraSeen& seen) {
  const Veil veil{range_m, amplitude, frequency_hz};
  seen.wall_veil_mm.resize(frequency_hz.size());
  const auto isFree = [&](int x, int y) {
    for (int dy = -kBeside; dy <= kBeside; ++dy) {
      for (int dx = -kBeside; dx <= kBeside; ++dx) {
        const int px = std::clamp(x + dx, 0, range_m.width() - 1),
                  py = std::clamp(y + dy, 0, range_m.height() - 1);
        if (plate.is(px, py) != 0) return false;
      }
    }
    return true;
  };
  for (int top = 0; top + kCells <= range_m.height(); top += kCells) {
    for (int left = 0; left + kCells <= range_m.width(); left += kCells) {
      double e = 0.0, r = 0.0, a = 0.0, count = 0.0;
      for (int y = top; y < top + kCells; ++y) {
        for (int x = left; x < left + kCells; ++x) {
          const double error = 1e3 * static_cast<double>(range_m(x, y) - wall_m(x, y));
          if (!(std::abs(error) < 200.0) || !(amplitude(x, y) > 0.0F) || !isFree(x, y)) continue;
          e += error, r += static_cast<double>(wall_m(x, y)), a += static_cast<double>(amplitude(x, y)),
              ++count;
        }
      }
      if (count < 0.75 * kCells * kCells) continue;
      seen.wall_range_m.push_back(r / count), seen.wall_error_mm.push_back(e / count);
      seen.wall_amplitude.push_back(a / count);
      addVeil(veil, seen);
    }
  }
}

/// Its exposure's start, of the camera's own clock: things in a simulated camera's scene move by that (docs/scene.md),
/// and a real one may say one time since power-on of all frames. That time may be set from outside, and what it is
/// set to says nothing of where a thing was.
std::optional<double> timeOf(const ReadFrame& frame) { return frame.start_s ? frame.start_s : frame.since_power_on_s; }

/// Not at the image's border.
bool isWhole(const Plate& plate) {
  const int last = plate.is.width() - 1;
  for (int y = 0; y < plate.is.height(); ++y) {
    if (plate.is(0, y) != 0 || plate.is(last, y) != 0) return false;
  }
  return true;
}

/// What hangs between plate and wall is mixed light, and moves with the plate to one side: one camera shows
/// it, another one masks it.
bool isPlateAlone(const Plate& plate, const Image<float>& range_m, const Image<float>& wall_m, int x, int y) {
  constexpr double kHangs = 0.15;  // of the step, as a flying pixel
  const double step = static_cast<double>(wall_m(x, y)) - plate.range_m;
  return plate.is(x, y) != 0 && std::abs(static_cast<double>(range_m(x, y)) - plate.range_m) <= kHangs * step;
}

}  // namespace

void addVeil(const Veil& veil, CameraSeen& seen) {
  const auto slopes = veil.slopes_mm(seen.wall_range_m.back(), seen.wall_amplitude.back());
  for (std::size_t f = 0; f < slopes.size(); ++f) seen.wall_veil_mm[f].push_back(slopes[f]);
}

void addPlate(const Image<float>& wall_m, const compare::Stack& stack, std::span<const double> frequency_hz,
              CameraSeen& seen) {
  const Image<float> range = stack.meanRange_m(), amplitude = stack.meanAmplitude();
  const auto plate = plateIn(range, wall_m);
  if (!plate) return;
  seen.over_split = Image<float>(range.width(), range.height());
  for (std::size_t i = 0; i < range.size(); ++i)
    seen.over_split[i] =
        range[i] / static_cast<float>(0.5 * (plate->range_m + static_cast<double>(wall_m[i])));
  if (amplitude.empty()) return;
  addEdge(amplitude, *plate, true, seen);
  addEdge(amplitude, *plate, false, seen);
  addBehind(range, wall_m, amplitude, *plate, frequency_hz, seen);
}

void addMovingPlate(const Image<float>& wall_m, const CameraInfo& camera,
                    const std::vector<ReadFrame>& frames, CameraSeen& seen) {
  for (const ReadFrame& frame : frames) {
    const auto time = timeOf(frame);
    const auto plate = time ? plateIn(frame.range_m, wall_m) : std::nullopt;
    if (!plate || !isWhole(*plate)) continue;  // cut by the image's border: its middle is not known
    // Depth over x, by least squares: motion pulls the two edges to different sides.
    double n = 0.0, sx = 0.0, sz = 0.0, sxx = 0.0, sxz = 0.0;
    compare::Running middles, widths;
    for (int y = 0; y < camera.height; ++y) {
      std::optional<double> first, last;
      for (int x = 0; x < camera.width; ++x) {
        if (!isPlateAlone(*plate, frame.range_m, wall_m, x, y)) continue;
        const Vec3d at = static_cast<double>(frame.range_m(x, y)) * rayThroughPixel(camera, x, y).v;
        n += 1.0, sx += at.x, sz += at.z, sxx += at.x * at.x, sxz += at.x * at.z;
        if (!first) first = at.x;
        last = at.x;
      }
      if (first) middles.add(0.5 * (*first + *last)), widths.add(*last - *first);
    }
    const double spread = sxx - sx * sx / n;
    if (!(spread > 0.0)) continue;
    seen.plate_time_s.push_back(*time), seen.plate_place_m.push_back(middles.mean());
    seen.plate_width_m.push_back(widths.mean()), seen.plate_pixel_m = plate->range_m / camera.fx;
    // By how much the plate's right end seems farther than its left: slope × width of an even plate, √(12
    // var).
    seen.plate_turn_mm.push_back(1e3 * (sxz - sx * sz / n) / spread * std::sqrt(12.0 * spread / n));
  }
}

}  // namespace toftwin::plan
