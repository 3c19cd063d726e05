// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <cstddef>
#include <vector>

namespace toftwin::sim::testing {

/// Time-resolved radiosity of two Lambertian walls that meet at 90°: A is y = 0, 0 < x < length, B is x = 0,
/// 0 < y < length, both |z| < half_height. A camera with an isotropic point light (1 W/sr) in its pinhole stands on the
/// bisector at `distance` from the edge, at z = 0, so that wall B's phasors are wall A's, mirrored, and one wall is enough:
///
///     B(x, z) = E(x, z) + ρ ∫∫ x y / (π d⁴) e^{−ikd} B(y, z') dy dz',    d² = x² + y² + (z − z')²
///     E(x, z) = a / r³ e^{−ikr},    a = distance / √2,    r² = (x − a)² + a² + z²
///
/// Nyström's method for S = B / E, from which the light's own phase and fall-off are gone, on nodes even in ln x (the
/// kernel is homogeneous: near the edge B is smooth in ln x and in nothing else) and on Chebyshev's in asinh z / 0.5 m;
/// S is even in z. The inner integral runs over ln y and over t with z' = z + √(x² + y²) sinh t, which flattens the
/// kernel's peak to cosh⁻³ t.
class CornerRadiosity {
 public:
  struct Walls {
    double length = 1.0, half_height = 0.5;  ///< m
    /// Light that starts nearer to the edge is left out: of what reaches u, less than the share (nearest / u)².
    double nearest = 1e-4;
  };
  /// How fine; doubled, the result shows its own error.
  struct Grid {
    int along = 64;    ///< nodes in ln x
    int across = 11;   ///< nodes in z, odd
    int angles = 24;   ///< of the inner integral over t
  };
  static constexpr int kAllSurfaces = 1000;

  CornerRadiosity(double wavenumber, double distance, Walls walls, Grid grid);

  /// e = −arg(P e^{2ikr}) / 2k in metres, of the place (u, 0, 0), over so many surfaces.
  [[nodiscard]] double error(double albedo, double u, int surfaces = kAllSurfaces) const;

 private:
  using Complex = std::complex<double>;
  /// Weights of the nodes around one place.
  struct Weights {
    std::size_t first_along;
    double along[4];
    std::vector<double> across;
  };
  [[nodiscard]] Complex direct(double x, double z) const;
  [[nodiscard]] Weights weightsAt(double log_x, double z) const;
  /// The row of the integral's matrix for the place (x, z): weights of all nodes, [along][across].
  [[nodiscard]] std::vector<Complex> row(double x, double z) const;
  [[nodiscard]] std::vector<Complex> solve(double albedo, int bounces) const;

  double k_, side_;
  Walls walls_;
  Grid grid_;
  std::size_t distinct_;  ///< nodes in z that are not others' mirror images
  std::vector<double> log_x_, turns_, turn_weights_;  ///< asinh z / 0.5 m
  std::vector<std::vector<Complex>> matrix_;
};

}  // namespace toftwin::sim::testing
