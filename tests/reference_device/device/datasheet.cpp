// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/datasheet.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "protocol/settings/settings.h"

namespace toftwin::reference {

namespace {

double shapeOf(Datasheet::Wave wave, int n) {
  if (wave == Datasheet::Wave::Sine) return n == 1 ? 1.0 : 0.0;
  return n % 2 == 0 ? 0.0 : (n % 4 == 1 ? 1.0 : -1.0) / n;
}

}  // namespace

std::complex<double> contentOf(const Datasheet::Modulation& modulation, int n) {
  const double omega_tau = 2.0 * std::numbers::pi * modulation.frequency.in(hertz)*modulation.rise.in(second);
  const auto of = [&](int m) {
    return shapeOf(modulation.emitted, m) * shapeOf(modulation.demodulated, m) /
           std::complex<double>{1.0, m * omega_tau};
  };
  return of(n) / std::abs(of(1));
}

CameraInfo Datasheet::camera() const {
  return {.width = lens.width,
          .height = lens.height,
          .fx = lens.fx,
          .fy = lens.fy,
          .cx = lens.cx,
          .cy = lens.cy,
          .distortion = {},
          .calibration_id = {}};
}

const Datasheet::Declared* Datasheet::declares(std::string_view type) const {
  const auto found = std::ranges::find(effects, type, &Declared::type);
  return found == effects.end() ? nullptr : &*found;
}

Result<Datasheet> readDatasheet(const std::filesystem::path& file) {
  auto sheet = settings::loadFile<Datasheet>(file);
  if (!sheet) return sheet.error();
  const auto refuse = [&](const std::string& what) {
    return Error{Error::Code::InvalidArgument, file.string() + ": " + what};
  };
  if (sheet->emitters.empty()) return refuse("a camera needs an [[emitter]]");
  if (sheet->modulations.empty()) return refuse("a camera needs a [[modulation]]");
  constexpr std::array kKnown{"shot_noise", "read_noise", "saturation", "ambient_light"};
  for (const auto& effect : sheet->effects) {
    if (std::ranges::find(kKnown, effect.type) == kKnown.end())
      return refuse("the reference device has no declared effect \"" + effect.type +
                    "\"; it has shot_noise, read_noise, saturation and ambient_light");
    if (std::ranges::count(sheet->effects, effect.type, &Datasheet::Declared::type) > 1)
      return refuse("declares " + effect.type + " twice");
  }
  return sheet;
}

}  // namespace toftwin::reference
