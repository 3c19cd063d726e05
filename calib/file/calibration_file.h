// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>

#include <toftwin/camera_info.h>
#include <toftwin/result.h>

/// A lens that was calibrated, as a file. Its [lens] reads as that of a camera file and of a driver.
namespace toftwin::calibration {

struct LensTable {
  int width = 0;
  int height = 0;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;
  std::array<double, 5> distortion{};

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("width", width, {1, 16384}, "pixels per row of the images that the lens was calibrated with");
    v.number("height", height, {1, 16384}, "rows");
    v.number("fx", fx, {1, 1e6}, "focal length, pixels");
    v.number("fy", fy, {1, 1e6}, "focal length, pixels");
    v.number("cx", cx, {-1e5, 1e5}, "principal point; (0, 0) is the centre of the top left pixel");
    v.number("cy", cy, {-1e5, 1e5}, "principal point");
    v.numbers("distortion", distortion, {-100, 100}, "k1 k2 p1 p2 k3 as in OpenCV");
  }
};

/// Half the width of each 95 % interval.
struct IntervalTable {
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;
  std::array<double, 5> distortion{};

  template <class Visitor>
  void visit(Visitor& v) {
    constexpr const char* kHelp = "half the width of the 95 % interval";
    v.number("fx", fx, {0, 1e6}, kHelp);
    v.number("fy", fy, {0, 1e6}, kHelp);
    v.number("cx", cx, {0, 1e6}, kHelp);
    v.number("cy", cy, {0, 1e6}, kHelp);
    v.numbers("distortion", distortion, {0, 100}, "likewise; 0 for terms that the model does not have");
  }
};

struct AboutTable {
  std::string id;
  std::string made;
  std::string software;
  std::string camera;
  std::string board;
  std::string lens_model;
  int views = 0;
  int rejected = 0;
  double rms_px = 0.0;
  double held_out_rms_px = 0.0;
  double board_depth_mm = 0.0;
  std::array<double, 4> covered{};
  IntervalTable interval{};

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("id", id, "content hash of [lens]: what frames of this camera name; empty: not checked");
    v.text("made", made, "when, UTC");
    v.text("software", software, "what made it");
    v.text("camera", camera, "the source or the images");
    v.text("board", board, "what was seen");
    v.text("lens_model", lens_model, "which terms of distortion were used");
    v.number("views", views, {0, 1e6}, "images that were used");
    v.number("rejected", rejected, {0, 1e6}, "images that were not");
    v.number("rms_px", rms_px, {0, 1e6}, "reprojection error over all used corners: root of the mean of du² + dv²");
    v.number("held_out_rms_px", held_out_rms_px, {0, 1e6},
             "the same for views that the lens was not fitted to");
    v.number("board_depth_mm", board_depth_mm, {0, 1e4}, "by how much the board was found to be bent; 0: flat");
    v.numbers("covered", covered, {-1e5, 1e5},
              "left, top, right, bottom of where corners were seen, pixels: beyond, the lens is extrapolated");
    v.group("interval", interval, "");
  }
};

struct CalibrationFile {
  LensTable lens{};
  AboutTable calibration{};

  template <class Visitor>
  void visit(Visitor& v) {
    v.group("lens", lens, "");
    v.group("calibration", calibration, "");
  }
};

/// With the id of its numbers, whatever a file says.
CameraInfo cameraOf(const LensTable& lens);
/// The content hash of a lens: 32 hex digits, the same for the same numbers whoever uses them.
std::string idOf(const CameraInfo& camera);

/// A file of `toftwin calibrate`. An Error if its id is not that of its numbers: it was edited.
Result<CalibrationFile> load(const std::filesystem::path& file);
/// As TOML. Its id is set.
std::string toText(CalibrationFile file);

/// Where calibrations are kept by id: $XDG_DATA_HOME/toftwin/calibrations, else
/// ~/.local/share/toftwin/calibrations; empty if there is no home.
std::filesystem::path storeFolder();

}  // namespace toftwin::calibration
