// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "sim/pictures/read.h"
#include "tools/cli/import/import_source.h"
#include "tools/cli/import/natural_order.h"

namespace toftwin::cli {
namespace {

bool isPicture(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".png" || extension == ".tif" || extension == ".tiff" || extension == ".pgm";
}

class PictureFolder final : public ImportSource {
 public:
  PictureFolder(std::vector<std::filesystem::path> files, const ImportOptions& options)
      : files_(std::move(files)), kind_(options.plane), mm_per_count_(options.mm_per_count.value_or(1.0)) {
    if (!isDistance(kind_)) return;
    if (!options.mm_per_count) notes_.push_back("a count is taken for 1 mm (--mm-per-count says otherwise)");
    notes_.push_back("0 and the largest count are taken for invalid");
  }

  Result<ImportedFrame> next() override {
    if (at_ == files_.size()) return Error{Error::Code::EndOfStream, "no more pictures"};
    auto plane = planeOfPicture(files_[at_++], kind_, mm_per_count_);
    if (!plane) return plane.error();
    ImportedFrame frame;
    frame.planes.push_back(*std::move(plane));
    return frame;
  }
  [[nodiscard]] std::uint64_t frames() const override { return files_.size(); }
  [[nodiscard]] std::vector<std::string> notes() const override { return notes_; }

 private:
  const std::vector<std::filesystem::path> files_;
  const PlaneKind kind_;
  const double mm_per_count_;
  std::vector<std::string> notes_;
  std::size_t at_ = 0;
};

}  // namespace

namespace {

/// Numbers of distances in metres.
Plane metresOf(const cv::Mat& picture, PlaneKind kind, double mm_per_count) {
  const bool is_float = picture.depth() == CV_32F;
  const float most = is_float ? std::numeric_limits<float>::infinity() : picture.depth() == CV_8U ? 255.0f : 65'535.0f;
  const double scale = is_float ? 1.0 : mm_per_count * 1e-3;
  cv::Mat numbers;
  picture.convertTo(numbers, CV_32F);
  Image<float> image = Image<float>::unset(picture.cols, picture.rows);
  for (int y = 0; y < image.height(); ++y) {
    const float* row = numbers.ptr<float>(y);
    for (int x = 0; x < image.width(); ++x) {
      const bool is_valid = row[x] > 0.0f && row[x] < most;
      image(x, y) = is_valid ? static_cast<float>(static_cast<double>(row[x]) * scale) : std::numeric_limits<float>::quiet_NaN();
    }
  }
  return toPlane(kind, std::move(image));
}

template <class Number>
Plane numbersOf(const cv::Mat& picture, PlaneKind kind) {
  Image<Number> image = Image<Number>::unset(picture.cols, picture.rows);
  for (int y = 0; y < image.height(); ++y) std::copy_n(picture.ptr<Number>(y), picture.cols, &image(0, y));
  return toPlane(kind, std::move(image));
}

}  // namespace

Result<Plane> planeOfPicture(const std::filesystem::path& file, PlaneKind kind, double mm_per_count) {
  const auto read = pictures::read(file);
  if (!read) return read.error();
  const cv::Mat& picture = *read;
  if (picture.empty() || picture.channels() != 1 || (picture.depth() != CV_8U && picture.depth() != CV_16U && picture.depth() != CV_32F)) {
    return Error{Error::Code::Malformed,
                 fmt::format("{}: {}", file.string(),
                             picture.empty() ? "this is no picture that can be read" : "a picture of one channel of 8, 16 or 32 bits is needed")};
  }
  if (isDistance(kind)) return metresOf(picture, kind, mm_per_count);
  if (picture.depth() == CV_8U) return numbersOf<std::uint8_t>(picture, kind);
  return picture.depth() == CV_16U ? numbersOf<std::uint16_t>(picture, kind) : numbersOf<float>(picture, kind);
}

Result<std::unique_ptr<ImportSource>> openPictures(const std::filesystem::path& folder, const ImportOptions& options) {
  std::vector<std::filesystem::path> files;
  std::error_code fault;
  for (const auto& entry : std::filesystem::directory_iterator{folder, fault}) {
    if (isPicture(entry.path())) files.push_back(entry.path());
  }
  if (files.empty())
    return Error{Error::Code::NotFound, fmt::format("{}: there are no pictures (.png, .tif, .pgm), no depth.txt and no array", folder.string())};
  std::ranges::sort(files, [](const auto& a, const auto& b) { return comesBefore(a.filename().string(), b.filename().string()); });
  return std::unique_ptr<ImportSource>{std::make_unique<PictureFolder>(std::move(files), options)};
}

}  // namespace toftwin::cli
