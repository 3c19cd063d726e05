// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "calib/loop/grammar.h"
#include "calib/loop/projection.h"

namespace toftwin::loop {

/// Where shapes are fitted: residuals beside a model that is known.
struct Beside {
  const Evidence& evidence;
  const Eigen::VectorXd& y;
  const Eigen::VectorXd& weight;
  const Eigen::MatrixXd model;  ///< columns of everything else
  double scale = 1.0;            ///< deviation of the noise in units of sigma
};

/// What shapes leave beside a model, of some of the rows. It refers to the evidence that it is made of.
class Left {
 public:
  /// Of at most about so many rows.
  Left(const Beside& beside, Eigen::Index most);
  Left(const Left&) = delete;
  Left& operator=(const Left&) = delete;

  [[nodiscard]] const Evidence& evidence() const { return *evidence_; }
  [[nodiscard]] const Eigen::VectorXd& y() const { return y_; }
  [[nodiscard]] const Eigen::VectorXd& weight() const { return weight_; }
  [[nodiscard]] const Eigen::MatrixXd& model() const { return model_; }

  /// Weighted sum of squares without the shape, and with it.
  [[nodiscard]] double before() const { return left_.squaredNorm(); }
  [[nodiscard]] double operator()(const Shape& shape) const;
  /// Of several shapes whose columns stand side by side. Of many shapes of one or two columns those that hardly go with the
  /// residual are not looked at, and leave all. `unit`: variance of the noise, in units of the weights.
  [[nodiscard]] std::vector<double> each(const Eigen::MatrixXd& columns, const std::vector<Shape>& shapes, double unit) const;
  /// Of these columns, beside the model.
  [[nodiscard]] Eigen::VectorXd coefficients(const Eigen::MatrixXd& columns) const;

 private:
  /// With columns from which the model is projected out.
  [[nodiscard]] double after(Eigen::MatrixXd x) const;

  const Evidence* evidence_;
  Evidence part_{};
  Eigen::VectorXd weight_, y_;
  Eigen::MatrixXd model_;
  std::optional<Projection> projection_;
  Eigen::VectorXd left_;
};

}  // namespace toftwin::loop
