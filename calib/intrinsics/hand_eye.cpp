// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/hand_eye.h"

#include <fmt/format.h>

#include <opencv2/calib3d.hpp>

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "calib/intrinsics/gauss_newton.h"
#include "calib/linear/linear.h"

namespace toftwin::intrinsics {
namespace {

using Rigid = Eigen::Isometry3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;

template <class To, class From>
Rigid rigidOf(const Transform<To, From>& t) {
  const auto& q = t.rotation_wxyz;
  Rigid rigid = Rigid::Identity();
  rigid.linear() = Eigen::Quaterniond{q[0], q[1], q[2], q[3]}.normalized().toRotationMatrix();
  rigid.translation() = Eigen::Vector3d{t.translation_m.x, t.translation_m.y, t.translation_m.z};
  return rigid;
}

template <class To, class From>
Transform<To, From> transformOf(const Rigid& rigid) {
  const Eigen::Quaterniond q{rigid.linear()};
  const Eigen::Vector3d t = rigid.translation();
  return {{q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}};
}

/// Turned about the axes of the frame that it leads to, and shifted.
Rigid moved(const Rigid& from, const Vector6d& step) {
  Rigid to = from;
  const Eigen::Vector3d w = step.head<3>();
  if (const double angle = w.norm(); angle > 0.0)
    to.linear() = Eigen::AngleAxisd{angle, w / angle} * from.linear();
  to.translation() += step.tail<3>();
  return to;
}

Vector6d differenceOf(const Rigid& a, const Rigid& b) {
  const Eigen::AngleAxisd turn{a.linear() * b.linear().transpose()};
  Vector6d difference;
  difference << turn.angle() * turn.axis(), a.translation() - b.translation();
  return difference;
}

/// Turns between views must be about two axes at least.
bool turnsEnough(const std::vector<Rigid>& rig) {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
  for (std::size_t i = 1; i < rig.size(); ++i) {
    const Eigen::AngleAxisd turn{rig[0].linear().transpose() * rig[i].linear()};
    const Eigen::Vector3d w = turn.angle() * turn.axis();
    axes += w * w.transpose();
  }
  constexpr double kLeast_rad = 0.02;
  return linear::eigenvalues(axes / static_cast<double>(rig.size()))[1] > kLeast_rad * kLeast_rad;
}

std::optional<Rigid> firstGuess(const std::vector<Rigid>& rig, const std::vector<Rigid>& board) {
  std::vector<cv::Mat> rig_turns, rig_shifts, board_turns, board_shifts;
  const auto put = [](const Rigid& from, std::vector<cv::Mat>& turns, std::vector<cv::Mat>& shifts) {
    cv::Mat turn(3, 3, CV_64F), shift(3, 1, CV_64F);
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) turn.at<double>(row, column) = from.linear()(row, column);
      shift.at<double>(row) = from.translation()[row];
    }
    turns.push_back(turn);
    shifts.push_back(shift);
  };
  for (std::size_t i = 0; i < rig.size(); ++i) {
    put(rig[i], rig_turns, rig_shifts);
    put(board[i], board_turns, board_shifts);
  }
  cv::Mat turn, shift;
  try {
    cv::calibrateHandEye(rig_turns, rig_shifts, board_turns, board_shifts, turn, shift,
                         cv::CALIB_HAND_EYE_PARK);
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  Rigid guess = Rigid::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) guess.linear()(row, column) = turn.at<double>(row, column);
    guess.translation()[row] = shift.at<double>(row);
  }
  if (!guess.matrix().allFinite()) return std::nullopt;
  return guess;
}

}  // namespace

Result<HandEye> handEye(std::span<const HandEyeView> views) {
  const auto refuse = [](std::string why) {
    return Error{Error::Code::InvalidArgument, "hand-eye: " + std::move(why)};
  };
  if (views.size() < 3) return refuse(fmt::format("{} views; it takes three", views.size()));
  std::vector<Rigid> rig, board;
  std::vector<Matrix6d> whiten;
  for (const HandEyeView& view : views) {
    rig.push_back(rigidOf(view.world_from_rig));
    board.push_back(rigidOf(view.camera_from_board.pose));
    whiten.emplace_back(linear::choleskyOf(view.camera_from_board.covariance));
    if (!whiten.back().allFinite() || !(whiten.back().diagonal().minCoeff() > 0.0))
      return refuse(fmt::format("view {} does not say how well its board is known", whiten.size()));
  }
  if (!turnsEnough(rig))
    return refuse(
        "the rig turns about less than two axes, by less than some degrees: where the camera sits along the "
        "axis stays open");
  const auto guess = firstGuess(rig, board);
  if (!guess) return refuse("no place of the camera on the rig explains the views");
  const Rigid rig_from_camera = *guess, world_from_board = rig[0] * *guess * board[0];
  const auto left = [&](const Eigen::VectorXd& step) {
    const Rigid x = moved(rig_from_camera, step.head<6>()), y = moved(world_from_board, step.tail<6>());
    Eigen::VectorXd all(6 * static_cast<Eigen::Index>(views.size()));
    for (std::size_t i = 0; i < views.size(); ++i) {
      const Rigid expected = (rig[i] * x).inverse() * y;
      all.segment<6>(6 * static_cast<Eigen::Index>(i)) =
          whiten[i].triangularView<Eigen::Lower>().solve(differenceOf(board[i], expected));
    }
    return all;
  };
  const auto settled = settle(left, 12);
  if (!settled) return refuse("the views leave a place open, or contradict each other");
  const double degrees = 6.0 * static_cast<double>(views.size()) - 12.0;
  HandEye result{.misfit = std::sqrt(settled->squares / degrees)};
  left(settled->step).reshaped(6, rig.size()).colwise().squaredNorm().maxCoeff(&result.worst_view);
  result.covariance_of_both = std::max(1.0, result.misfit * result.misfit) * settled->covariance;
  result.rig_from_camera = {.pose = transformOf<Rig, Camera>(moved(rig_from_camera, settled->step.head<6>())),
                            .covariance = result.covariance_of_both.topLeftCorner<6, 6>(),
                            .degrees = degrees};
  result.world_from_board = {
      .pose = transformOf<World, Board>(moved(world_from_board, settled->step.tail<6>())),
      .covariance = result.covariance_of_both.bottomRightCorner<6, 6>(),
      .degrees = degrees};
  return result;
}

Transform<World, Camera> worldFromCamera(const HandEye& known, const Transform<World, Rig>& world_from_rig) {
  return world_from_rig * known.rig_from_camera.pose;
}

/// Of board_from_camera = Y⁻¹ R X, with X the camera's place on the rig, R the rig and Y the board in its world:
///   turn: Yᵀ (R w_X − w_Y)    shift: Yᵀ (R t_X − t_Y + c × w_Y)    c: from the board to the camera
KnownPose<Board, Camera> boardFromCamera(const HandEye& known, const Transform<World, Rig>& world_from_rig) {
  const Rigid y = rigidOf(known.world_from_board.pose), r = rigidOf(world_from_rig),
              camera = r * rigidOf(known.rig_from_camera.pose);
  const Eigen::Matrix3d of_board = y.linear().transpose();
  const Eigen::Vector3d c = camera.translation() - y.translation();
  Eigen::Matrix3d c_cross;
  c_cross << 0, -c.z(), c.y(), c.z(), 0, -c.x(), -c.y(), c.x(), 0;
  Eigen::Matrix<double, 6, 12> slope = Eigen::Matrix<double, 6, 12>::Zero();
  slope.block<3, 3>(0, 0) = slope.block<3, 3>(3, 3) = of_board * r.linear();
  slope.block<3, 3>(0, 6) = slope.block<3, 3>(3, 9) = -of_board;
  slope.block<3, 3>(3, 6) = of_board * c_cross;
  return {.pose = transformOf<Board, Camera>(y.inverse() * camera),
          .covariance = slope * known.covariance_of_both * slope.transpose(),
          .degrees = known.rig_from_camera.degrees};
}

}  // namespace toftwin::intrinsics
