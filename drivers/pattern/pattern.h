// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <toftwin/units.h>

#include "drivers/pace.h"
#include "drivers/source.h"

/// A camera that is not there: a moving picture whose every value is known. It is also the template
/// for new drivers (docs/add-a-driver.md): read pattern.cpp from top to bottom.
namespace toftwin::drivers::pattern {

/// The keys of a [[source]] table with driver = "pattern".
struct Keys {
  std::string uri = "pattern:0";
  int width = 512;
  int height = 424;
  Frequency frame_rate = 30_Hz;
  Pace pace = Pace::RealTime;
  std::vector<std::string> planes;
  std::uint64_t frames = 0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("uri", uri, "the camera; there is only this one");
    v.number("width", width, {8, 4096}, "pixels per row");
    v.number("height", height, {8, 4096}, "rows");
    v.quantity("frame_rate", frame_rate, hertz, {0.01, 10'000},
               "frames per second of device time, whatever the pace");
    v.choice(
        "pace", pace,
        {{"real_time", Pace::RealTime}, {"fast", Pace::Fast}, {"trigger", Pace::Trigger}},
        "when a frame comes: at the frame rate, as soon as possible, or one per trigger; under "
        "lockstep the clients say when");
    v.texts("planes", planes, "which of range, depth, amplitude, ambient, flags; empty: all");
    v.number("frames", frames, {0, 1e15}, "end of the stream after so many frames; 0: never");
  }
};

/// What a pixel shows when the pattern has moved by `shift` pixels.
struct Pixel {
  float range_m;  ///< NaN in the moving square of invalid pixels
  float amplitude;
  float ambient;
  std::uint8_t flags;
};

/// The definition of the pattern, one pixel at a time; all numbers are exact in binary.
///   range = 1 m + ((x + y + shift) mod 256) / 64 m
///   amplitude = 256 + ((x + 3 y) mod 128),   ambient = 64 + (y mod 32)
///   invalid: a square with a side of an eighth of the shorter side of the image, whose top left
///   pixel is (4 shift mod width, 2 shift mod height) and which the image's edges cut off
Pixel pixelAt(int width, int height, std::uint64_t shift, int x, int y);

Driver row();

}  // namespace toftwin::drivers::pattern
