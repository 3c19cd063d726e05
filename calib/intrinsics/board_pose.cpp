// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/board_pose.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "calib/intrinsics/bundle.h"
#include "calib/intrinsics/clusters.h"
#include "calib/intrinsics/seed.h"
#include "calib/intrinsics/uncertainty.h"
#include "calib/linear/linear.h"

namespace toftwin::intrinsics {
namespace {

/// Of the two poses that a flat board may have the other must fit this much worse.
constexpr double kMirrored = 1.5;
constexpr std::size_t kFewest = 8;

LensParameters lensOf(const CameraInfo& camera) {
  const auto& d = camera.distortion;
  return {camera.fx, camera.fy, camera.cx, camera.cy, d[0], d[1], d[2], d[3], d[4]};
}

/// The board turned so that its normal is mirrored about the line of sight: the second bottom of the misfit.
BoardPose mirrored(const Surface& surface, const Observed& view, const BoardPose& pose) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Corner& corner : view.corners) middle += surface.at(corner.index);
  middle /= static_cast<double>(view.corners.size());
  const Eigen::Vector3d there = pose.rotation * middle + pose.translation_mm, sight = there.normalized();
  const Eigen::Vector3d normal = pose.rotation.col(2), across = normal.cross(sight);
  const Eigen::AngleAxisd over{2.0 * std::atan2(across.norm(), normal.dot(sight)), across.normalized()};
  BoardPose result;
  result.rotation = over.toRotationMatrix() * pose.rotation;
  result.translation_mm = there - result.rotation * middle;
  return result;
}

/// What the corners of each row of the board (of tags, of one side of a row of them) say of the pose, or of each
/// column.
enum class Line { Row, Column };
std::vector<SharedInformation> sayOfLines(Line line, const Surface& surface, const Target& target,
                                          const Observed& view, const LensParameters& lens, const BoardPose& pose) {
  const auto columns = static_cast<std::size_t>(target.columns), rows = static_cast<std::size_t>(target.rows);
  std::vector<SharedInformation> lines(line == Line::Row ? rows : columns,
                                       {Eigen::MatrixXd::Zero(6, 6), Eigen::VectorXd::Zero(6)});
  for (const Corner& corner : view.corners) {
    const Projection p = projectWithSlopes(lens, pose, surface.at(corner.index));
    SharedInformation& its = lines[line == Line::Row ? corner.index / columns : corner.index % columns];
    its.information += p.by_pose.transpose() * p.by_pose;
    its.gradient += p.by_pose.transpose() * Eigen::Vector2d{corner.at.u - p.at.x(), corner.at.v - p.at.y()};
  }
  std::erase_if(lines, [](const SharedInformation& one) { return one.information.isZero(0.0); });
  return lines;
}

/// Of corners that err by themselves, σ² (BᵀB)⁻¹; or, where the rows of the board or its columns contradict each other
/// by more, by how much they do: where an edge lies along the pixels, its corners err alike.
Matrix6d covarianceOf(const Surface& surface, const Target& target, const Observed& view, const LensParameters& lens,
                      const BoardPose& pose, double sigma_px, double degrees) {
  const auto rows = sayOfLines(Line::Row, surface, target, view, lens, pose),
             columns = sayOfLines(Line::Column, surface, target, view, lens, pose);
  Matrix6d information = Matrix6d::Zero();
  for (const SharedInformation& row : rows) information += row.information;
  const Matrix6d alone = sigma_px * sigma_px * linear::inverse(information);
  const Eigen::VectorXd independent = alone.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd wider = widenedBy(clusteredErrors(rows), independent, degrees)
                                    .cwiseMax(widenedBy(clusteredErrors(columns), independent, degrees));
  return wider.asDiagonal() * alone * wider.asDiagonal();
}

Transform<Camera, Board> transformOf(const BoardPose& pose) {
  const Eigen::Quaterniond q{pose.rotation};
  const Eigen::Vector3d t = 1e-3 * pose.translation_mm;
  return {{q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}};
}

}  // namespace

Result<BoardSighting> locateBoard(const Sighting& sighting, const Target& target, const CameraInfo& camera) {
  if (!sighting.isUsed()) {
    return Error{sighting.rejection == Rejection::NotFound ? Error::Code::NotFound : Error::Code::InvalidArgument,
                 fmt::format("no board to take a pose from: {}{}{}", nameOf(sighting.rejection),
                             sighting.detail.empty() ? "" : ": ", sighting.detail)};
  }
  if (sighting.corners.size() < kFewest)
    return Error{Error::Code::NotFound,
                 fmt::format("only {} of the board's corners are seen; a pose takes {}",
                             sighting.corners.size(), kFewest)};
  const Surface surface{target, 0};
  const Observed view = observed(sighting.corners);
  const LensParameters lens = lensOf(camera);
  const auto pose = poseOf(surface, view, lens);
  if (!pose) return Error{Error::Code::NotFound, "the board's corners have no pose with this lens"};
  const double rms = rmsOf(residuals(surface, view, lens, *pose));
  BoardPose other = mirrored(surface, view, *pose);
  refinePose(surface, view, lens, other);
  const double turned = Eigen::AngleAxisd{other.rotation * pose->rotation.transpose()}.angle();
  const double other_rms = rmsOf(residuals(surface, view, lens, other));
  if (turned > 0.02 && other_rms < kMirrored * rms) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("the board may as well be tilted the other way, by {:.0f} degrees ({:.2f} px instead of "
                    "{:.2f}): it is "
                    "too small in the image, or too square to the axis; bring it nearer or tilt it more",
                    turned * 180.0 / std::numbers::pi, other_rms, rms)};
  }
  const double n = static_cast<double>(view.corners.size()), degrees = 2.0 * n - 6.0;
  BoardSighting result{.rms_px = rms, .corners = view.corners.size()};
  Eigen::Matrix<double, 6, 1> metres;
  metres << 1, 1, 1, 1e-3, 1e-3, 1e-3;
  const Matrix6d covariance =
      covarianceOf(surface, target, view, lens, *pose, rms * std::sqrt(n / degrees), degrees);
  result.camera_from_board = {.pose = transformOf(*pose),
                              .covariance = metres.asDiagonal() * covariance * metres.asDiagonal(),
                              .degrees = degrees};
  return result;
}

Result<BoardSighting> locateBoard(const Image<float>& amplitude, const Target& target,
                                  const CameraInfo& camera) {
  if (amplitude.width() != camera.width || amplitude.height() != camera.height) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("the image has {} x {} pixels, but the lens was calibrated with {} x {}",
                             amplitude.width(), amplitude.height(), camera.width, camera.height)};
  }
  if (const auto told = tellsItsPose(target); !told) return told.error();
  return locateBoard(findBoard(amplitude, target), target, camera);
}

Eigen::Matrix<double, 6, 1> halfWidths(const Matrix6d& covariance, double degrees) {
  return studentQuantile(degrees) * covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
}

std::string uncertaintyInWords(const Matrix6d& covariance, double degrees) {
  const auto half = halfWidths(covariance, degrees);
  constexpr double kDegree = 180.0 / std::numbers::pi;
  return fmt::format("x {:.2g}, y {:.2g}, z {:.2g} mm; turned by {:.2g}, {:.2g}, {:.2g} degrees",
                     1e3 * half[3], 1e3 * half[4], 1e3 * half[5], kDegree * half[0], kDegree * half[1],
                     kDegree * half[2]);
}

}  // namespace toftwin::intrinsics
