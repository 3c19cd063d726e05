// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <toftwin/units.h>

#include "drivers/lens.h"
#include "drivers/source.h"

/// Cameras that have a driver for OpenNI2 (Asus Xtion, PrimeSense, Kinect through libfreenect, …),
/// and .oni recordings.
namespace toftwin::drivers::openni2 {

enum class Use { Auto, Yes, No };
enum class Registration { AsSet, Off, DepthToColor };
enum class Mirror { AsSet, Off, On };

/// The keys of a [[source]] table with driver = "openni2".
struct Keys {
  std::string uri = "openni2:any";
  Use infrared = Use::Auto;
  Use color = Use::Auto;
  int width = 0;
  int height = 0;
  Frequency frame_rate = 0_Hz;
  Registration registration = Registration::AsSet;
  Mirror mirror = Mirror::Off;
  Angle field_of_view = 0_deg;
  std::string calibration;
  Duration delay = 0_ms;
  double speed = 1.0;
  bool loop = false;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("uri", uri,
           "openni2: and the device's URI, or the beginning of it (1d27/0609), or any, or a file "
           "(.oni, relative to this one)");
    const std::initializer_list<std::pair<const char*, Use>> uses{
        {"auto", Use::Auto}, {"yes", Use::Yes}, {"no", Use::No}};
    v.choice("infrared", infrared, uses,
             "the infrared image as amplitude; auto: if there is one of the depth image's size");
    v.choice("color", color, uses, "the colour image; auto: likewise, and if no infrared is used");
    v.number("width", width, {0, 16384}, "of the depth image; 0: the first that the device offers");
    v.number("height", height, {0, 16384}, "likewise");
    v.quantity("frame_rate", frame_rate, hertz, {0, 1000}, "likewise");
    v.choice("registration", registration,
             {{"as_set", Registration::AsSet},
              {"off", Registration::Off},
              {"depth_to_color", Registration::DepthToColor}},
             "whether the depth image is moved to where the colour camera sees it");
    v.choice("mirror", mirror,
             {{"as_set", Mirror::AsSet}, {"off", Mirror::Off}, {"on", Mirror::On}},
             "whether left is right; many devices begin mirrored");
    v.quantity("field_of_view", field_of_view, degree, {0, 179},
               "horizontal; 0: as the device says, and 60 if it says nothing");
    v.text("calibration", calibration, kCalibrationHelp);
    v.quantity(
        "delay", delay, millisecond, {0.0, 1000.0},
        "from a frame's device time until it is here, if you measured it; 0: unknown, anything "
        "up to a frame interval");
    v.number("speed", speed, {0, 1000}, "of a file, 1: as recorded; 0: as fast as it can be read");
    v.flag("loop", loop, "a file begins again after its last frame instead of ending the stream");
  }
};

struct About {
  using Keys = openni2::Keys;
  static constexpr std::string_view name = "openni2";
  static constexpr std::string_view summary =
      "depth cameras with a driver for OpenNI2, and .oni files";
  static constexpr std::string_view remedy = "install libopenni2-dev and configure again";
};

Driver row();

}  // namespace toftwin::drivers::openni2
