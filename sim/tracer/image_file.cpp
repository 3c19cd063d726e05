// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/image_file.h"

#include <fmt/format.h>

#include <cmath>

#include <opencv2/core.hpp>

#include "sim/pictures/read.h"

namespace toftwin::sim {
namespace {

double scaleOf(int depth) {
  if (depth == CV_8U) return 1.0 / 255.0;
  return depth == CV_16U ? 1.0 / 65535.0 : 1.0;
}

Result<Image<float>> greyOf(const cv::Mat& picture, const std::string& name) {
  const int depth = picture.depth();
  if (picture.empty() || (depth != CV_8U && depth != CV_16U && depth != CV_32F)) {
    return Error{
        Error::Code::Malformed,
        fmt::format("picture {}: not a PNG, JPEG, TIFF or HDR file of 8, 16 or 32 bits", name)};
  }
  const int channels = picture.channels(), colours = channels == 2 || channels == 4 ? channels - 1 : channels;
  Image<float> grey{picture.cols, picture.rows};
  cv::Mat numbers;  // of a row: those of all would take four times as much as the picture
  for (int y = 0; y < grey.height(); ++y) {
    picture.row(y).convertTo(numbers, CV_32F, scaleOf(depth));
    const float* row = numbers.ptr<float>(0);
    for (int x = 0; x < grey.width(); ++x) {
      float sum = 0.0f;
      for (int c = 0; c < colours; ++c) sum += row[x * channels + c];
      if (!std::isfinite(sum) || sum < 0.0f) {
        return Error{Error::Code::InvalidArgument,
                     fmt::format("picture {}: the value at column {}, row {} is negative or not a number",
                                 name, x, y)};
      }
      grey(x, y) = sum / static_cast<float>(colours);
    }
  }
  return grey;
}

}  // namespace

Result<Image<float>> loadGrey(const std::filesystem::path& file) {
  std::error_code fault;
  if (!std::filesystem::is_regular_file(file, fault)) {
    return Error{
        Error::Code::NotFound,
        fmt::format("picture {}: no such file; paths are relative to the scene file", file.string())};
  }
  const auto read = pictures::read(file);
  if (!read) return read.error();
  return greyOf(*read, file.string());
}

Result<Image<float>> decodeGrey(std::span<const std::byte> bytes, const std::string& name) {
  const auto read = pictures::decode(bytes, name);
  if (!read) return read.error();
  return greyOf(*read, name);
}

}  // namespace toftwin::sim
