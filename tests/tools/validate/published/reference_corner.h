// SPDX-License-Identifier: Apache-2.0
#pragma once

// The arbiter between two simulators of a corner: a path tracer of its own, and closed forms. It knows one published
// simulation, so it is no part of the program.

#include <cstdint>
#include <span>
#include <vector>

#include <toftwin/geometry.h>
#include <toftwin/units.h>

namespace toftwin::published {

/// The material of the published simulator: Oren and Nayar's full model (1994, equations 27 to 29,
/// interreflection within the cavities included) for the light that is not mirrored, and a
/// Torrance–Sparrow lobe with Beckmann's distribution for the mirrored share,
///   f = (1 − F) f_diffuse + D G F / (4 cos θ_i cos θ_o),
/// F the Fresnel reflectance of a dielectric at the half angle. `roughness` is σ of the diffuse
/// part in radians and gives the lobe's α by Walter's fit. Roughness < 0: plain Lambertian, no F.
struct PublishedMaterial {
  double albedo = 0.9;
  double roughness = 0.5;
  double refractive_index = 1.52;
};

/// Where F of light that comes straight from an emitter is taken: at half the angle between view
/// and light, as Fresnel's equations say, or at the whole angle, which is what explains the
/// published curves (docs/results.md). For light from another surface theirs is the half angle too.
enum class EmitterFresnel { HalfAngle, WholeAngle };

/// f for unit vectors n, view, light on the side of n. [1/sr]
double reflectance(const PublishedMaterial& material, Vec3d n, Vec3d view, Vec3d light,
                   EmitterFresnel fresnel = EmitterFresnel::HalfAngle);

/// A corner of two upright boards at 90° whose edge is `depth_m` before the camera on the axis; the
/// camera looks along the bisector at half height. Units: metres, camera frame.
struct SymmetricCorner {
  double depth_m = 2.0;
  double board_m = 1.4142135623730951;  ///< length of each board from the edge
  double height_m = 2.0;
};

struct CornerTrace {
  SymmetricCorner corner{};
  PublishedMaterial material{};
  EmitterFresnel fresnel = EmitterFresnel::HalfAngle;
  std::vector<Vec3d> emitters_m{{-0.020, 0, 0}, {-0.025, 0, 0}, {-0.030, 0, 0}};
  std::vector<Frequency> frequencies{30_MHz};
  int max_surfaces = 2;
  /// Hits nearer than this are not seen, as with a ray offset of that size; 0: none, as it should
  /// be. Only for docs/edge-of-the-corner.md.
  double minimum_ray_m = 0.0;
  int paths = 4096;
  std::uint64_t seed = 1;
};

/// What multipath adds to the range along the rays t = x/z, in mm: the range of pure sines with all
/// light minus that with direct light alone, [frequency][ray]. Plain Monte-Carlo in double
/// precision, independent of sim/tracer; `sigma_mm` is the standard error of the first frequency.
struct CornerErrors {
  std::vector<std::vector<double>> error_mm;
  std::vector<double> sigma_mm;
};
CornerErrors traceCorner(const CornerTrace& what, std::span<const double> t);

/// What the published four-bucket camera reads minus the truth, for one return at `range_m`:
/// emitted and demodulated by square waves, φ = atan2(C3 − C4, C1 − C2). [mm]
double squareWaveError_mm(double range_m, Frequency f);

/// The published pulsed camera: two gates as long as the pulse and light that both collect alike.
/// Reading minus truth for a return of strength 1 / `weakness` (relative to the constant light) at
/// a range, in mm; a return later than both gates loses its end.
double twoGateError_mm(double range_m, Frequency f, double weakness);

}  // namespace toftwin::published
