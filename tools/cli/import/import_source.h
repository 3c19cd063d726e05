// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/frame.h>
#include <toftwin/geometry.h>
#include <toftwin/image.h>
#include <toftwin/result.h>

/// Other people's frames, one after the other.
namespace toftwin::cli {

/// What is known of the frames beyond their files.
struct ImportOptions {
  std::optional<double> mm_per_count{};    ///< of integers; none: as the kind of folder has it
  std::optional<double> frame_rate_hz{};    ///< of frames without times; none: 30
  std::optional<CameraInfo> lens{};        ///< none: as the kind of folder has it, else an error
  PlaneKind plane = PlaneKind::Depth;      ///< what bare numbers are; those of depth and range are distances
  std::string topic{};                     ///< of bags: only what is on topics that begin so
  std::vector<std::uint64_t> shape{};      ///< of bare bytes: frames (0: as many as there are), rows, columns
  std::string type{};                      ///< of bare bytes: "u2", "f4", …
};

struct ImportedFrame {
  std::vector<Plane> planes;               ///< of one size
  std::optional<std::int64_t> time_ns;     ///< of the exposure, since 1970 or since any time
  std::optional<std::int64_t> received_ns;
  std::optional<Transform<World, Camera>> world_from_camera;
  std::optional<CameraInfo> lens;          ///< its own, where frames may have different ones
  std::string source;                      ///< which of several cameras; empty: there is one
};

/// Gives the frames in order; Error EndOfStream after the last.
class ImportSource {
 public:
  virtual ~ImportSource() = default;
  virtual Result<ImportedFrame> next() = 0;
  /// 0: not known before they were read.
  [[nodiscard]] virtual std::uint64_t frames() const = 0;
  /// Of all frames; without a size where only its numbers are known.
  [[nodiscard]] virtual std::optional<CameraInfo> lens() const { return std::nullopt; }
  /// What was guessed, for people.
  [[nodiscard]] virtual std::vector<std::string> notes() const = 0;
};

using OpenImport = Result<std::unique_ptr<ImportSource>> (*)(const std::filesystem::path&, const ImportOptions&);

/// A folder of pictures of one channel (PNG, TIFF, PGM), in the order of their names, in which numbers count as
/// numbers. Of integers 0 and the largest are invalid.
Result<std::unique_ptr<ImportSource>> openPictures(const std::filesystem::path& folder, const ImportOptions& options);

/// A folder as of the TUM RGB-D benchmark: depth.txt with times and pictures of 5000 counts a metre, and perhaps
/// groundtruth.txt with poses, between which are interpolated, and camera.yaml with the lens.
Result<std::unique_ptr<ImportSource>> openTum(const std::filesystem::path& folder, const ImportOptions& options);

/// An array of NumPy, rows × columns or frames × rows × columns, of floats or integers of 8 to 32 bits. Floats are metres.
Result<std::unique_ptr<ImportSource>> openNpy(const std::filesystem::path& file, const ImportOptions& options);

/// An archive of such arrays (.npz): those with names of planes, or the only one.
Result<std::unique_ptr<ImportSource>> openNpz(const std::filesystem::path& file, const ImportOptions& options);

/// Bytes without a header: options.shape and options.type say what they are.
Result<std::unique_ptr<ImportSource>> openRaw(const std::filesystem::path& file, const ImportOptions& options);

/// An organised cloud (.pcd, .ply) or a folder of them; the lens is found from the points unless options.lens says it.
Result<std::unique_ptr<ImportSource>> openClouds(const std::filesystem::path& what, const ImportOptions& options);

/// Frames as text: a matrix of numbers, or a line for each pixel with x_px, y_px and a column for each plane, as `toftwin grab`
/// writes them; one file, or a folder of them.
Result<std::unique_ptr<ImportSource>> openCsv(const std::filesystem::path& what, const ImportOptions& options);

/// A bag of ROS 2 (MCAP, .db3), of ROS 1, or of Foxglove's messages; a folder of such files.
Result<std::unique_ptr<ImportSource>> openBagFrames(const std::filesystem::path& what, const ImportOptions& options);

/// Whichever of these it is, by its content.
Result<std::unique_ptr<ImportSource>> openImport(const std::filesystem::path& what, const ImportOptions& options);

/// A picture of one channel as a plane: of distances in metres with NaN where invalid, of other kinds its numbers.
Result<Plane> planeOfPicture(const std::filesystem::path& file, PlaneKind kind, double mm_per_count);

/// Whether the plane's numbers are metres.
constexpr bool isDistance(PlaneKind kind) { return kind == PlaneKind::Depth || kind == PlaneKind::Range || kind == PlaneKind::TruthRange; }

}  // namespace toftwin::cli
