// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/planes.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "calib/intrinsics/gauss_newton.h"
#include "calib/linear/linear.h"

namespace toftwin::intrinsics {
namespace {

constexpr double kTukey = 4.685;  // 95 % efficient for normal errors

Eigen::Vector3d eigenOf(Vec3d v) { return {v.x, v.y, v.z}; }

/// Parts of the image, whose pixels may err alike: a camera's own errors of range bend over some tenths of its image.
constexpr int kPartsAcross = 4, kPartsDown = 3;

struct Rays {
  std::vector<Eigen::Vector3d> rays;
  std::vector<double> range_m;
  std::vector<std::size_t> part;
};

Rays raysOf(const Image<float>& range_m, const CameraInfo& camera, std::span<const std::uint32_t> pixels) {
  Rays all;
  for (const std::uint32_t pixel : pixels) {
    if (!(range_m[pixel] > 0.0f)) continue;
    const int width = range_m.width(), at = static_cast<int>(pixel);
    all.rays.push_back(eigenOf(rayThroughPixel(camera, at % width, at / width).v));
    all.range_m.push_back(static_cast<double>(range_m[pixel]));
    all.part.push_back(static_cast<std::size_t>(at / width * kPartsDown / range_m.height() * kPartsAcross +
                                                at % width * kPartsAcross / width));
  }
  return all;
}

/// Range less that of the plane.
double errorOf(const Rays& all, const Eigen::Vector3d& m, std::size_t i) {
  return all.range_m[i] - 1.0 / m.dot(all.rays[i]);
}

/// m of the plane.
Eigen::Vector3d measuredOf(const SeenPlane& plane) { return eigenOf(plane.normal.v) / plane.distance_m; }

/// 1.4826 times the median magnitude: σ of normal errors.
double spreadOf(const Rays& all, const Eigen::Vector3d& m) {
  std::vector<double> size;
  for (std::size_t i = 0; i < all.rays.size(); ++i) size.push_back(std::abs(errorOf(all, m, i)));
  const auto middle = size.begin() + static_cast<std::ptrdiff_t>(size.size() / 2);
  std::nth_element(size.begin(), middle, size.end());
  return 1.4826 * *middle;
}

}  // namespace

Result<SeenPlane> fitPlane(const Image<float>& range_m, const CameraInfo& camera,
                           std::span<const std::uint32_t> pixels) {
  const auto refuse = [](std::string why) {
    return Error{Error::Code::InvalidArgument, "plane: " + std::move(why)};
  };
  if (range_m.width() != camera.width || range_m.height() != camera.height)
    return refuse("the image is of another size than the lens");
  if (std::ranges::any_of(pixels, [&](std::uint32_t pixel) { return pixel >= range_m.size(); }))
    return refuse("a pixel is outside the image");
  const Rays all = raysOf(range_m, camera, pixels);
  if (all.rays.size() < 20)
    return refuse(fmt::format("{} of {} pixels are valid; it takes 20", all.rays.size(), pixels.size()));
  std::vector<double> robust(all.rays.size(), 1.0);
  Eigen::Vector3d m;
  Eigen::Matrix3d normal;
  for (int round = 0; round < 20; ++round) {
    normal.setZero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < all.rays.size(); ++i) {
      const double r2 = all.range_m[i] * all.range_m[i], w = robust[i] * r2 * r2;
      normal += w * all.rays[i] * all.rays[i].transpose();
      right += w / all.range_m[i] * all.rays[i];
    }
    const Eigen::VectorXd spans = linear::eigenvalues(normal);
    if (!(spans[0] > 1e-9 * spans[2]))
      return refuse("its pixels lie on one line");
    m = linear::Ldlt{normal}.solve(right);
    const double spread = std::max(spreadOf(all, m), 1e-9);
    for (std::size_t i = 0; i < all.rays.size(); ++i) {
      const double u = errorOf(all, m, i) / (kTukey * spread);
      robust[i] = std::abs(u) < 1.0 ? (1.0 - u * u) * (1.0 - u * u) : 0.0;
    }
  }
  // Errors of a robust fit (P. J. Huber, Robust Statistics, ch. 7): σ² Σ ψ² / (Σ ψ′)² in the place of σ²/n.
  double psi2 = 0.0, slope = 0.0, squares = 0.0;
  std::size_t used = 0;
  const double reach = kTukey * std::max(spreadOf(all, m), 1e-9);
  Eigen::Matrix3d plain = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < all.rays.size(); ++i) {
    const double e = errorOf(all, m, i), u2 = (e / reach) * (e / reach), r2 = all.range_m[i] * all.range_m[i];
    plain += r2 * r2 * all.rays[i] * all.rays[i].transpose();
    if (u2 >= 1.0) continue;
    psi2 += e * e * std::pow(1.0 - u2, 4);
    slope += (1.0 - u2) * (1.0 - 5.0 * u2);
    squares += e * e;
    ++used;
  }
  const double n = static_cast<double>(all.rays.size());
  const double variance = psi2 / (n - 3.0) / ((slope / n) * (slope / n));
  const Eigen::Vector3d towards = -m.normalized();
  std::vector<SharedInformation> parts(kPartsAcross * kPartsDown, {Eigen::MatrixXd::Zero(3, 3), Eigen::VectorXd::Zero(3)});
  for (std::size_t i = 0; i < all.rays.size(); ++i) {
    const double e = errorOf(all, m, i), u2 = (e / reach) * (e / reach), r2 = all.range_m[i] * all.range_m[i];
    SharedInformation& part = parts[all.part[i]];
    part.information += r2 * r2 / variance * all.rays[i] * all.rays[i].transpose();
    if (u2 >= 1.0) continue;
    const double psi = e * (1.0 - u2) * (1.0 - u2);
    part.gradient -= r2 * psi / (slope / n * variance) * all.rays[i];
  }
  std::erase_if(parts, [](const SharedInformation& part) { return part.information.isZero(0.0); });
  return SeenPlane{.normal = {{towards.x(), towards.y(), towards.z()}},
                   .distance_m = -1.0 / m.norm(),
                   .covariance = variance * linear::inverse(plain),
                   .rms_mm = 1e3 * std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, used))),
                   .pixels = used,
                   .parts = std::move(parts)};
}

namespace {

/// Σ n nᵀ of the planes' normals: how much they say of each direction.
Eigen::Matrix3d spreadOf(std::span<const KnownPlane> planes) {
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const KnownPlane& plane : planes) spread += eigenOf(plane.normal.v) * eigenOf(plane.normal.v).transpose();
  return spread;
}

Error refuse(const char* why) {
  return {Error::Code::InvalidArgument, fmt::format("a pose from planes: {}", why)};
}

}  // namespace

Result<> tellThePose(std::span<const KnownPlane> planes) {
  if (planes.size() < 3) return refuse("it takes three planes");
  if (linear::eigenvalues(spreadOf(planes))[0] < 0.02)
    return refuse("the planes' normals lie nearly in one plane, so that the camera may slide along them");
  return {};
}

Result<KnownPose<World, Camera>> poseFromPlanes(std::span<const SeenPlane> seen,
                                                std::span<const KnownPlane> known) {
  if (seen.size() != known.size()) return refuse("each plane that is seen needs the one that it is");
  if (auto told = tellThePose(known); !told) return told.error();
  const Eigen::Matrix3d spread = spreadOf(known);
  Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < seen.size(); ++i)
    turn += eigenOf(known[i].normal.v) * eigenOf(seen[i].normal.v).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd{turn, Eigen::ComputeFullU | Eigen::ComputeFullV};
  Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
  if (rotation.determinant() < 0.0)
    rotation = svd.matrixU() * Eigen::Vector3d{1, 1, -1}.asDiagonal() * svd.matrixV().transpose();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < seen.size(); ++i)
    right += (known[i].distance_m - seen[i].distance_m) * eigenOf(known[i].normal.v);
  const Eigen::Vector3d place = linear::Ldlt{spread}.solve(right);
  std::vector<Eigen::Matrix3d> whiten;
  for (const SeenPlane& plane : seen)
    whiten.emplace_back(linear::choleskyOf(plane.covariance));
  const auto poseAt = [&](const Eigen::VectorXd& step) {
    const Eigen::Vector3d w = step.head<3>();
    const double angle = w.norm();
    const Eigen::Matrix3d by =
        angle > 0.0 ? Eigen::AngleAxisd{angle, w / angle}.toRotationMatrix() : Eigen::Matrix3d::Identity();
    return std::pair<Eigen::Matrix3d, Eigen::Vector3d>{by * rotation, place + step.tail<3>()};
  };
  const auto planeAt = [&](const Eigen::VectorXd& step, std::size_t i) -> Eigen::Vector3d {
    const auto [r, t] = poseAt(step);
    const Eigen::Vector3d n = eigenOf(known[i].normal.v);
    return r.transpose() * n / (known[i].distance_m - n.dot(t));
  };
  const auto settled = settle(
      [&](const Eigen::VectorXd& step) {
        Eigen::VectorXd all(3 * static_cast<Eigen::Index>(seen.size()));
        for (std::size_t i = 0; i < seen.size(); ++i) {
          all.segment<3>(3 * static_cast<Eigen::Index>(i)) =
              whiten[i].triangularView<Eigen::Lower>().solve(measuredOf(seen[i]) - planeAt(step, i));
        }
        return all;
      },
      6);
  if (!settled) return refuse("what is seen fits no place of the camera");
  const auto [r, t] = poseAt(settled->step);
  const Eigen::Quaterniond q{r};
  double pixels = 0.0;
  for (const SeenPlane& plane : seen) pixels += static_cast<double>(plane.pixels);
  const double degrees = pixels - 6.0;
  // What each part of the image says of the pose, of what it says of the plane that the pose puts there.
  std::vector<SharedInformation> parts;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    Eigen::Matrix<double, 3, 6> slope;
    for (Eigen::Index k = 0; k < 6; ++k) {
      const Eigen::VectorXd by = 1e-6 * Eigen::VectorXd::Unit(6, k);
      slope.col(k) = (planeAt(settled->step + by, i) - planeAt(settled->step - by, i)) / 2e-6;
    }
    const Eigen::Vector3d moved = planeAt(settled->step, i) - measuredOf(seen[i]);
    for (const SharedInformation& part : seen[i].parts)
      parts.push_back({slope.transpose() * part.information * slope,
                       slope.transpose() * (part.gradient - part.information * moved)});
  }
  const Eigen::VectorXd wider =
      widenedBy(clusteredErrors(parts), settled->covariance.diagonal().cwiseSqrt(), degrees);
  return KnownPose<World, Camera>{.pose = {{q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}},
                                  .covariance = wider.asDiagonal() * settled->covariance * wider.asDiagonal(),
                                  .degrees = degrees};
}

}  // namespace toftwin::intrinsics
