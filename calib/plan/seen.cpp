// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/seen.h"

#include <toftwin/modulation.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "calib/compare/gross.h"
#include "calib/compare/statistics.h"
#include "calib/intrinsics/brightness.h"
#include "calib/plan/place.h"
#include "calib/plan/seen_plate.h"

namespace toftwin::plan {
namespace {

using compare::kGross_mm;
constexpr float kNaNf = std::numeric_limits<float>::quiet_NaN();
constexpr int kCell = 8;                 ///< pixels along a side
constexpr double kFewWraps = 0.01;       ///< of a wall's readings; more shift the mean of the rest
constexpr int kMiddle = 96;              ///< pixels along a side that the noise is taken from
constexpr double kBoardReach_m = 0.9;    ///< of a corner's boards, which are 1 m or wider
constexpr double kBoardHeight_m = 0.35;  ///< to either side of the middle

const BlockSpec* blockOf(const Plan& plan, const CaptureRecord& record) {
  const auto found = std::ranges::find(plan.blocks, record.block, &BlockSpec::name);
  return found == plan.blocks.end() ? nullptr : &*found;
}

/// Lengths that a range may be off by as a whole: the shortest frequency's period, and c / 2 gcd(f), where
/// the ranges of all frequencies together begin anew. 0 where no frequency is known.
struct Periods {
  double shortest_m = 0.0, common_m = 0.0;

  explicit Periods(std::span<const double> frequency_hz) {
    if (frequency_hz.empty()) return;
    const Frequency common = commonFrequency(frequency_hz, [](double hz) { return hz * hertz; });
    shortest_m = unambiguousRange(frequency_hz.back() * hertz).in(metre);
    common_m = common > 0_Hz ? unambiguousRange(common).in(metre) : 0.0;
  }
  static double off(double error_m, double period_m) {
    return period_m > 0.0 ? std::round(error_m / period_m) : 0.0;
  }
};

/// A cell's readings of all frames, by the wall that the plan puts there. Of frames, not of their mean: a
/// pixel that wraps in some of them has a mean of no meaning.
struct CellReadings {
  double all = 0.0, there = 0.0, of_wall = 0.0, wrapped = 0.0, beyond = 0.0;

  void add(double error_m, const Periods& periods) {
    ++all;
    if (!std::isfinite(error_m)) return;
    const double turns = Periods::off(error_m, periods.common_m);
    ++there, wrapped += Periods::off(error_m, periods.shortest_m) != 0.0, beyond += turns != 0.0;
    of_wall += std::abs(error_m - turns * periods.common_m) <= 1e-3 * kGross_mm;
  }
  /// Where all is another surface, as a floor beside a wall of no size, nothing is said.
  [[nodiscard]] bool isWall(std::size_t frames) const {
    return 2.0 * there >= all && of_wall >= 4.0 * static_cast<double>(frames);
  }
};

CellReadings readingsOf(const std::vector<ReadFrame>& frames, const Image<float>& expected_m, int left,
                        int top, const Periods& periods) {
  CellReadings cell;
  for (const ReadFrame& frame : frames) {
    for (int y = top; y < std::min(top + kCell, expected_m.height()); ++y) {
      for (int x = left; x < std::min(left + kCell, expected_m.width()); ++x)
        cell.add(static_cast<double>(frame.range_m(x, y)) - static_cast<double>(expected_m(x, y)), periods);
    }
  }
  return cell;
}

/// Means over the frames.
struct WallImages {
  Image<float> range_m{}, amplitude{}, noise_of_mean_m{};
};

/// Each pixel's, of the frames in which it is valid.
Image<float> noiseOfMeans_m(const compare::Stack& stack) {
  Image<float> noise = stack.temporalNoise_m();
  const Image<float> share = stack.validShare();
  for (std::size_t i = 0; i < noise.size(); ++i)
    noise[i] = static_cast<float>(
        compare::noiseOfMean(static_cast<double>(noise[i]), stack.frames(), static_cast<double>(share[i])));
  return noise;
}

/// Means over a cell's pixels that are not gross. The cut lies about the cell's own middle where noise is
/// large: about 0 it would take more from one side than from the other.
struct CellMeans {
  double range_m = 0.0, error_mm = 0.0, amplitude = 0.0, count = 0.0;
  RangeSteps steps{};

  CellMeans(const WallImages& images, const Image<float>& expected_m, int left, int top) {
    std::vector<double> error, noise, expected, amplitudes;
    for (int y = top; y < std::min(top + kCell, expected_m.height()); ++y) {
      for (int x = left; x < std::min(left + kCell, expected_m.width()); ++x) {
        const double e = 1e3 * static_cast<double>(images.range_m(x, y) - expected_m(x, y));
        if (!std::isfinite(e)) continue;
        error.push_back(e), expected.push_back(static_cast<double>(expected_m(x, y)));
        noise.push_back(1e3 * static_cast<double>(images.noise_of_mean_m(x, y)));
        amplitudes.push_back(images.amplitude.empty() ? 0.0 : static_cast<double>(images.amplitude(x, y)));
      }
    }
    const double middle_mm = compare::middleOfCut_mm(error, std::move(noise));
    for (std::size_t i = 0; i < error.size(); ++i) {
      if (!(std::abs(error[i] - middle_mm) <= kGross_mm)) continue;
      error_mm += error[i], range_m += expected[i], amplitude += amplitudes[i], ++count;
      steps.add(expected[i], error[i]);
    }
    error_mm /= count, range_m /= count, amplitude /= count;
  }
};

/// Cells of the wall that are valid in most pixels: their wraps, and the errors of what is not gross.
void addWall(const compare::Stack& stack, const std::vector<ReadFrame>& frames,
             const Image<float>& expected_m, std::span<const double> frequency_hz, CameraSeen& seen) {
  const WallImages images{stack.meanRange_m(), stack.meanAmplitude(), noiseOfMeans_m(stack)};
  const Periods periods{frequency_hz};
  const Veil veil{images.range_m, images.amplitude, frequency_hz};
  seen.wall_veil_mm.resize(frequency_hz.size());
  for (int top = 0; top < expected_m.height(); top += kCell) {
    for (int left = 0; left < expected_m.width(); left += kCell) {
      const CellReadings cell = readingsOf(frames, expected_m, left, top, periods);
      if (!cell.isWall(frames.size())) continue;
      seen.wall_readings += cell.there, seen.wall_wraps += cell.wrapped, seen.wall_beyond += cell.beyond;
      // The rest of a cell that wraps in part is what noise made too near: its mean says nothing of the
      // camera.
      if (cell.beyond > kFewWraps * cell.there) continue;
      const CellMeans means{images, expected_m, left, top};
      if (means.count < 4.0) continue;
      seen.wall_range_m.push_back(means.range_m), seen.wall_error_mm.push_back(means.error_mm);
      seen.wall_steps.add(means.steps);
      seen.wall_amplitude.push_back(images.amplitude.empty() ? std::nan("") : means.amplitude);
      addVeil(veil, seen);
    }
  }
}

/// A pixel that some frames have not would move the mean of the others.
std::vector<double> middleOf(const std::vector<ReadFrame>& frames) {
  if (frames.empty()) return {};
  const int width = frames.front().range_m.width(), height = frames.front().range_m.height();
  std::vector<double> sums(frames.size(), 0.0);
  double count = 0.0;
  for (int y = 3 * height / 8; y < 5 * height / 8; ++y) {
    for (int x = 3 * width / 8; x < 5 * width / 8; ++x) {
      const auto has = [&](const ReadFrame& frame) { return std::isfinite(frame.range_m(x, y)); };
      if (!std::ranges::all_of(frames, has)) continue;
      for (std::size_t i = 0; i < frames.size(); ++i) sums[i] += static_cast<double>(frames[i].range_m(x, y));
      ++count;
    }
  }
  if (!(count > 0.0)) return {};
  for (double& one : sums) one /= count;
  return sums;
}

void addNoise(const std::vector<ReadFrame>& frames, const Image<float>& expected_m, CameraSeen& seen) {
  const int width = std::min(kMiddle, expected_m.width()), height = std::min(kMiddle, expected_m.height());
  const int left = (expected_m.width() - width) / 2, top = (expected_m.height() - height) / 2;
  std::vector<Image<float>> errors;
  for (const ReadFrame& frame : frames) {
    Image<float>& error = errors.emplace_back(width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x)
        error(x, y) = 1e3F * (frame.range_m(left + x, top + y) - expected_m(left + x, top + y));
    }
  }
  if (const auto traits = compare::noiseTraits(errors)) seen.noise = *traits;
}

/// A wall seen from a pose that is turned against the true one is off by a slope over the image.
void doubtPattern(CameraSeen& seen) {
  for (compare::Trait& one : seen.noise) {
    if (one.name == "fixed pattern")
      one.doubt = "what the pose, which was seen, is turned by is in it as a slope over the image";
  }
}

/// Ranges against two walls that meet at the target's point, in the vertical, and open towards the cameras.
void addCorner(const Plan& plan, const BlockSpec& block, const Transform<World, Camera>& pose,
               const compare::Stack& stack, CameraSeen& seen) {
  const Target target = targetOf(plan, block);
  const Vec3d up{0.0, -1.0, 0.0};
  const Image<float> range = stack.meanRange_m(), noise_m = noiseOfMeans_m(stack);
  std::vector<double> places_m, ranges_m, errors_mm, noise_mm;
  for (const double side : {-0.5, 0.5}) {
    const Vec3d along =
        rotation<World, World>(up, side * block.corner_deg * std::numbers::pi / 180.0).rotate(target.normal);
    const Vec3d normal = cross(along, up);
    for (int y = 0; y < range.height(); ++y) {
      for (int x = 0; x < range.width(); ++x) {
        const auto ray = pose * rayThroughPixel(stack.camera(), x, y);
        const double expected = dot(normal, target.point_m - pose.translation_m) / dot(normal, ray.v);
        if (!(expected > 0.0) || !std::isfinite(range(x, y))) continue;
        const Vec3d from_edge = pose.translation_m + expected * ray.v - target.point_m;
        const double place = dot(from_edge, along), e = 1e3 * (static_cast<double>(range(x, y)) - expected);
        if (place < 0.02 || place > kBoardReach_m || std::abs(dot(from_edge, up)) > kBoardHeight_m) continue;
        places_m.push_back(place), ranges_m.push_back(expected), errors_mm.push_back(e);
        noise_mm.push_back(1e3 * static_cast<double>(noise_m(x, y)));
      }
    }
  }
  const double middle_mm = compare::middleOfCut_mm(errors_mm, std::move(noise_mm));
  for (std::size_t i = 0; i < errors_mm.size(); ++i) {
    if (compare::isGross(errors_mm[i] - middle_mm)) continue;
    seen.corner_place_m.push_back(places_m[i]), seen.corner_range_m.push_back(ranges_m[i]);
    seen.corner_error_mm.push_back(errors_mm[i]);
  }
}

void leaveOutErrors(CameraSeen& seen) {
  for (auto* column : {&seen.wall_range_m, &seen.wall_error_mm, &seen.wall_amplitude, &seen.corner_place_m,
                       &seen.corner_range_m, &seen.corner_error_mm})
    column->clear();
  seen.wall_steps = {};
  for (auto& column : seen.wall_veil_mm) column.clear();
}

}  // namespace

bool isWrapped(const CameraSeen& seen) { return seen.wall_beyond > kFewWraps * seen.wall_readings; }

bool isPoseFromPlanes(const CaptureRecord& record) { return record.pose_by == "planes"; }

std::optional<CaptureRecord::Condition> sharedPoseOf(const CaptureRecord& record) {
  if (!record.pose_half_widths) return std::nullopt;
  return record.conditionInRun();
}

double poseError_mm(const Plan& plan, const CaptureRecord& record,
                    const std::optional<std::array<double, 6>>& half_widths) {
  constexpr double kHalfWidths = 1.96;  // of a standard error
  const BlockSpec* block = blockOf(plan, record);
  if (block == nullptr || !half_widths) return 0.0;
  const Vec3d normal = targetOf(plan, *block).normal;
  const auto& h = *half_widths;
  return 1e3 * std::hypot(normal.x * h[3], normal.y * h[4], normal.z * h[5]) / kHalfWidths;
}

Image<float> wallRange_m(const Plan& plan, const BlockSpec& block, const CameraInfo& camera,
                         const Transform<World, Camera>& pose) {
  const Target target = targetOf(plan, block);
  Image<float> range(camera.width, camera.height, kNaNf);
  const double away = dot(target.normal, target.point_m - pose.translation_m);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const auto ray = pose * rayThroughPixel(camera, x, y);
      const double along = away / dot(target.normal, ray.v);
      if (along > 0.0 && isOnWall(target, pose.translation_m + along * ray.v))
        range(x, y) = static_cast<float>(along);
    }
  }
  return range;
}

Image<float> wallRange_m(const Plan& plan, const CaptureRecord& record, const compare::Stack& stack) {
  const BlockSpec* block = blockOf(plan, record);
  if (block == nullptr || !stack.pose()) return {};
  return wallRange_m(plan, *block, stack.camera(), *stack.pose());
}

Result<ReadFrame> readOf(const Frame& frame) {
  auto range = compare::rangeOf(frame);
  if (!range) return range.error();
  ReadFrame read{.range_m = *std::move(range)};
  if (!frame.moment.exposures.empty())
    read.start_s = 1e-9 * static_cast<double>(frame.moment.exposures[0].start.ns);
  if (frame.moment.since_power_on) read.since_power_on_s = frame.moment.since_power_on->in(second);
  const auto amplitude = intrinsics::brightnessOf(frame);
  if (!amplitude) return read;
  const int width = amplitude->width(), height = amplitude->height();
  double sum = 0.0, count = 0.0;
  for (int y = 3 * height / 8; y < 5 * height / 8; ++y) {
    for (int x = 3 * width / 8; x < 5 * width / 8; ++x) {
      if (!std::isfinite((*amplitude)(x, y))) continue;
      sum += static_cast<double>((*amplitude)(x, y)), ++count;
    }
  }
  read.brightness = count > 0.0 ? sum / count : std::nan("");
  return read;
}

CameraSeen seenOf(const Plan& plan, const CaptureRecord& record, const compare::Stack& stack,
                  const std::vector<ReadFrame>& frames, std::span<const double> frequency_hz,
                  const std::optional<Transform<World, Camera>>& own_pose) {
  CameraSeen seen;
  seen.is_simulated = stack.provenance().kind == FrameKind::Simulated;
  for (const ReadFrame& frame : frames) {
    if (frame.start_s) seen.starts_s.push_back(*frame.start_s);
    seen.brightness.push_back(frame.brightness);
  }
  if (seen.starts_s.size() < frames.size()) seen.starts_s.clear();
  seen.middle_range_m = middleOf(frames);
  const BlockSpec* block = blockOf(plan, record);
  const auto& pose = own_pose ? own_pose : stack.pose();
  if (block == nullptr || !pose) return seen;
  switch (block->kind) {
    case Kind::WarmUp:
    case Kind::Distance:
    case Kind::Exposure:
    case Kind::Tilt: {
      const auto expected = wallRange_m(plan, *block, stack.camera(), *pose);
      addWall(stack, frames, expected, frequency_hz, seen);
      if (block->kind != Kind::Tilt) addNoise(frames, expected, seen);
      if (record.pose_half_widths) doubtPattern(seen);
      break;
    }
    case Kind::Corner:
      addCorner(plan, *block, *pose, stack, seen);
      break;
    case Kind::Foreground:
    case Kind::Scatter:
      addPlate(wallRange_m(plan, *block, stack.camera(), *pose), stack, frequency_hz, seen);
      break;
    case Kind::Moving:
      addMovingPlate(wallRange_m(plan, *block, stack.camera(), *pose), stack.camera(), frames, seen);
      break;
    default:
      break;
  }
  if (isPoseFromPlanes(record)) leaveOutErrors(seen);
  return seen;
}

}  // namespace toftwin::plan
