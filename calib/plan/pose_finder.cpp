// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/pose_finder.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "calib/compare/stack.h"
#include "calib/intrinsics/brightness.h"
#include "calib/intrinsics/hand_eye.h"
#include "calib/intrinsics/planes.h"
#include "protocol/types/counted.h"

namespace toftwin::plan {
namespace {

using intrinsics::KnownPose;
using intrinsics::Matrix6d;
using intrinsics::Rig;

constexpr double kDegreePerRadian = 180.0 / std::numbers::pi;

template <class To, class From>
Eigen::Matrix3d matrixOf(const Transform<To, From>& t) {
  const auto& q = t.rotation_wxyz;
  return Eigen::Quaterniond{q[0], q[1], q[2], q[3]}.normalized().toRotationMatrix();
}
Eigen::Vector3d vectorOf(const Vec3d& v) { return {v.x, v.y, v.z}; }
Eigen::Matrix3d crossOf(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

std::array<double, 6> arrayOf(const Eigen::Matrix<double, 6, 1>& v) {
  return {v[0], v[1], v[2], v[3], v[4], v[5]};
}

/// Of x' = e^w R x + t + dt, its inverse in the world W: the camera's turn is −W Rᵀ w about the world's axes,
/// its place shifts by W (−Rᵀ dt − Rᵀ [t]ₓ w).
SeenPose fromBoard(const Transform<World, Board>& world_from_board, const KnownPose<Camera, Board>& seen) {
  const Eigen::Matrix3d r = matrixOf(seen.pose), w = matrixOf(world_from_board);
  Matrix6d slope = Matrix6d::Zero();
  slope.topLeftCorner<3, 3>() = -w * r.transpose();
  slope.bottomLeftCorner<3, 3>() = -w * r.transpose() * crossOf(vectorOf(seen.pose.translation_m));
  slope.bottomRightCorner<3, 3>() = -w * r.transpose();
  SeenPose found;
  found.world_from_camera = world_from_board * seen.pose.inverse();
  found.half_widths =
      arrayOf(intrinsics::halfWidths(slope * seen.covariance * slope.transpose(), seen.degrees));
  return found;
}

/// Mean over the frames of each pixel that has a value in at least half of them.
Result<Image<float>> meanOf(std::span<const Frame> frames,
                            const std::function<Result<Image<float>>(const Frame&)>& imageOf) {
  Image<double> sum;
  Image<std::uint32_t> count;
  for (const Frame& frame : frames) {
    const auto image = imageOf(frame);
    if (!image) return image.error();
    if (sum.empty()) {
      sum = Image<double>(image->width(), image->height());
      count = Image<std::uint32_t>(image->width(), image->height());
    }
    for (std::size_t i = 0; i < sum.size() && i < image->size(); ++i) {
      const auto value = static_cast<double>((*image)[i]);
      if (std::isfinite(value)) sum[i] += value, ++count[i];
    }
  }
  Image<float> mean(sum.width(), sum.height(), std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i < mean.size(); ++i) {
    if (2 * count[i] >= frames.size() && count[i] > 0)
      mean[i] = static_cast<float>(sum[i] / static_cast<double>(count[i]));
  }
  return mean;
}

/// The pixels of each plane: those that should see it, as its neighbours do, and whose range is near enough.
std::vector<std::vector<std::uint32_t>> pixelsOfPlanes(const Plan& plan, const Image<float>& range_m,
                                                       const CameraInfo& camera,
                                                       const std::vector<intrinsics::KnownPlane>& planes,
                                                       const Transform<World, Camera>& about) {
  Image<int> nearest(camera.width, camera.height, -1);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const auto ray = about * rayThroughPixel(camera, x, y);
      double best = std::numeric_limits<double>::infinity();
      for (std::size_t p = 0; p < planes.size(); ++p) {
        const double along = dot(planes[p].normal.v, ray.v);
        const double range = (planes[p].distance_m - dot(planes[p].normal.v, about.translation_m)) / along;
        if (along >= -0.05 || range <= 0.0) continue;
        const double off = std::abs(static_cast<double>(range_m(x, y)) - range);
        if (off < plan.planes[p].within.in(metre) && off < best)
          best = off, nearest(x, y) = static_cast<int>(p);
      }
    }
  }
  std::vector<std::vector<std::uint32_t>> pixels(planes.size());
  for (int y = 1; y + 1 < camera.height; ++y) {
    for (int x = 1; x + 1 < camera.width; ++x) {
      const int p = nearest(x, y);
      if (p < 0 || nearest(x - 1, y) != p || nearest(x + 1, y) != p || nearest(x, y - 1) != p ||
          nearest(x, y + 1) != p)
        continue;
      pixels[static_cast<std::size_t>(p)].push_back(static_cast<std::uint32_t>(y * camera.width + x));
    }
  }
  return pixels;
}

Result<SeenPose> byPlanes(const Plan& plan, std::span<const Frame> frames, Transform<World, Camera> about) {
  const auto range_m = meanOf(frames, [](const Frame& frame) { return compare::rangeOf(frame); });
  if (!range_m) return range_m.error();
  std::vector<intrinsics::KnownPlane> planes;
  for (const PlaneSpec& one : plan.planes) planes.push_back(one.known());
  KnownPose<World, Camera> known;
  std::size_t used = 0, counted = 0;
  for (int round = 0; round < 3; ++round) {
    const auto pixels = pixelsOfPlanes(plan, *range_m, frames.front().camera, planes, about);
    std::vector<intrinsics::SeenPlane> seen;
    std::vector<intrinsics::KnownPlane> of;
    std::string why;
    counted = 0;
    for (std::size_t p = 0; p < planes.size(); ++p) {
      const auto fitted = intrinsics::fitPlane(*range_m, frames.front().camera, pixels[p]);
      if (!fitted) {
        why += pixels[p].empty() ? fmt::format("; plane {}: no pixel and its neighbours read a range within {:.4g} mm of "
                                               "where the plan has it (plane.within_mm)",
                                               p + 1, plan.planes[p].within.in(millimetre))
                                 : fmt::format("; plane {}: {}", p + 1, fitted.error().message);
        continue;
      }
      seen.push_back(*fitted), of.push_back(planes[p]), counted += fitted->pixels;
    }
    const auto pose = intrinsics::poseFromPlanes(seen, of);
    if (!pose) return Error{pose.error().code, pose.error().message + why};
    known = *pose, about = pose->pose, used = seen.size();
  }
  return SeenPose{.world_from_camera = known.pose,
                  .half_widths = arrayOf(intrinsics::halfWidths(known.covariance, known.degrees)),
                  .by = "planes",
                  .what = fmt::format("{} planes, {} pixels", used, counted)};
}

}  // namespace

struct PoseFinder::Memory {
  std::vector<intrinsics::HandEyeView> views;
};

PoseFinder::PoseFinder(const Plan& plan) : plan_(plan), memory_(std::make_shared<Memory>()) {}

Result<SeenPose> PoseFinder::find(PoseFrom from, std::span<const Frame> frames,
                                  const std::optional<Transform<World, Camera>>& about) {
  if (from == PoseFrom::Planes) {
    if (!about)
      return Error{Error::Code::InvalidArgument,
                   "which plane is which is told by where the camera stands, about: the capture has no pose"};
    return byPlanes(plan_, frames, *about);
  }
  const auto target = intrinsics::targetOf(plan_.board.words());
  if (!target) return target.error();
  const auto amplitude = meanOf(frames, [](const Frame& frame) { return intrinsics::brightnessOf(frame); });
  if (!amplitude) return amplitude.error();
  const auto pose = plan_.board.pose().world_from_camera();
  const Transform<World, Board> world_from_board{pose.rotation_wxyz, pose.translation_m};
  const auto sighting = intrinsics::locateBoard(*amplitude, *target, frames.front().camera);
  if (sighting) {
    if (from == PoseFrom::BoardAndRig && about) {
      memory_->views.push_back(
          {Transform<World, Rig>{about->rotation_wxyz, about->translation_m}, sighting->camera_from_board});
    }
    SeenPose found = fromBoard(world_from_board, sighting->camera_from_board);
    found.by = "board";
    found.what = fmt::format("{} corners, {:.3f} px RMS", sighting->corners, sighting->rms_px);
    return found;
  }
  if (from == PoseFrom::Board || !about) return sighting.error();
  const auto known = intrinsics::handEye(memory_->views);
  if (!known) {
    return Error{
        sighting.error().code,
        fmt::format("{}; and the rig does not tell by itself: after {} that saw the board, {}",
                    sighting.error().message, counted(memory_->views.size(), "capture"), known.error().message)};
  }
  // The plan says where the board is: there and back from it, so that what is not known of it counts, too.
  const auto seen = intrinsics::boardFromCamera(*known, {about->rotation_wxyz, about->translation_m});
  Matrix6d slope = Matrix6d::Zero();
  slope.topLeftCorner<3, 3>() = slope.bottomRightCorner<3, 3>() = matrixOf(world_from_board);
  SeenPose found;
  found.world_from_camera = world_from_board * seen.pose;
  found.half_widths =
      arrayOf(intrinsics::halfWidths(slope * seen.covariance * slope.transpose(), seen.degrees));
  found.by = kByBoardAndRig;
  found.what = fmt::format("the camera's place on the rig from {} captures, misfit {:.2f}",
                           memory_->views.size(), known->misfit);
  const auto& h = found.half_widths;
  const double shift_m = std::hypot(h[3], h[4], h[5]), turn_deg = kDegreePerRadian * std::hypot(h[0], h[1], h[2]);
  if (shift_m <= plan_.board.agree.in(metre) && turn_deg <= plan_.board.agree_deg) return found;
  return Error{Error::Code::InvalidArgument,
               fmt::format("{}; and the rig tells it to {:.0f} mm and {:.1f}° only, more than board.agree_mm "
                           "and board.agree_deg allow: {}. A misfit far over 1 means that rig and board contradict "
                           "each other",
                           sighting.error().message, 1e3 * shift_m, turn_deg, found.what)};
}

std::array<double, 6> between(const Transform<World, Camera>& from, const Transform<World, Camera>& to) {
  const Eigen::AngleAxisd turn{matrixOf(to) * matrixOf(from).transpose()};
  const Eigen::Vector3d w = turn.angle() * turn.axis();
  const Vec3d t = to.translation_m - from.translation_m;
  return {w.x(), w.y(), w.z(), t.x, t.y, t.z};
}

std::string disagreement(const SeenPose& one, const Transform<World, Camera>& other,
                         const std::array<double, 6>& other_half_widths, const BoardSpec& tolerance) {
  const auto off = between(one.world_from_camera, other);
  const auto reach = [&](std::size_t first) {
    double squares = 0.0;
    for (std::size_t k = first; k < first + 3; ++k)
      squares += std::pow(one.half_widths[k], 2) + std::pow(other_half_widths[k], 2);
    return std::sqrt(squares);
  };
  const double turned = std::hypot(off[0], off[1], off[2]), shifted = std::hypot(off[3], off[4], off[5]);
  if (turned <= reach(0) + tolerance.agree_deg / kDegreePerRadian &&
      shifted <= reach(3) + tolerance.agree.in(metre))
    return {};
  return fmt::format(
      "{:.1f} mm and {:.2f}° apart, where {:.1f} mm and {:.2f}° are what is known of them, and "
      "{:g} mm and {:g}° may be besides (board.agree_mm, board.agree_deg)",
      1e3 * shifted, kDegreePerRadian * turned, 1e3 * reach(3), kDegreePerRadian * reach(0),
      tolerance.agree.in(millimetre), tolerance.agree_deg);
}

std::string inWords(const std::array<double, 6>& h) {
  return fmt::format("x {:.2g}, y {:.2g}, z {:.2g} mm; turned by {:.2g}, {:.2g}, {:.2g}°", 1e3 * h[3],
                     1e3 * h[4], 1e3 * h[5], kDegreePerRadian * h[0], kDegreePerRadian * h[1],
                     kDegreePerRadian * h[2]);
}

}  // namespace toftwin::plan
