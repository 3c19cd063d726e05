// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/fields.h>
#include <toftwin/result.h>
#include <toftwin/units.h>

#include "calib/compare/poses.h"
#include "sim/tracer/scene_file.h"

namespace toftwin::suit {

/// What a requirement is about; docs/suit.md defines each by a formula.
enum class Kind { Accuracy, Bias, Noise, Valid, Missed, Phantom, Pixels, FrameRate };

struct RequirementSpec {
  std::string name{};
  Kind kind = Kind::Accuracy;
  std::string object{}, region{};
  std::vector<std::string> poses{}, lightings{};
  Length within{};
  double at_least_percent = 0.0, at_most_percent = 0.0;
  Length at_most{};
  int pixels = 20;
  int at_least_pixels = 0;
  double at_least_hz = 0.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "what the report calls it; each has its own");
    v.choice("kind", kind,
             {{"accuracy", Kind::Accuracy},
              {"bias", Kind::Bias},
              {"noise", Kind::Noise},
              {"valid", Kind::Valid},
              {"missed", Kind::Missed},
              {"phantom", Kind::Phantom},
              {"pixels", Kind::Pixels},
              {"frame_rate", Kind::FrameRate}},
             "what is required: see the table of kinds");
    v.text("object", object, "only pixels whose central ray meets the scene's objects of this name first");
    v.text("region", region, "only pixels whose central ray meets something within this [[region]]");
    v.texts("poses", poses, "names of the poses at which it must hold; empty: all");
    v.texts("lightings", lightings, "names of the lightings under which it must hold; empty: all");
    v.quantity("within", within, millimetre, {0.0, 1e6},
               "accuracy, missed: how far a range may be off; phantom: how much too near is one");
    v.number("at_least_percent", at_least_percent, {0.0, 100.0}, "accuracy, valid: of the pixels");
    v.number("at_most_percent", at_most_percent, {0.0, 100.0},
             "missed: of the frames; phantom: of the pixels");
    v.quantity("at_most", at_most, millimetre, {0.0, 1e6}, "bias, noise");
    v.number("pixels", pixels, {1, 1e8}, "missed: so many accurate pixels make a thing seen in a frame");
    v.number("at_least_pixels", at_least_pixels, {0, 1e8}, "pixels: how many show it");
    v.number("at_least_hz", at_least_hz, {0.0, 1e6}, "frame_rate");
  }
};

/// A pose of the camera, and how it moves there.
struct StationSpec : compare::PoseSpec {
  Duration time{};
  std::array<double, 3> velocity_m_per_s{};
  std::array<double, 3> rotation_rate_deg_per_s{};

  template <class Visitor>
  void visit(Visitor& v) {
    compare::PoseSpec::visit(v);
    v.quantity("time", time, second, {0.0, 1e6},
               "of the scene, where things move in it: when the frame begins");
    v.numbers("velocity_m_per_s", velocity_m_per_s, {-1e4, 1e4},
              "of the camera in the world, while it takes the frame");
    v.numbers("rotation_rate_deg_per_s", rotation_rate_deg_per_s, {-36000.0, 36000.0},
              "of the camera about its lens, a vector in the world");
  }
};

struct LightingSpec {
  std::string name{};
  Illuminance ambient{};

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "what requirements and the report call it");
    v.quantity("ambient", ambient, kilolux, {0.0, 200.0},
               "sun or lamps, by the camera's effect ambient_light");
  }
};

/// A box in the world, along its axes.
struct RegionSpec {
  std::string name{};
  std::array<double, 3> lower_m{}, upper_m{};

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "what requirements call it");
    v.numbers("lower_m", lower_m, {-1e6, 1e6}, "corner of least x, y, z in the world");
    v.numbers("upper_m", upper_m, {-1e6, 1e6}, "corner of greatest x, y, z");
  }
};

/// A camera with its modes, or a recording of a real one.
struct CameraSpec {
  std::string name{};
  std::vector<std::string> models{};
  std::vector<double> exposure_factors{};
  std::string recording{}, pose{}, lighting{};

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "what the report calls it; empty: its first model, or the recording");
    v.texts("models", models, "its modes: presets, or camera files (.toml) relative to this file");
    v.numbers("exposure_factors", exposure_factors, {1e-3, 1e3},
              "times each model's exposure, which are tried; empty: 0.25, 0.5, 1, 2 and 4");
    v.text("recording", recording,
           "instead: FILE.mcap or FILE.mcap#SOURCE of a camera that looked at this scene");
    v.text("pose", pose, "recording: at which pose, if its frames do not say");
    v.text("lighting", lighting, "recording: under which lighting");
  }
};

/// A use case: where a camera looks at what, and what it must do there.
struct UseCase {
  std::string title{}, about{}, scene{};
  int frames = 8;
  int repeats = 3;
  int samples_per_pixel = 16;
  int max_surfaces = 4;
  double pixel_extent = 1.0;
  std::uint64_t seed = 1;
  Duration powered_on_before = 10'800_s;
  Temperature room_temperature = 23_degC;
  std::vector<StationSpec> poses{};
  std::vector<LightingSpec> lightings{};
  std::vector<RegionSpec> regions{};
  std::vector<RequirementSpec> requirements{};
  std::vector<CameraSpec> cameras{};

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("title", title, "of the report");
    v.text("about", about, "what the camera is to be used for, in a sentence");
    v.text("scene", scene, "scene file, relative to this file");
    v.number("frames", frames, {2, 10'000}, "at each pose, with other noise each");
    v.number("repeats", repeats, {2, 100}, "independent simulations of each pose, from which intervals come");
    v.number("samples_per_pixel", samples_per_pixel, {1, 65'536}, "paths traced per pixel in each of them");
    v.number("max_surfaces", max_surfaces, {1, 64}, "surfaces a path may touch: 1 is direct light only");
    v.number("pixel_extent", pixel_extent, {0.0, 4.0},
             "side of a pixel's footprint in pixels; 0: its central ray, no flying pixels");
    v.number("seed", seed, {0, 9'007'199'254'740'992.0}, "of all noise");
    v.quantity("powered_on_before", powered_on_before, second, {0.0, 1e9},
               "how long the camera has been on; three hours: warm");
    v.quantity("room_temperature", room_temperature, celsius, {-40.0, 100.0}, "");
    v.group("pose", poses, "where the camera is, in order");
    v.group("lighting", lightings, "other light; none: darkness, called \"dark\"");
    v.group("region", regions, "boxes in the world");
    v.group("require", requirements, "what the camera must do");
    v.group("camera", cameras, "which cameras; none: all presets");
  }
};

/// A use case, read and checked, with everything that names something resolved.
struct Case {
  UseCase spec;
  std::filesystem::path file{};
  std::filesystem::path scene_file{};
  std::vector<std::string> object_names{};        ///< of the scene, in its order
  std::vector<std::string> camera_places{};       ///< "file.toml:12" of each camera; empty for presets
  std::vector<std::string> requirement_places{};  ///< of each requirement
  /// Of a part of a use case: which of its poses these are, so that they meet the same noise; empty: all.
  std::vector<std::size_t> pose_numbers{};

  /// A path as the file means it.
  [[nodiscard]] std::filesystem::path resolve(const std::string& path) const;
};

std::string_view nameOf(Kind kind);

/// Errors come all at once and name file, line and key.
Result<Case> loadCase(const std::filesystem::path& file);
Result<Case> parseCase(std::string_view toml, const std::filesystem::path& name);

/// The cameras of a case that names none: every preset. One whose name begins with another's and "_" is a
/// mode of that one, as o3d303_far is of o3d303.
std::vector<CameraSpec> presetCameras();

/// The keys as a Markdown table, for docs/suit.md.
std::string documentCase();

}  // namespace toftwin::suit
