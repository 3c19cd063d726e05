// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include <toftwin/units.h>

#include "protocol/settings/settings.h"
#include "sim/decode/decode.h"
#include "sim/effects/effects.h"
#include "sim/sensor/pulse.h"
#include "sim/sensor/waveform.h"

namespace toftwin::sim {

/// The schema of a camera file (docs/camera-file.md), all but its effects.
struct CameraFile {
  struct Lens {
    int width = 320, height = 240;
    double fx = 300.0, fy = 300.0, cx = 159.5, cy = 119.5;
    std::array<double, 5> distortion{};

    template <class Visitor>
    void visit(Visitor& v) {
      v.number("width", width, {1, 8192}, "pixels");
      v.number("height", height, {1, 8192}, "pixels");
      v.number("fx", fx, {1.0, 1e6}, "focal length, pixels");
      v.number("fy", fy, {1.0, 1e6}, "focal length, pixels");
      v.number("cx", cx, {-1e5, 1e5},
               "principal point; (0, 0) is the centre of the top left pixel");
      v.number("cy", cy, {-1e5, 1e5}, "principal point");
      v.numbers("distortion", distortion, {-100.0, 100.0}, "k1 k2 p1 p2 k3 as in OpenCV");
    }
  };

  struct Emitter {
    std::array<double, 3> position_mm{};
    std::array<double, 3> axis{0.0, 0.0, 1.0};
    Length radius = 0_mm;
    double power_w = 1.0;
    double lobe_exponent = 1.0;
    Angle half_angle = 90_deg;
    bool isotropic = false;
    std::vector<double> pattern_deg, pattern;

    /// What is wrong with the pattern; empty if nothing is.
    [[nodiscard]] std::string problemOfPattern() const;

    template <class Visitor>
    void visit(Visitor& v) {
      v.numbers("position_mm", position_mm, {-1e4, 1e4}, "from the lens: right, down, ahead");
      v.numbers("axis", axis, {-1.0, 1.0},
                "where it points, in the camera's frame; any length but 0");
      v.quantity("radius", radius, millimetre, {0.0, 1000.0}, "of the shining disc; 0: a point");
      v.number("power_w", power_w, {0.0, 1e6},
               "mean optical power of the uncut lobe over the half space");
      v.number("lobe_exponent", lobe_exponent, {0.0, 1000.0},
               "m of I = power (m + 1) / 2 pi cos^m: 1 is Lambertian");
      v.quantity("half_angle", half_angle, degree, {0.1, 90.0}, "no light outside this cone");
      v.flag("isotropic", isotropic, "the same in all directions instead, power / 4 pi");
      v.numbers("pattern_deg", pattern_deg, {0.0, 90.0},
                "instead of lobe and cone, a pattern as it was measured, vignetting with it: angles from the axis, "
                "ascending from 0");
      v.numbers("pattern", pattern, {0.0, 1e6},
                "relative intensity at those angles, linear between, dark beyond; power_w is that of all of it");
    }
  };

  struct Modulation {
    Frequency frequency = 20_MHz;
    double contrast = 0.5;
    Duration exposure = 1_ms;
    Waveform emitted, demodulating;

    template <class Visitor>
    void visit(Visitor& v) {
      const auto shapes = {std::pair{"sine", Waveform::Shape::Sine},
                           std::pair{"square", Waveform::Shape::Square},
                           std::pair{"clipped_sine", Waveform::Shape::ClippedSine},
                           std::pair{"impulse", Waveform::Shape::Impulse}};
      v.quantity("frequency", frequency, megahertz, {0.1, 1000.0},
                 "modulation frequency, whole kilohertz");
      v.number(
          "contrast", contrast, {1e-4, 1.0},
          "amplitude of the demodulated fundamental per collected electron, waveforms included");
      v.quantity("exposure", exposure, microsecond, {1.0, 20'000.0}, "of one raw exposure");
      v.choice("emitted", emitted.shape, shapes, "the light's waveform");
      v.number("emitted_duty", emitted.duty, {0.01, 0.99},
               "square: share of the period that is on");
      v.number("emitted_clip", emitted.clip, {0.05, 1.0},
               "clipped_sine: cut at this share of the amplitude");
      v.quantity("rise", emitted.rise, nanosecond, {0.0, 1000.0},
                 "time constant of the emitter's low pass");
      v.choice("demodulated", demodulating.shape, shapes,
               "the pixel's reference; impulse: the correlation function is `emitted` itself");
      v.number("demodulated_duty", demodulating.duty, {0.01, 0.99},
               "square: share of the period that is on");
    }
  };

  /// Instead of modulations: a pulsed camera.
  struct PulseKeys {
    Pulse pulse;
    Duration exposure = 1_ms;
    double open_share = 0.01;
    int knots = 49;

    template <class Visitor>
    void visit(Visitor& v) {
      v.choice("scheme", pulse.scheme,
               {{"short_long", PulseScheme::ShortLong}, {"two_gate", PulseScheme::TwoGate}},
               "short_long: gates [0, T] and [0, 2T]; two_gate: [0, T] and [T, 2T]; T is the width");
      v.quantity("width", pulse.width, nanosecond, {0.1, 1000.0}, "T of the pulse; its range is c T / 2");
      v.quantity("rise", pulse.rise, nanosecond, {0.0, 1000.0},
                 "time constant of the emitter's low pass: soft knees at both ends of the range");
      v.flag("ambient_gate", pulse.has_ambient_gate,
             "a third raw exposure without light, taken off the others");
      v.quantity("exposure", exposure, microsecond, {1.0, 20'000.0},
                 "of one raw exposure: a train of pulses for one gate");
      v.number("open_share", open_share, {1e-6, 0.5},
               "of the exposure, for which a gate as wide as the pulse is open: how much ambient light counts");
      v.number("knots", knots, {2, 4096},
               "of the factory's table of ranges, with factory_calibration = \"waveform\"; linear between");
    }
  };

  enum class FactoryCalibration { None, Delay, Waveform };

  struct Sampling {
    int steps = 4;
    int taps = 2;
    int harmonics = 1;
    Duration gap = 500_us;
    Duration frame_interval = 50_ms;
    Duration row_delay{};
    FactoryCalibration factory_calibration = FactoryCalibration::Delay;
    bool phase_tables = false;
    std::vector<double> exposure_factors{1.0};

    template <class Visitor>
    void visit(Visitor& v) {
      v.number("steps", steps, {3, 16},
               "raw exposures per frequency, the reference shifted by 1/steps each");
      v.number("taps", taps, {1, 2},
               "2: what one tap misses the other collects, and their difference counts");
      v.number("harmonics", harmonics, {1, 31},
               "of the modulation that are traced; a sine needs 1");
      v.quantity("gap", gap, microsecond, {0.0, 100'000.0},
                 "between raw exposures, for reading out");
      v.quantity("frame_interval", frame_interval, millisecond, {1.0, 100'000.0},
                 "from frame to frame");
      v.quantity("row_delay", row_delay, microsecond, {0.0, 1'000.0},
                 "rolling shutter: each row is exposed by this much later than the one above it; 0: global "
                 "shutter");
      v.choice("factory_calibration", factory_calibration,
               {{"none", FactoryCalibration::None},
                {"delay", FactoryCalibration::Delay},
                {"waveform", FactoryCalibration::Waveform}},
               "what the device takes off by itself: delay: its waveforms' constant delay; waveform: also "
               "the cyclic error that a single return has, by a table");
      v.flag("phase_tables", phase_tables,
             "the device also takes off each pixel's own phase, as effects on light that depend on nothing "
             "but the pixel's position add it, in the Kinect v2's steps of 0.000031 pi");
      v.numbers("exposure_factors", exposure_factors, {1e-4, 1.0},
                "one to three exposures per frame, as shares of the raw exposures' time, each shorter than the one before; "
                "each pixel is of the longest that does not saturate it");
    }
  };

  struct Pixel {
    double electrons_per_radiance_s = 5e7;

    template <class Visitor>
    void visit(Visitor& v) {
      v.number("electrons_per_radiance_s", electrons_per_radiance_s, {1.0, 1e15},
               "electrons in both taps per W/(m² sr) at the lens and second: π/4 T A R / (F² q) "
               "with lens "
               "transmission T, F-number F, pixel area A, responsivity R in A/W, q = 1.602e-19 C");
    }
  };

  /// The lens of an RGB-D camera's colour images.
  struct Color {
    Lens lens;
    std::array<double, 3> position_mm{};
    std::array<double, 3> euler_deg{};
    double scale = 1.0;

    template <class Visitor>
    void visit(Visitor& v) {
      v.group("lens", lens, "");
      v.numbers("position_mm", position_mm, {-1e4, 1e4}, "from the depth lens: right, down, ahead");
      v.numbers("euler_deg", euler_deg, {-180.0, 180.0},
                "how it is turned in the depth lens's frame: about x, then y, then z");
      v.number("scale", scale, {0.01, 1.0},
               "share of its width and height at which images are made, to save time");
    }
  };

  struct Thermal {
    double illumination_rise = 0.0, sensor_rise = 0.0;
    Duration illumination_time = 300_s, sensor_time = 900_s;

    template <class Visitor>
    void visit(Visitor& v) {
      v.number("illumination_rise_c", illumination_rise, {0.0, 150.0},
               "how much warmer than the room the illumination gets; 0: the camera does not tell its temperatures");
      v.quantity("illumination_time", illumination_time, second, {0.001, 1e6}, "time constant of that");
      v.number("sensor_rise_c", sensor_rise, {0.0, 150.0}, "how much warmer than the room the sensor gets");
      v.quantity("sensor_time", sensor_time, second, {0.001, 1e6}, "time constant of that");
    }
  };

  std::string model = "generic";
  Lens lens;
  std::vector<Emitter> emitters;
  std::vector<Modulation> modulations;
  std::vector<PulseKeys> pulses;  ///< at most one
  Sampling sampling;
  Pixel pixel;
  Thermal thermal;
  DecodeSettings decoder;
  std::vector<Color> colors;  ///< at most one
  /// For people: what an older version wrote and is read as something else, with its place in the file. No keys.
  std::vector<std::string> notes{};

  [[nodiscard]] bool isPulsed() const { return !pulses.empty(); }
  /// From the start of a frame's first raw exposure to the end of its last.
  [[nodiscard]] Duration exposureTime() const;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("model", model, "maker and name, as clients see it");
    v.group("lens", lens, "");
    v.group("emitter", emitters, "");
    v.group("modulation", modulations, "");
    v.group("pulse", pulses, "");
    v.group("sampling", sampling, "");
    v.group("pixel", pixel, "");
    v.group("thermal", thermal, "");
    v.group("decoder", decoder, "");
    v.group("color", colors, "");
  }
};

/// Reads the file and its effects, and checks what no single key can say. Errors are left in the
/// table.
CameraFile readCameraFile(settings::Table& table, std::vector<AnyEffect>& effects);

}  // namespace toftwin::sim
