// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "protocol/ros/pixels.h"

/// Frames as files that other programs read. docs/command-line.md says what each format holds.
namespace toftwin::cli {

enum class Format { Png, Ply, Npy, Csv, Pcd, Tiff, Exr, Hdf5, Ros2, Foxglove, Recording, Tum, Colmap };

/// By its name ("ros2"), or the file's extension where that is empty. Error InvalidArgument names the known ones.
Result<Format> formatOf(const std::filesystem::path& file, std::string_view name = {});
/// ".png"
std::string_view extensionOf(Format format);
/// Whether one file holds many frames, and several planes of each.
bool holdsManyFrames(Format format);
/// "png, ply, …", for --help.
std::string formatNames();

struct ExportOptions {
  std::string format{};             ///< its name; empty: the extension says it
  std::vector<PlaneKind> planes{};  ///< empty: range, or depth where there is no range (CSV, HDF5: all)
  int channel = 0;                  ///< of planes with several (PNG, CSV)
  double mm_per_count = 1.0;        ///< PNG of metres
  bool color = false;  ///< PNG: 8-bit colours between `min` and `max` instead of counts
  bool grey = false;   ///< PNG: 8-bit grey as the square root, white where 1 % of the pixels are above
  std::optional<double> min{},
      max{};                 ///< of the colours, in the plane's unit; default: of the image
  std::optional<int> row{};  ///< CSV: this row only
  bool world = false;        ///< points: world coordinates instead of the camera's
  bool organised = false;    ///< points: one for each pixel, NaN where invalid
  ros::DepthFormat depth_format = ros::DepthFormat::Metres;  ///< of ROS's and Foxglove's depth images
};

struct Exported {
  std::vector<std::byte> bytes;
  std::string note;  ///< what a user should know: the scale, values that did not fit
};

Result<Exported> toPng(const Frame& frame, const ExportOptions& options);
Result<Exported> toPly(const Frame& frame, const ExportOptions& options);
Result<Exported> toNpy(const Frame& frame, const ExportOptions& options);
Result<Exported> toCsv(const Frame& frame, const ExportOptions& options);
Result<Exported> toPcd(const Frame& frame, const ExportOptions& options);
Result<Exported> toTiff(const Frame& frame, const ExportOptions& options);
Result<Exported> toExr(const Frame& frame, const ExportOptions& options);

/// What an NPY file of an array begins with: `type` as NumPy writes it ("<f4"), `shape` with commas ("3, 424,
/// 512").
std::vector<std::byte> npyHeader(std::string_view type, const std::string& shape);

/// The frame in the format of the extension. Unsupported for HDF5, which is no stream of bytes.
Result<Exported> exportBytes(const Frame& frame, const std::filesystem::path& file,
                             const ExportOptions& options);
/// Writes the frame in the format of the extension, whole or not at all; gives the note.
Result<std::string> exportFrame(const Frame& frame, const std::filesystem::path& file,
                                const ExportOptions& options);

/// One channel of a plane as numbers.
struct Picture {
  const Plane* plane = nullptr;
  std::vector<float> values;
};
/// The plane to show: the first that was asked for, else range, else depth. Errors name what there
/// is.
Result<const Plane*> choosePlane(const Frame& frame, const std::vector<PlaneKind>& wanted);
Result<Picture> pictureOf(const Plane& plane, int channel);
/// "m" for range, depth, true range and the light's sigma; "" where it is the device's own.
std::string_view unitOf(PlaneKind kind);

}  // namespace toftwin::cli
