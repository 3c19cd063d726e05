// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <cstddef>
#include <vector>

namespace toftwin::sim::testing {

/// Time-resolved radiosity, all bounces, of two Lambertian walls that meet at 90°: A is y = 0,
/// 0 < x < 1 m, B is x = 0, 0 < y < 1 m, both |z| < 0.5 m. Whatever lights them lies in the bisecting plane, so
/// wall B's phasors are wall A's, mirrored, and one wall is enough:
///
///     B(x, z) = E(x, z) + ρ ∫∫ x y / (π d⁴) e^{−ikd} B(y, z') dy dz',    d² = x² + y² + (z − z')²
///
/// Nyström's method on nodes even in ln x (the kernel is homogeneous: near the edge B is smooth in
/// ln x and in nothing else) and on Chebyshev's in z; the inner integral runs over ln y and over
/// t with z' = z + √(x² + y²) sinh t, which flattens the kernel's peak to cosh⁻³ t. The matrix depends on
/// k alone.
class CornerRadiosity {
 public:
  /// How fine; doubled, the result shows its own error.
  struct Grid {
    int along = 64;    ///< nodes in ln x
    int across = 11;   ///< nodes in z, odd
    int angles = 24;   ///< of the inner integral over t
  };
  CornerRadiosity(double wavenumber, Grid grid);

  /// e = −arg(P e^{2ikr}) / 2k in metres, of the place (u, 0, 0) seen by a camera with an isotropic
  /// point light in its pinhole, on the bisector at `distance` from the edge, at half height.
  [[nodiscard]] double error(double distance, double albedo, double u) const;

 private:
  using Complex = std::complex<double>;
  /// Weights of the nodes around one place.
  struct Weights {
    std::size_t first_along;
    double along[4];
    std::vector<double> across;
  };
  [[nodiscard]] Weights weightsAt(double log_x, double z) const;
  /// The row of the integral's matrix for the place (x, z): weights of all nodes, [along][across].
  [[nodiscard]] std::vector<Complex> row(double x, double z) const;
  [[nodiscard]] std::vector<Complex> solve(double side, double albedo) const;

  double k_;
  Grid grid_;
  std::vector<double> log_x_, z_, z_weights_;
  std::vector<std::vector<Complex>> matrix_;
};

}  // namespace toftwin::sim::testing
