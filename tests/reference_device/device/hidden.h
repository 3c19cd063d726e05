// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/fields.h>
#include <toftwin/geometry.h>

#include "protocol/settings/settings.h"
#include "tests/reference_device/device/light.h"
#include "tests/reference_device/device/pixels.h"

namespace toftwin::reference {

/// What a frame is taken under, as far as an effect can feel it.
struct Circumstances {
  double since_power_on_s = 0.0;
  double exposure_s = 0.0;  ///< of a raw exposure of the first frequency
  double ambient_klx = 0.0;
  double illumination_c = 0.0, sensor_c = 0.0, sensor_rate_c_per_s = 0.0;
  std::uint64_t frame = 0;                       ///< counts on from the opening
  Transform<World, Camera> world_from_camera{};  ///< as commanded
};

/// Where an effect acts.
enum class Stage { Light, Samples, Range };

/// What is known of an effect, to judge a finder's answer by; a finder never sees it.
struct About {
  std::string_view name;
  std::string_view summary;
  Stage stage;
  std::string_view unit;  ///< of its strength
  std::string_view
      covariates;  ///< that a right answer names, as in docs/effects; those in brackets may be named
  std::string_view catalogue;  ///< the catalogue's effect that it is, or empty
};

/// Something that the device does and its datasheet does not say. With strength 0 it does nothing.
class Hidden {
 public:
  double strength = 0.0;
  virtual ~Hidden() = default;
  virtual void onLight(Light&, const Transport&, const Circumstances&) const {}
  virtual void onSamples(Charges&, const Light&, const Circumstances&) const {}
  virtual void onRange(Measured&, const Light&, const Circumstances&) const {}
  /// For the transport itself: see RadiosityOptions.
  [[nodiscard]] virtual double leastTransfer_m() const { return 0.0; }
  /// By how much the camera stands elsewhere than commanded, in the world.
  [[nodiscard]] virtual Vec3d misplaced_m(const Transform<World, Camera>&) const { return {}; }
};

/// One row of the table of hidden effects.
struct Row {
  About about;
  /// Its keys, `strength` among them, from a [[hidden]] table.
  std::unique_ptr<Hidden> (*read)(settings::Table& keys);
};
std::span<const Row> allHidden();
/// As a Markdown table, for docs/reference-device.md.
std::string documentHidden();

/// The row of an effect whose keys are its members' visit().
template <class Effect>
Row rowOf(const About& about) {
  return {about, [](settings::Table& keys) -> std::unique_ptr<Hidden> {
            auto effect = std::make_unique<Effect>();
            keys.read(*effect);
            return effect;
          }};
}

}  // namespace toftwin::reference
