// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/clusters.h"

#include <cmath>
#include <cstddef>

#include "calib/linear/linear.h"

namespace toftwin::intrinsics {
namespace {

Eigen::MatrixXd totalOf(const std::vector<SharedInformation>& clusters) {
  Eigen::MatrixXd total = clusters.front().information;
  for (std::size_t v = 1; v < clusters.size(); ++v) total += clusters[v].information;
  return total;
}

/// L (1 − M_v)^(−1/2) L⁻¹ of each cluster.
std::vector<Eigen::MatrixXd> stretches(const std::vector<SharedInformation>& clusters, const Eigen::MatrixXd& total) {
  const Eigen::MatrixXd lower = linear::choleskyOf(total);
  const Eigen::MatrixXd back =
      linear::solveLowerEach(lower, Eigen::MatrixXd::Identity(total.rows(), total.cols()));
  std::vector<Eigen::MatrixXd> all;
  for (const SharedInformation& cluster : clusters) {
    const Eigen::MatrixXd share = back * cluster.information * back.transpose();
    const auto [values, vectors] = linear::eigenpairs(0.5 * (share + share.transpose()));
    constexpr double kMostShare = 0.95;  // a cluster that alone knows a parameter cannot be checked by others
    const Eigen::VectorXd stretch = (1.0 - values.array().min(kMostShare)).sqrt().inverse().matrix();
    all.emplace_back(lower * linear::composed(vectors, stretch) * back);
  }
  return all;
}

}  // namespace

std::vector<Eigen::VectorXd> unbent(const std::vector<SharedInformation>& clusters, const Eigen::MatrixXd& total) {
  const auto by = stretches(clusters, total);
  std::vector<Eigen::VectorXd> gradients;
  for (std::size_t v = 0; v < clusters.size(); ++v) gradients.emplace_back(by[v] * clusters[v].gradient);
  return gradients;
}

ClusteredErrors clusteredErrors(const std::vector<SharedInformation>& clusters) {
  const Eigen::MatrixXd total = totalOf(clusters), inverse = linear::inverse(total);
  const auto by = stretches(clusters, total);
  const auto count = static_cast<Eigen::Index>(clusters.size()), parameters = total.rows();
  ClusteredErrors errors{.standard = Eigen::VectorXd::Zero(parameters), .degrees = Eigen::VectorXd::Zero(parameters)};
  for (Eigen::Index k = 0; k < parameters; ++k) {
    // Number k moves by aᵥ · gᵥ; where all observations err alike, cov(gᵥ, gᵤ) = σ² (δᵥᵤ Sᵥ − Sᵥ S⁻¹ Sᵤ).
    Eigen::MatrixXd by_gradient(parameters, count), by_all(parameters, count);
    Eigen::VectorXd own(count);
    double variance = 0.0;
    for (Eigen::Index v = 0; v < count; ++v) {
      const auto& [information, gradient] = clusters[static_cast<std::size_t>(v)];
      by_gradient.col(v) = by[static_cast<std::size_t>(v)].transpose() * inverse.col(k);
      by_all.col(v) = information * by_gradient.col(v);
      own[v] = by_gradient.col(v).dot(by_all.col(v));
      const double moved = by_gradient.col(v).dot(gradient);
      variance += moved * moved;
    }
    Eigen::MatrixXd alike = -by_all.transpose() * inverse * by_all;
    alike.diagonal() += own;
    errors.standard[k] = std::sqrt(variance);
    errors.degrees[k] = alike.trace() * alike.trace() / alike.squaredNorm();
  }
  return errors;
}

Eigen::VectorXd widenedBy(const ClusteredErrors& clustered, const Eigen::VectorXd& independent, double degrees) {
  Eigen::VectorXd by = Eigen::VectorXd::Ones(independent.size());
  for (Eigen::Index k = 0; k < by.size(); ++k) {
    const double ratio = clustered.standard[k] / independent[k];
    if (ratio > kClustered) by[k] = ratio * studentQuantile(clustered.degrees[k]) / studentQuantile(degrees);
  }
  return by;
}

double studentQuantile(double degrees) {
  constexpr double z = 1.959964;  // 97.5 % of a normal distribution lie below
  constexpr double z3 = z * z * z, z5 = z3 * z * z;
  return z + (z3 + z) / (4.0 * degrees) + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * degrees * degrees);
}

}  // namespace toftwin::intrinsics
