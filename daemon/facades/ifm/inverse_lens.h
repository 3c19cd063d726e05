// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include <toftwin/camera_info.h>

namespace toftwin::daemon::ifm {

/// The five terms (k1 k2 p1 p2 k3) that take distorted to undistorted image coordinates in the form in which
/// the lens' own take undistorted to distorted ones: a least-squares fit over the pixels, because there is no
/// exact one.
std::array<double, 5> inverseDistortion(const CameraInfo& camera);

}  // namespace toftwin::daemon::ifm
