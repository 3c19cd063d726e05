// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <complex>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/fields.h>
#include <toftwin/result.h>
#include <toftwin/units.h>

/// A camera that is not the simulator: light transport and pixels of its own, to test what the simulator and
/// the finder make of a device that they were not made from. Nothing of sim/ is included or linked.
namespace toftwin::reference {

/// What the maker says of the camera: those keys of a camera file (docs/camera-file.md) that this device has.
/// Any other key is an error, so that nothing declared is left out silently.
struct Datasheet {
  struct Lens {
    int width = 64, height = 48;
    double fx = 56.0, fy = 56.0, cx = 31.5, cy = 23.5;
    template <class Visitor>
    void visit(Visitor& v) {
      v.number("width", width, {1, 4096}, "pixels");
      v.number("height", height, {1, 4096}, "pixels");
      v.number("fx", fx, {1.0, 1e6}, "focal length, pixels");
      v.number("fy", fy, {1.0, 1e6}, "focal length, pixels");
      v.number("cx", cx, {-1e5, 1e5}, "principal point");
      v.number("cy", cy, {-1e5, 1e5}, "principal point");
    }
  };
  struct Emitter {
    std::array<double, 3> position_mm{};
    double power_w = 1.0;
    Angle half_angle = 90_deg;
    bool isotropic = false;
    template <class Visitor>
    void visit(Visitor& v) {
      v.numbers("position_mm", position_mm, {-1e4, 1e4}, "from the lens: right, down, ahead");
      v.number("power_w", power_w, {0.0, 1e6},
               "of a Lambertian point that looks along the axis, over the half space");
      v.quantity("half_angle", half_angle, degree, {0.1, 90.0}, "no light outside this cone");
      v.flag("isotropic", isotropic, "the same in all directions instead");
    }
  };
  enum class Wave { Sine, Square };
  struct Modulation {
    Frequency frequency = 30_MHz;
    double contrast = 0.5;
    Duration exposure = 1000_us;
    Wave emitted = Wave::Sine, demodulated = Wave::Sine;
    Duration rise{};
    template <class Visitor>
    void visit(Visitor& v) {
      v.quantity("frequency", frequency, megahertz, {0.1, 1000.0}, "modulation frequency");
      v.number("contrast", contrast, {1e-4, 1.0}, "of the fundamental, per collected electron");
      v.quantity("exposure", exposure, microsecond, {1.0, 20'000.0}, "of one raw exposure");
      v.choice("emitted", emitted, {{"sine", Wave::Sine}, {"square", Wave::Square}}, "the light's waveform");
      v.quantity("rise", rise, nanosecond, {0.0, 1000.0}, "time constant of the emitter's low pass");
      v.choice("demodulated", demodulated, {{"sine", Wave::Sine}, {"square", Wave::Square}}, "the pixel's");
    }
  };
  struct Sampling {
    int steps = 4, taps = 2, harmonics = 1;
    Duration gap = 500_us, frame_interval = 50_ms;
    std::string factory_calibration = "delay";
    template <class Visitor>
    void visit(Visitor& v) {
      v.number("steps", steps, {3, 16}, "raw exposures per frequency");
      v.number("taps", taps, {2, 2}, "this device has two");
      v.number("harmonics", harmonics, {1, 31}, "of the modulation that its waveforms have");
      v.quantity("gap", gap, microsecond, {0.0, 1e5}, "between raw exposures");
      v.quantity("frame_interval", frame_interval, millisecond, {1.0, 1e5}, "from frame to frame");
      v.choice("factory_calibration", factory_calibration, {{"delay", std::string{"delay"}}},
               "this device's");
    }
  };
  struct Pixel {
    double electrons_per_radiance_s = 5e7;
    template <class Visitor>
    void visit(Visitor& v) {
      v.number("electrons_per_radiance_s", electrons_per_radiance_s, {1.0, 1e15}, "both taps");
    }
  };
  struct Thermal {
    double illumination_rise_c = 0.0, sensor_rise_c = 0.0;
    Duration illumination_time = 300_s, sensor_time = 900_s;
    template <class Visitor>
    void visit(Visitor& v) {
      v.number("illumination_rise_c", illumination_rise_c, {0.0, 150.0}, "above the room");
      v.quantity("illumination_time", illumination_time, second, {1e-3, 1e6}, "time constant");
      v.number("sensor_rise_c", sensor_rise_c, {0.0, 150.0}, "above the room");
      v.quantity("sensor_time", sensor_time, second, {1e-3, 1e6}, "time constant");
    }
  };
  struct Decoder {
    std::string algorithm = "n_phase";
    double minimum_amplitude_electrons = 0.0;
    Angle unwrap_threshold = 0.6_rad;
    Length nearest = 0_m, farthest = 1000_m;
    template <class Visitor>
    void visit(Visitor& v) {
      v.choice("algorithm", algorithm, {{"n_phase", std::string{"n_phase"}}}, "this device's");
      v.number("minimum_amplitude_electrons", minimum_amplitude_electrons, {0.0, 1e9}, "fewer: invalid");
      v.quantity("unwrap_threshold", unwrap_threshold, radian, {0.0, 10.0}, "more: invalid");
      v.quantity("nearest", nearest, metre, {0.0, 1e6}, "nearer: invalid");
      v.quantity("farthest", farthest, metre, {0.0, 1e6}, "farther: invalid");
    }
  };
  /// The imperfections that its maker declares; each type at most once.
  struct Declared {
    std::string type;
    double irradiance_w_per_m2_per_klx = 0.27, full_well_electrons = 1e30, sigma_electrons = 20.0;
    template <class Visitor>
    void visit(Visitor& v) {
      v.text("type", type, "shot_noise, read_noise, saturation or ambient_light");
      v.number("irradiance_w_per_m2_per_klx", irradiance_w_per_m2_per_klx, {0.0, 100.0}, "ambient_light");
      v.number("full_well_electrons", full_well_electrons, {1.0, 1e30}, "saturation");
      v.number("sigma_electrons", sigma_electrons, {0.0, 1e5}, "read_noise");
    }
  };

  std::string model = "reference";
  Lens lens{};
  std::vector<Emitter> emitters{};
  std::vector<Modulation> modulations{};
  Sampling sampling{};
  Pixel pixel{};
  Thermal thermal{};
  Decoder decoder{};
  std::vector<Declared> effects{};

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("model", model, "maker and name");
    v.group("lens", lens, "");
    v.group("emitter", emitters, "");
    v.group("modulation", modulations, "");
    v.group("sampling", sampling, "");
    v.group("pixel", pixel, "");
    v.group("thermal", thermal, "");
    v.group("decoder", decoder, "");
    v.group("effect", effects, "");
  }

  [[nodiscard]] CameraInfo camera() const;
  /// The declared imperfection of that type, or null.
  [[nodiscard]] const Declared* declares(std::string_view type) const;
};

/// Of the correlation of the two waveforms, ĉ_n = e_n r_n* / |e_1 r_1|: a sine has e_1 alone, a square wave
/// of half duty e_n ∝ sin(nπ/2) / n, a low pass of time constant τ adds 1 / (1 + i n ω τ).
std::complex<double> contentOf(const Datasheet::Modulation& modulation, int n);

/// Errors name file, line and key; also a camera without emitter or modulation, or an effect that this device
/// lacks.
Result<Datasheet> readDatasheet(const std::filesystem::path& file);

}  // namespace toftwin::reference
