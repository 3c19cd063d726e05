// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "sim/pictures/read.h"
#include "tools/cli/import/import_source.h"

namespace toftwin::cli {
namespace {

bool isPicture(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".png" || extension == ".tif" || extension == ".tiff" || extension == ".pgm";
}

/// Whether a name comes before another; runs of digits are compared as numbers, so that 9 is before 10.
bool comesBefore(std::string_view a, std::string_view b) {
  const auto isDigit = [](char c) { return c >= '0' && c <= '9'; };
  const auto takeNumber = [&](std::string_view& text) {
    std::size_t end = 0;
    while (end < text.size() && isDigit(text[end])) ++end;
    std::string_view digits = text.substr(0, end);
    text.remove_prefix(end);
    while (digits.size() > 1 && digits[0] == '0') digits.remove_prefix(1);
    return digits;
  };
  while (!a.empty() && !b.empty()) {
    if (isDigit(a[0]) && isDigit(b[0])) {
      const std::string_view first = takeNumber(a), second = takeNumber(b);
      if (first.size() != second.size()) return first.size() < second.size();
      if (first != second) return first < second;
    } else if (a[0] != b[0]) {
      return a[0] < b[0];
    } else {
      a.remove_prefix(1);
      b.remove_prefix(1);
    }
  }
  return a.size() < b.size();
}

class PictureFolder final : public ImportSource {
 public:
  PictureFolder(std::vector<std::filesystem::path> files, const ImportOptions& options)
      : files_(std::move(files)), mm_per_count_(options.mm_per_count.value_or(1.0)) {
    if (!options.mm_per_count) notes_.push_back("a count is taken for 1 mm (--mm-per-count says otherwise)");
    notes_.push_back("0 and the largest count are taken for invalid");
  }

  Result<ImportedFrame> next() override {
    if (at_ == files_.size()) return Error{Error::Code::EndOfStream, "no more pictures"};
    auto image = metresOfPicture(files_[at_++], mm_per_count_);
    if (!image) return image.error();
    return ImportedFrame{*std::move(image), {}, {}};
  }
  [[nodiscard]] std::uint64_t frames() const override { return files_.size(); }
  [[nodiscard]] std::vector<std::string> notes() const override { return notes_; }

 private:
  const std::vector<std::filesystem::path> files_;
  const double mm_per_count_;
  std::vector<std::string> notes_;
  std::size_t at_ = 0;
};

}  // namespace

Result<Image<float>> metresOfPicture(const std::filesystem::path& file, double mm_per_count) {
  const auto read = pictures::read(file);
  if (!read) return read.error();
  const cv::Mat& picture = *read;
  if (picture.empty() || picture.channels() != 1 || (picture.depth() != CV_8U && picture.depth() != CV_16U && picture.depth() != CV_32F)) {
    return Error{Error::Code::Malformed,
                 fmt::format("{}: {}", file.string(),
                             picture.empty() ? "this is no picture that can be read" : "a picture of one channel of 8, 16 or 32 bits is needed")};
  }
  const bool is_float = picture.depth() == CV_32F;
  const float most = is_float ? std::numeric_limits<float>::infinity() : picture.depth() == CV_8U ? 255.0f : 65'535.0f;
  const auto scale = static_cast<float>(is_float ? 1.0 : mm_per_count * 1e-3);
  cv::Mat numbers;
  picture.convertTo(numbers, CV_32F);
  Image<float> image{picture.cols, picture.rows};
  for (int y = 0; y < image.height(); ++y) {
    const float* row = numbers.ptr<float>(y);
    for (int x = 0; x < image.width(); ++x) {
      const bool is_valid = row[x] > 0.0f && row[x] < most;
      image(x, y) = is_valid ? row[x] * scale : std::numeric_limits<float>::quiet_NaN();
    }
  }
  return image;
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
