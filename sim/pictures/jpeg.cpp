// SPDX-License-Identifier: Apache-2.0
#include "sim/pictures/jpeg.h"

#include <fmt/format.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <type_traits>

#include "sim/pictures/library.h"

namespace toftwin::pictures {
namespace {

using Imencode = bool(const cv::String& extension, cv::InputArray picture, std::vector<uchar>& bytes,
                      const std::vector<int>& parameters);
constexpr const char* kImencode =
    "_ZN2cv8imencodeERKNSt7__cxx1112basic_stringIcSt11char_traitsIcESaIcEEERKNS_11_InputArrayERSt6vectorIhSaIhEERKSB_"
    "IiSaIiEE";
static_assert(std::is_same_v<Imencode, decltype(cv::imencode)>);

/// Pixel by pixel in OpenCV's order, blue first.
cv::Mat interleaved(std::span<const std::uint8_t> planes, int width, int height) {
  cv::Mat picture(height, width, CV_8UC3);  // in braces it would hold these three numbers
  const std::size_t pixels = planes.size() / 3;
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t channel = 0; channel < 3; ++channel)
      picture.data[3 * i + channel] = planes[(2 - channel) * pixels + i];
  }
  return picture;
}

}  // namespace

Result<std::vector<std::byte>> encodeJpeg(std::span<const std::uint8_t> planes, int width, int height, int quality) {
  if (width <= 0 || height <= 0 || planes.size() != 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("a picture of {} x {} pixels has not {} bytes", width, height, planes.size())};
  }
  const auto imencode = functionNamed<Imencode>(kImencode);
  if (!imencode) return imencode.error();
  std::vector<uchar> file;
  try {
    imencode.value()(".jpg", interleaved(planes, width, height), file, {cv::IMWRITE_JPEG_QUALITY, quality});
  } catch (const cv::Exception& error) {
    return Error{Error::Code::Unsupported, fmt::format("the picture cannot be written as a JPEG: {}", error.what())};
  }
  const auto bytes = std::as_bytes(std::span{file});
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

}  // namespace toftwin::pictures
