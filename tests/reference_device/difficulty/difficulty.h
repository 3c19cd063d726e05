// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tests/reference_device/device/device.h"

namespace toftwin::reference {

/// One capture of a plan, as the device is set.
struct Setting {
  std::string scene;  ///< key of the rooms
  State state{};
  std::uint64_t first_frame = 0;
};

/// How hard it is to find what is hidden: λ, the χ² that it would add to a campaign free of noise, in the
/// logarithm of amplitude and in range, after everything is projected out that pose errors and light of each
/// capture (as random effects with the rig's standard deviations) and the device's delay and gain (as
/// unknowns) could explain.
class Difficulty {
 public:
  /// The rooms by the settings' keys.
  Difficulty(std::map<std::string, Room> rooms, Datasheet sheet, std::vector<Setting> settings, int frames);

  [[nodiscard]] double lambda(const std::filesystem::path& sealed, double scale) const;
  /// By what the strengths are to be multiplied so that λ is that; 0 where no scale does it.
  [[nodiscard]] double scaleFor(const std::filesystem::path& sealed, double lambda) const;

 private:
  /// A capture without anything hidden.
  struct Plain {
    Measured measured;
    std::vector<double> weight;                  ///< 1/σ of ln amplitude in one frame, per pixel
    std::vector<std::vector<double>> nuisances;  ///< whitened: three shifts, three turns, gain
  };
  using Rows = std::vector<double>;  ///< ln amplitudes, then ranges, in units of their noise
  [[nodiscard]] Rows rows(const Plain& plain, const Measured& other) const;

  std::map<std::string, Room> rooms_;
  Datasheet sheet_;
  std::vector<Setting> settings_;
  int frames_;
  double metre_per_rad_;
  std::vector<Plain> plain_;
};

}  // namespace toftwin::reference
