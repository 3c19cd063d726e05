// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include <toftwin/camera_info.h>
#include <toftwin/geometry.h>
#include <toftwin/image.h>
#include <toftwin/result.h>

#include "calib/intrinsics/detect.h"
#include "calib/intrinsics/target.h"

/// Where a camera stands, from what it sees: a board, planes, or a rig whose camera was calibrated to it.
namespace toftwin::intrinsics {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// A pose and how well it is known: a small turn about the axes of `To` (rad) and a shift (m), in this order.
template <class To, class From>
struct KnownPose {
  Transform<To, From> pose{};
  Matrix6d covariance = Matrix6d::Zero();
  double degrees = 0.0;  ///< of freedom, for Student's quantile
};

struct BoardSighting {
  KnownPose<Camera, Board> camera_from_board{};
  double rms_px = 0.0;
  std::size_t corners = 0;
};

/// The board of this target in an image of amplitude, seen through a lens that is known and that the result
/// trusts. The corners' errors are taken from how well they fit, σ² = Σ r² / (2n − 6), as independent; where rows or
/// columns of the board contradict each other by 1.5 times more than that, from how much they do.
/// Errors: no board, or one of no use (with the reason); an image of another size than the lens; a board so
/// small or far that its mirrored pose fits nearly as well.
Result<BoardSighting> locateBoard(const Image<float>& amplitude, const Target& target,
                                  const CameraInfo& camera);
/// The same from corners that were found.
Result<BoardSighting> locateBoard(const Sighting& sighting, const Target& target, const CameraInfo& camera);

/// "x 0.3, y 0.2, z 1.1 mm; turned by 0.05, 0.04, 0.01 degrees": half widths of 95 % intervals.
std::string uncertaintyInWords(const Matrix6d& covariance, double degrees);
/// Half widths of the 95 % intervals: rad and m.
Eigen::Matrix<double, 6, 1> halfWidths(const Matrix6d& covariance, double degrees);

}  // namespace toftwin::intrinsics
