// SPDX-License-Identifier: Apache-2.0
#include "sim/pictures/png.h"

#include <zlib.h>

#include <cassert>
#include <iterator>
#include <new>
#include <opencv2/core.hpp>
#include <string>

namespace toftwin::pictures {
namespace {

/// Big end first, as all of PNG.
void append(std::string& bytes, std::size_t value, int size) {
  for (int shift = 8 * (size - 1); shift >= 0; shift -= 8)
    bytes += static_cast<char>((value >> shift) & 0xff);
}

/// Length, type, body, CRC-32 of type and body.
void appendChunk(std::string& png, const std::string& type, const std::string& body) {
  append(png, body.size(), 4);
  const std::string checked = type + body;
  png += checked;
  append(png, ::crc32_z(0, reinterpret_cast<const Bytef*>(checked.data()), checked.size()), 4);
}

std::string header(const cv::Mat& picture) {
  const char colour_type = picture.channels() == 1 ? 0 : picture.channels() == 3 ? 2 : 6;
  std::string body;
  append(body, static_cast<std::size_t>(picture.cols), 4);
  append(body, static_cast<std::size_t>(picture.rows), 4);
  return body + static_cast<char>(8 * picture.elemSize1()) + colour_type + std::string(3, '\0');
}

/// A row's samples as they stand in the file: red before green and blue.
std::string samples(const cv::Mat& picture, int row) {
  const int channels = picture.channels(), width = static_cast<int>(picture.elemSize1());
  std::string bytes;
  bytes.reserve(static_cast<std::size_t>(picture.cols) * picture.elemSize());
  for (int x = 0; x < picture.cols; ++x) {
    for (int c = 0; c < channels; ++c) {
      const int i = x * channels + (channels > 1 && c < 3 ? 2 - c : c);
      append(bytes, width == 1 ? picture.ptr<std::uint8_t>(row)[i] : picture.ptr<std::uint16_t>(row)[i],
             width);
    }
  }
  return bytes;
}

/// All rows, each behind the number of its filter: 1, from each byte the one of the pixel to its left is
/// taken.
std::string filtered(const cv::Mat& picture) {
  const std::size_t pixel = picture.elemSize();
  std::string all;
  for (int row = 0; row < picture.rows; ++row) {
    const std::string bytes = samples(picture, row);
    all += '\1';
    all.append(bytes, 0, pixel);
    for (std::size_t i = pixel; i < bytes.size(); ++i) all += static_cast<char>(bytes[i] - bytes[i - pixel]);
  }
  return all;
}

std::string deflated(const std::string& bytes, int effort) {
  uLongf size = ::compressBound(bytes.size());
  std::string out(size, '\0');
  const int done = ::compress2(reinterpret_cast<Bytef*>(out.data()), &size,
                               reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), effort);
  if (done != Z_OK) throw std::bad_alloc{};  // all that can go wrong, since there is room for the result
  out.resize(size);
  return out;
}

}  // namespace

std::vector<std::byte> encodePng(const cv::Mat& picture, std::string_view description, int effort) {
  assert(!picture.empty() && (picture.depth() == CV_8U || picture.depth() == CV_16U) &&
         picture.channels() != 2);
  std::string png = "\x89PNG\r\n\x1a\n";
  appendChunk(png, "IHDR", header(picture));
  if (!description.empty()) appendChunk(png, "tEXt", std::string{"Description\0", 12}.append(description));
  appendChunk(png, "IDAT", deflated(filtered(picture), effort));
  appendChunk(png, "IEND", "");
  const auto* first = reinterpret_cast<const std::byte*>(png.data());
  return {first, first + png.size()};
}

}  // namespace toftwin::pictures
