// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Lens, window and sensor scatter a share of all light over the image, phase and all:
///     P̃ = (1 − s − h) P + s ⟨P⟩ + h (G * P)
/// for each frequency's and harmonic's phasor and for the unmodulated light, with ⟨P⟩ the mean of
/// the image (the even veil) and G a Gaussian of standard deviation `halo_radius` (light that leaves
/// the image is lost). Dark or far pixels are pulled towards the phase of
/// what is bright. Needs the whole image: on a traced region the veil and the halo see only that
/// region.
struct LensScatter {
  double veil = 0.01;
  double halo = 0.02;
  double halo_radius = 15.0;  ///< pixels

  static constexpr About about{
      .name = "lens_scatter",
      .summary = "a share of all light is spread over the image: an even veil and a Gaussian halo",
      .reference = "H. Schaefer, F. Lenzen, C. S. Garbe 2014 (veil); W. Kavli et al. 2008 (halo)",
      // Linear in the light: a brighter lamp alone changes nothing, a darker pixel among others
      // does.
      .explains = {Covariate::Amplitude, Covariate::Range, Covariate::Neighbours}};
  static LensScatter none() { return {.veil = 0.0, .halo = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("veil", veil, {0.0, 0.5}, "share s of the light that spreads evenly over the image");
    v.number("halo", halo, {0.0, 0.5}, "share h of the light that falls into the Gaussian halo");
    v.number("halo_radius_px", halo_radius, {0.5, 500.0},
             "standard deviation of the halo, in pixels");
  }
  /// What no single key can say of what is wrong, or nothing.
  [[nodiscard]] std::string problem() const;
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

/// Whether the halo is wide enough for ScatteredRows.
bool goesByRows(const LensScatter& lens);

/// What LensScatter::apply() gives, bit by bit, in strips of rows that are made where they are used. Looks at the
/// light as long as it lives; may be read from many threads.
class ScatteredRows {
 public:
  /// Of the phasors that are seen.
  ScatteredRows(const LensScatter& lens, const Light& light, std::span<const Harmonic> seen);
  ~ScatteredRows();

  /// A strip of so many rows to write into; what is not wanted is an empty image.
  [[nodiscard]] Light room(int rows) const;
  /// Writes the light's rows `top` … `top` + `rows` − 1 into the strip's first; `halo` is room for a row.
  void write(int top, int rows, std::vector<float>& halo, Light& part) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace toftwin::sim
