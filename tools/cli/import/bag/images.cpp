// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/import/bag/images.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <opencv2/core.hpp>

#include <toftwin/nan.h>

#include "protocol/ros/pixels.h"
#include "sim/pictures/read.h"
#include "tools/cli/import/import_source.h"

namespace toftwin::cli {
namespace {

/// What compressed_depth_image_transport writes before the picture.
struct CompressedDepthHead {
  std::int32_t format;
  float a, b;  ///< of floats: depth = a / (count - b)
};

std::optional<Plane> planeOfMat(const cv::Mat& picture, PlaneKind kind) {
  const int depth = picture.depth(), channels = picture.channels();
  if (picture.empty() || (channels != 1 && channels != 3) || (depth != CV_8U && depth != CV_16U && depth != CV_32F)) return std::nullopt;
  const std::string encoding = fmt::format("{}C{}", depth == CV_8U ? "8U" : depth == CV_16U ? "16U" : "32F", channels);
  const std::span<const std::byte> bytes{reinterpret_cast<const std::byte*>(picture.data), picture.step[0] * static_cast<std::size_t>(picture.rows)};
  return ros::planeOf(kind, encoding, static_cast<std::uint32_t>(picture.cols), static_cast<std::uint32_t>(picture.rows),
                      static_cast<std::uint32_t>(picture.step[0]), false, bytes);
}

/// Blue first becomes red first.
void swapColours(Plane& plane) {
  const auto bytes = plane.data.bytes();
  const std::size_t size = bytes.size() / 3;
  std::vector<std::byte> swapped;
  swapped.reserve(bytes.size());
  for (const std::size_t channel : {2u, 1u, 0u}) {
    const auto one = bytes.subspan(channel * size, size);
    swapped.insert(swapped.end(), one.begin(), one.end());
  }
  plane.data = Buffer::adopt(std::move(swapped));
}

Plane withoutInvalid(const Plane& metres) {
  const auto values = metres.as<float>();
  Image<float> image = Image<float>::unset(metres.width, metres.height);
  // What is NaN already keeps its bits.
  for (std::size_t i = 0; i < image.size(); ++i) image[i] = values[i] == 0.0f || std::isinf(values[i]) ? kNaN : values[i];
  return toPlane(metres.kind, std::move(image));
}

template <class Count>
Plane metresOfCounts(const Plane& counts, PlaneKind kind, double mm_per_count) {
  const auto values = counts.as<Count>();
  const double metres = mm_per_count * 1e-3;
  Image<float> image = Image<float>::unset(counts.width, counts.height);
  for (std::size_t i = 0; i < image.size(); ++i) {
    const bool is_valid = values[i] > 0 && values[i] < std::numeric_limits<Count>::max();
    image[i] = is_valid ? static_cast<float>(static_cast<double>(values[i]) * metres) : kNaN;
  }
  return toPlane(kind, std::move(image));
}

Result<Plane> distances(Plane plane, PlaneKind kind, double mm_per_count) {
  if (plane.channels != 1) return Error{Error::Code::Malformed, "an image of distances with several channels"};
  return metresOf(plane, kind, mm_per_count);
}

}  // namespace

Plane metresOf(const Plane& counts, PlaneKind kind, double mm_per_count) {
  if (counts.type == ElementType::F32) return withoutInvalid(counts);
  return counts.type == ElementType::U16 ? metresOfCounts<std::uint16_t>(counts, kind, mm_per_count)
                                         : metresOfCounts<std::uint8_t>(counts, kind, mm_per_count);
}

std::optional<PlaneKind> kindOfEncoding(const std::string& encoding) {
  if (encoding == "16UC1" || encoding == "32FC1") return PlaneKind::Depth;
  if (encoding == "mono8" || encoding == "mono16" || encoding == "8UC1") return PlaneKind::Amplitude;
  if (encoding == "rgb8" || encoding == "bgr8") return PlaneKind::Color;
  return std::nullopt;
}

Result<Plane> planeOf(const ros::Image& image, PlaneKind kind, double mm_per_count) {
  const bool is_blue_first = image.encoding == "bgr8" || (kind == PlaneKind::Color && image.encoding == "8UC3");
  auto plane = ros::planeOf(kind, is_blue_first ? "rgb8" : image.encoding, image.width, image.height, image.step, image.is_bigendian != 0, image.data);
  if (!plane)
    return Error{Error::Code::Malformed, fmt::format("an image of {} x {} pixels in \"{}\" with {} bytes a row and {} in all, which cannot be read",
                                                     image.width, image.height, image.encoding.substr(0, 40), image.step, image.data.size())};
  if (is_blue_first) swapColours(*plane);
  return isDistance(kind) ? distances(*std::move(plane), kind, mm_per_count) : Result<Plane>{*std::move(plane)};
}

Result<UnpackedImage> unpack(const ros::CompressedImage& image, std::optional<PlaneKind> kind, double mm_per_count) {
  const bool is_depth = image.format.find("compressedDepth") != image.format.npos;
  if (image.format.find("rvl") != image.format.npos || image.format.find("RVL") != image.format.npos)
    return Error{Error::Code::Unsupported, "depth that is compressed by RVL is not read; record it as PNG or raw"};
  ros::ByteView bytes = image.data;
  CompressedDepthHead head{};
  if (is_depth) {
    if (bytes.size() < sizeof head) return Error{Error::Code::Malformed, "compressed depth that ends within its head"};
    std::memcpy(&head, bytes.data(), sizeof head);
    bytes = bytes.subspan(sizeof head);
  }
  const auto picture = pictures::decode(bytes, image.format.substr(0, 60));
  if (!picture) return picture.error();
  const PlaneKind found = kind.value_or(is_depth ? PlaneKind::Depth : picture->channels() == 3 ? PlaneKind::Color : PlaneKind::Amplitude);
  auto plane = planeOfMat(*picture, found);
  if (!plane) return Error{Error::Code::Malformed, "a compressed image that cannot be read"};
  if (found == PlaneKind::Color && plane->channels == 3) swapColours(*plane);
  if (!isDistance(found)) return UnpackedImage{*std::move(plane), found};
  if (plane->channels != 1) return Error{Error::Code::Malformed, "an image of distances with several channels"};
  if (!image.format.starts_with("32FC1")) return UnpackedImage{metresOf(*plane, found, mm_per_count), found};
  if (plane->type != ElementType::U16) return Error{Error::Code::Malformed, "compressed depth of floats without its counts"};
  Image<float> metres = Image<float>::unset(plane->width, plane->height);
  const auto counts = plane->as<std::uint16_t>();
  for (std::size_t i = 0; i < metres.size(); ++i) {
    const float depth = counts[i] == 0 ? kNaN : head.a / (static_cast<float>(counts[i]) - head.b);
    metres[i] = std::isfinite(depth) ? depth : kNaN;
  }
  return UnpackedImage{toPlane(found, std::move(metres)), found};
}

}  // namespace toftwin::cli
