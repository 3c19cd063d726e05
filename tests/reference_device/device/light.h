// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <cstddef>
#include <vector>

#include <toftwin/geometry.h>

#include "tests/reference_device/device/datasheet.h"
#include "tests/reference_device/device/radiosity.h"
#include "tests/reference_device/device/room.h"

namespace toftwin::reference {

/// What reaches the pixels from one pose, free of noise, row by row. Radiances in W/(m² sr).
struct Light {
  int width = 0, height = 0;
  std::size_t frequencies = 0, harmonics = 0;
  std::vector<std::complex<double>> phasors;  ///< [(frequency · harmonics + n − 1) · pixels + pixel]
  std::vector<double> steady;                 ///< the same light, not modulated
  std::vector<double> albedo;                 ///< mean over the pixel; nothing there counts as 0
  std::vector<double> cosine;   ///< of the angle of incidence at the pixel's middle; NaN: nothing there
  std::vector<double> range_m;  ///< likewise, from the lens

  [[nodiscard]] std::size_t pixels() const { return steady.size(); }
  std::complex<double>& phasor(std::size_t f, std::size_t n, std::size_t pixel) {
    return phasors[(f * harmonics + n - 1) * pixels() + pixel];
  }
  [[nodiscard]] const std::complex<double>& phasor(std::size_t f, std::size_t n, std::size_t pixel) const {
    return phasors[(f * harmonics + n - 1) * pixels() + pixel];
  }
};

/// Light from the emitters by boards to the pixels: direct light by exact geometry, integrated over each
/// pixel's square; light between boards by radiosity (radiosity.h).
class Transport {
 public:
  Transport(Room room, const Datasheet& sheet, const RadiosityOptions& options = {});

  [[nodiscard]] Light see(const Transform<World, Camera>& world_from_camera) const;
  /// By how much a path of that length turns phase, in radians, at the fundamental of a frequency.
  [[nodiscard]] double wavenumber(std::size_t frequency) const { return wavenumbers_[frequency]; }
  [[nodiscard]] const Datasheet& sheet() const { return sheet_; }

 private:
  struct View;
  /// Whether there is anything.
  bool addDirect(Light& light, const View& view, std::size_t pixel, double u, double v, double weight) const;
  void addIndirect(Light& light, const View& view, std::size_t pixel, double u, double v, double weight) const;
  void seePixel(Light& light, const View& view, int x, int y) const;
  [[nodiscard]] double sizesToTheNext(const View& view, const Meeting& met, Vec3d ray) const;
  [[nodiscard]] bool isSmooth(const View& view, int x, int y) const;

  Room room_;
  Datasheet sheet_;
  std::vector<double> wavenumbers_;
  /// Harmonics that the waveforms have: where their phasors begin, and by how much a path's length turns
  /// them.
  struct Term {
    std::size_t frequency = 0, harmonic = 1;
    double wavenumber = 0.0;
  };
  std::vector<Term> terms_;
  Radiosity radiosity_;
};

/// Delays the light of a pixel as if its way there and back were that much longer.
void delay(Light& light, const Transport& transport, std::size_t pixel, double range_m);
/// Each pixel by what `millimetres(pixel)` says.
template <class Millimetres>
void delayEach(Light& light, const Transport& transport, const Millimetres& millimetres) {
  for (std::size_t i = 0; i < light.pixels(); ++i) delay(light, transport, i, 1e-3 * millimetres(i));
}

}  // namespace toftwin::reference
