// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "calib/suit/suit.h"

namespace toftwin::suit {

/// A folder of one test, with a wall of albedo 0.5 at z = 2 m and a box before its right half at z = 1.5 m.
class Folder {
 public:
  Folder() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    path_ = std::filesystem::temp_directory_path() /
            fmt::format("toftwin_suit_{}_{}_{}", getpid(), test->test_suite_name(), test->name());
    std::filesystem::create_directories(path_);
    write("scene.toml", R"(
[[material]]
name = "grey"
albedo = 0.5
[[object]]
name = "wall"
shape = "rectangle"
size_m = [6, 6, 0]
position_m = [0, 0, 2]
material = "grey"
[[object]]
name = "box"
shape = "box"
size_m = [1, 1, 0.2]
position_m = [0.5, 0, 1.6]
material = "grey"
)");
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream{path_ / name} << text;
    return (path_ / name).string();
  }
  /// A camera without any error, and what is appended: 32 × 24 pixels, 20 and 100 MHz, sines, 20 frames per
  /// second.
  std::string camera(const std::string& name, const std::string& effects = {}) const {
    return write(name, R"(
model = "planted"
[lens]
width = 32
height = 24
fx = 26.0
fy = 26.0
cx = 15.5
cy = 11.5
[[emitter]]
power_w = 2.0
[[modulation]]
frequency_mhz = 20.0
exposure_us = 1000.0
[[modulation]]
frequency_mhz = 100.0
exposure_us = 1000.0
[sampling]
frame_interval_ms = 50.0
[pixel]
electrons_per_radiance_s = 8.2e7
)" + effects);
  }
  [[nodiscard]] std::string text(const std::string& rest) const {
    return R"(scene = "scene.toml"
max_surfaces = 1
pixel_extent = 0
samples_per_pixel = 1
frames = 4
)" + rest;
  }
  /// One that stands still at the origin, if `rest` has no pose of its own.
  [[nodiscard]] Result<Case> use(const std::string& rest) const {
    return parseCase(text(rest), path_ / "case.toml");
  }
  [[nodiscard]] Result<Suit> judged(const std::string& rest, std::vector<std::string> only = {}) const {
    auto one = use(rest);
    if (!one) return one.error();
    compare::Progress quiet{nullptr};
    return judge(*one, {.only = std::move(only)}, quiet);
  }
  [[nodiscard]] std::filesystem::path path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline const std::string kPose = "[[pose]]\nname = 'here'\n";

/// An effect of a camera file.
inline std::string effect(const std::string& type, const std::string& keys = {}) {
  return fmt::format("[[effect]]\ntype = \"{}\"\n{}\n", type, keys);
}
/// A camera of the case, at its own exposure alone.
inline std::string entry(const std::string& model, const std::string& factors = "[1.0]") {
  return fmt::format("[[camera]]\nmodels = ['{}']\nexposure_factors = {}\n", model, factors);
}

}  // namespace toftwin::suit
