// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <cstddef>
#include <functional>
#include <vector>

#include <toftwin/geometry.h>

#include "tests/reference_device/device/room.h"

namespace toftwin::reference {

struct RadiosityOptions {
  /// A patch is at most this share as long as the next board, or the end of its own, is away, and of 20 cm.
  double fineness = 0.3;
  double least_transfer_m =
      0.0;  ///< light between places that are nearer to each other than this is left out
};

/// Light that matt boards exchange, with its phase: the irradiance of patch i is
///     H_i = E_i + Σ_j F_ij ρ_j H_j e^(−ik d_ij)
/// with the form factor F_ij from the middle of i to the whole of j (Lambert's formula for polygons, J. H.
/// Lambert, Photometria, 1760) and the distance of the middles d_ij. Each of the light's wavenumbers is
/// solved by itself; 0 is the unmodulated light.
class Radiosity {
 public:
  Radiosity(const Room& room, const RadiosityOptions& options);

  using Source = std::function<std::vector<std::complex<double>>(Vec3d at_m, Vec3d normal)>;
  /// H of every patch, for each wavenumber.
  struct Solution {
    std::vector<double> wavenumbers;
    std::vector<std::vector<std::complex<float>>> irradiance;
  };
  /// `direct` gives what light sources shine on a place, for each wavenumber.
  [[nodiscard]] Solution solve(const std::vector<double>& wavenumbers, const Source& direct) const;
  /// What the boards shine on a place, for each wavenumber; direct light not included.
  [[nodiscard]] std::vector<std::complex<double>> gather(const Solution& solution, std::size_t board,
                                                         Vec3d at_m, Vec3d normal) const;
  /// Whether no board gets light from another.
  [[nodiscard]] bool empty() const { return patches_.empty(); }

 private:
  struct Patch {
    std::size_t board = 0;
    Vec3d middle{}, normal{}, a{}, b{}, corners[4]{};  ///< a, b: half edges
    double area = 0.0, albedo = 0.0;
  };
  /// A part of a board, in units of its half edges.
  struct Part {
    double u0 = -1.0, u1 = 1.0, v0 = -1.0, v1 = 1.0;
  };
  struct Transfer {
    std::size_t from = 0;
    float factor = 0.0F;  ///< F ρ
    float distance_m = 0.0F;
  };
  /// What a place gets of a patch's light, and how far it comes on the average.
  struct Exchange {
    double factor = 0.0, distance_m = 0.0;
  };
  [[nodiscard]] double formFactor(Vec3d at_m, Vec3d normal, const Patch& patch) const;
  [[nodiscard]] Exchange exchange(Vec3d at_m, Vec3d normal, const Patch& patch) const;
  void addSide(std::size_t board, double side, const std::vector<std::size_t>& others, const Part& part);
  void connect();
  [[nodiscard]] std::vector<std::complex<float>> bounced(const std::vector<std::complex<float>>& source,
                                                         double wavenumber) const;

  Room room_;
  RadiosityOptions options_;
  std::vector<Patch> patches_;
  std::vector<std::vector<Transfer>> transfers_;  ///< to each patch
};

}  // namespace toftwin::reference
