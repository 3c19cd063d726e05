// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/geometry.h>
#include <toftwin/image.h>
#include <toftwin/result.h>

/// Other people's frames, one after the other.
namespace toftwin::cli {

/// What is known of the frames beyond their files.
struct ImportOptions {
  std::optional<double> mm_per_count;      ///< of integers; none: as the kind of folder has it
  std::optional<double> frame_rate_hz;     ///< of frames without times; none: 30
  std::optional<CameraInfo> lens;          ///< none: as the kind of folder has it, else an error
};

struct ImportedFrame {
  Image<float> metres;                     ///< NaN where invalid
  std::optional<double> time_s;            ///< since 1970, or since any time
  std::optional<Transform<World, Camera>> world_from_camera;
};

/// Gives the frames in order; Error EndOfStream after the last.
class ImportSource {
 public:
  virtual ~ImportSource() = default;
  virtual Result<ImportedFrame> next() = 0;
  [[nodiscard]] virtual std::uint64_t frames() const = 0;
  /// Of all frames; without a size where only its numbers are known.
  [[nodiscard]] virtual std::optional<CameraInfo> lens() const { return std::nullopt; }
  /// What was guessed, for people.
  [[nodiscard]] virtual std::vector<std::string> notes() const = 0;
};

/// A folder of pictures of one channel (PNG, TIFF, PGM), in the order of their names, in which numbers count as
/// numbers. Of integers 0 and the largest are invalid.
Result<std::unique_ptr<ImportSource>> openPictures(const std::filesystem::path& folder, const ImportOptions& options);

/// A folder as of the TUM RGB-D benchmark: depth.txt with times and pictures of 5000 counts a metre, and perhaps
/// groundtruth.txt with poses, between which are interpolated.
Result<std::unique_ptr<ImportSource>> openTum(const std::filesystem::path& folder, const ImportOptions& options);

/// An array of NumPy, rows × columns or frames × rows × columns, of float32, float64 or uint16. Floats are metres.
Result<std::unique_ptr<ImportSource>> openNpy(const std::filesystem::path& file, const ImportOptions& options);

/// Whichever of these it is, by its content.
Result<std::unique_ptr<ImportSource>> openImport(const std::filesystem::path& what, const ImportOptions& options);

/// A picture of one channel in metres.
Result<Image<float>> metresOfPicture(const std::filesystem::path& file, double mm_per_count);

}  // namespace toftwin::cli
