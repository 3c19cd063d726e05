// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>

#include "tools/cli/import/bag/images.h"
#include "tools/cli/import/cloud/cloud_file.h"
#include "tools/cli/import/import_source.h"
#include "tools/cli/import/lens/lens_of_points.h"
#include "tools/cli/import/natural_order.h"

namespace toftwin::cli {
namespace {

Result<CloudFile> readCloud(const std::filesystem::path& file) {
  std::array<char, 3> head{};
  std::ifstream{file, std::ios::binary}.read(head.data(), head.size());
  return std::string_view{head.data(), head.size()} == "ply" ? readPly(file) : readPcd(file);
}

class Clouds final : public ImportSource {
 public:
  Clouds(std::vector<std::filesystem::path> files, ImportOptions options) : files_(std::move(files)), options_(std::move(options)) {
    notes_.emplace_back("points are taken for metres in the camera's frame: x right, y down, z forward");
  }

  /// Finds the lens, unless somebody said it.
  Result<> open() {
    if (options_.lens) return {};
    const auto first = readCloud(files_.front());
    if (!first) return first.error();
    const auto points = pointsOf(first->cloud, files_.front());
    if (!points) return points.error();
    auto lens = lensOfPoints(static_cast<int>(first->cloud.width), static_cast<int>(first->cloud.height), *points);
    if (!lens) return Error{lens.error().code, fmt::format("{}: {}", files_.front().string(), lens.error().message)};
    lens_ = lens->camera;
    notes_.push_back(lens->note);
    return {};
  }
  Result<ImportedFrame> next() override {
    if (at_ == files_.size()) return Error{Error::Code::EndOfStream, "no more clouds"};
    const auto& file = files_[at_++];
    const auto read = readCloud(file);
    if (!read) return read.error();
    auto planes = planesOf(read->cloud);
    if (!planes) return Error{planes.error().code, fmt::format("{}: {}", file.string(), planes.error().message)};
    if (planes->empty()) return notOrganised(file);
    ImportedFrame frame;
    frame.planes = *std::move(planes);
    return frame;
  }
  [[nodiscard]] std::uint64_t frames() const override { return files_.size(); }
  [[nodiscard]] std::optional<CameraInfo> lens() const override { return lens_; }
  [[nodiscard]] std::vector<std::string> notes() const override { return notes_; }

 private:
  static Error notOrganised(const std::filesystem::path& file) {
    return {Error::Code::Unsupported, fmt::format("{}: its points have no rows and columns, so that no pixel is known; save the cloud as organised "
                                                  "(HEIGHT above 1 in PCD, obj_info num_cols and num_rows in PLY)", file.string())};
  }
  static Result<std::vector<float>> pointsOf(const ros::PointCloud2& cloud, const std::filesystem::path& file) {
    if (cloud.height < 2) return notOrganised(file);
    auto points = coordinatesOf(cloud);
    if (!points) return Error{points.error().code, fmt::format("{}: {}", file.string(), points.error().message)};
    return points;
  }

  std::vector<std::filesystem::path> files_;
  ImportOptions options_;
  std::optional<CameraInfo> lens_;
  std::vector<std::string> notes_;
  std::size_t at_ = 0;
};

}  // namespace

Result<std::unique_ptr<ImportSource>> openClouds(const std::filesystem::path& what, const ImportOptions& options) {
  std::vector<std::filesystem::path> files;
  std::error_code fault;
  if (std::filesystem::is_directory(what, fault)) {
    for (const auto& entry : std::filesystem::directory_iterator{what, fault}) {
      if (entry.path().extension() == ".pcd" || entry.path().extension() == ".ply") files.push_back(entry.path());
    }
    std::ranges::sort(files, [](const auto& a, const auto& b) { return comesBefore(a.filename().string(), b.filename().string()); });
  } else {
    files.push_back(what);
  }
  if (files.empty()) return Error{Error::Code::NotFound, fmt::format("{}: there are no clouds (.pcd, .ply)", what.string())};
  auto clouds = std::make_unique<Clouds>(std::move(files), options);
  if (auto ready = clouds->open(); !ready) return ready.error();
  return std::unique_ptr<ImportSource>{std::move(clouds)};
}

}  // namespace toftwin::cli
