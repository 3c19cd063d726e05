// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include <toftwin/geometry.h>

#include "tests/reference_device/device/hidden.h"
#include "tests/reference_device/device/sealed.h"

namespace toftwin::reference {

/// What a frame says of itself and of its surroundings.
struct State {
  Transform<World, Camera> world_from_camera{};  ///< as commanded; where it really stands the rig alone knows
  double since_power_on_s = 10'800.0;
  double exposure_scale = 1.0;  ///< of the datasheet's
  double ambient_klx = 0.0;
  double room_c = 23.0;
  /// Which capture it is: the rig errs anew for each.
  std::uint64_t capture = 0;
};

/// The device: a room before it, a datasheet, and what is hidden.
class Device {
 public:
  Device(Room room, Datasheet sheet, Sealed sealed, std::uint64_t seed, RadiosityOptions options = {});

  [[nodiscard]] const Datasheet& sheet() const { return transport_.sheet(); }

  struct Exposed {
    Charges charges;
    Measured measured;
  };
  /// Frame `frame` of a state, with noise.
  Exposed expose(const State& state, std::uint64_t frame);
  /// Without noise and rig error, and with or without what is hidden; `nudge`: the camera stands there
  /// instead, relative to the state's pose.
  Exposed exposeNoiseFree(const State& state, std::uint64_t frame, bool with_hidden,
                          const Transform<Camera, Camera>& nudge = {});

  /// As its own thermometers say; the lab's air conditioning swings the room by 1.5 °C in 20 minutes.
  [[nodiscard]] Circumstances circumstances(const State& state, std::uint64_t frame) const;
  [[nodiscard]] double roomNow_c(const State& state) const;

 private:
  Exposed make(Light light, const State& state, std::uint64_t frame, bool with_hidden, Dice* dice) const;
  [[nodiscard]] Transform<World, Camera> standing(Transform<World, Camera> commanded) const;
  [[nodiscard]] const Light& lightAt(const Transform<World, Camera>& world_from_camera, bool with_hidden);

  Transport transport_;
  std::optional<Transport> plain_;  ///< without what is hidden, where that is in the transport itself
  Sealed sealed_;
  std::uint64_t seed_;
  struct Kept {
    Transform<World, Camera> pose;
    bool is_plain;
    Light light;
  };
  std::optional<Kept> kept_;  ///< light of the last pose
};

}  // namespace toftwin::reference
