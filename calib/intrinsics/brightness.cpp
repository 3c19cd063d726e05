// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/brightness.h"

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include <vector>

#include "protocol/record/recording.h"
#include "sim/pictures/read.h"

namespace toftwin::intrinsics {
namespace {

Result<cv::Mat> decode(const std::filesystem::path& file) {
  std::error_code fault;
  if (!std::filesystem::is_regular_file(file, fault)) {
    return Error{Error::Code::NotFound, fmt::format("{}: there is no such image file", file.string())};
  }
  auto image = pictures::read(file);
  if (!image || !image->empty()) return image;
  return Error{Error::Code::Malformed,
               fmt::format("{}: this is no image that can be read (PNG, PGM, TIFF of 8 or 16 bits); is it "
                           "damaged?",
                           file.string())};
}

/// One channel of it, if all three are alike.
Result<cv::Mat> grey(const std::filesystem::path& file, cv::Mat image) {
  if (image.channels() == 1) return image;
  std::vector<cv::Mat> channels;
  cv::split(image, channels);
  const auto same = [&](std::size_t i) { return cv::norm(channels[0], channels[i], cv::NORM_INF) == 0.0; };
  const bool is_grey = channels.size() == 2 || (same(1) && same(2));  // a fourth one is opacity
  if (is_grey) return channels[0];
  return Error{Error::Code::Unsupported,
               fmt::format("{}: this image has colours; give the camera's infrared (amplitude) image, for the "
                           "colour camera has a lens of its own",
                           file.string())};
}

template <class T>
Image<float> toFloat(std::span<const T> pixels, int width, int height) {
  Image<float> image{width, height};
  for (std::size_t i = 0; i < image.size(); ++i) image[i] = static_cast<float>(pixels[i]);
  return image;
}

}  // namespace

Result<Image<float>> loadBrightness(const std::filesystem::path& file) {
  auto decoded = decode(file);
  if (!decoded) return decoded.error();
  auto one = grey(file, *decoded);
  if (!one) return one.error();
  cv::Mat numbers;
  one->convertTo(numbers, CV_32F);
  Image<float> image{numbers.cols, numbers.rows};
  for (int v = 0; v < numbers.rows; ++v) {
    for (int u = 0; u < numbers.cols; ++u) image(u, v) = numbers.at<float>(v, u);
  }
  return image;
}

Result<Image<float>> brightnessOf(const Frame& frame) {
  const Plane* plane = frame.find(PlaneKind::Amplitude);
  if (plane == nullptr) plane = frame.find(PlaneKind::Ambient);
  if (plane == nullptr) {
    return Error{Error::Code::Unsupported,
                 fmt::format("frame {} of {} has no amplitude plane, in which a board could be seen",
                             frame.sequence, frame.source)};
  }
  const int width = plane->width, height = plane->height;
  switch (plane->type) {
    case ElementType::U8: return toFloat(plane->as<std::uint8_t>(), width, height);
    case ElementType::U16: return toFloat(plane->as<std::uint16_t>(), width, height);
    case ElementType::F32: return toFloat(plane->as<float>(), width, height);
  }
  return Error{Error::Code::Unsupported, "a plane of unknown type"};
}

namespace {

Error noFrameIn(const std::string& file, const std::string& damage) {
  return {Error::Code::Malformed, damage.empty()
                                      ? fmt::format("{} holds no frames", file)
                                      : fmt::format("{}: no frame of it can be read: {}", file, damage)};
}

}  // namespace

bool isRecording(const std::string& name) { return name.find(".mcap") != std::string::npos; }

Result<> readRecording(const std::string& file_and_source, int step,
                       const std::function<Result<>(NamedImage)>& take) {
  const std::size_t hash = file_and_source.rfind('#');
  const std::string file = file_and_source.substr(0, hash);
  const std::string source = hash == std::string::npos ? "" : file_and_source.substr(hash + 1);
  auto reader = record::Reader::open(file);
  if (!reader) return reader.error();
  const auto& sources = reader->summary().frames_per_source;
  if (sources.empty()) return noFrameIn(file, reader->summary().damage);
  if (source.empty() && sources.size() > 1) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{} holds {} sources: name one, as {}#{}", file, sources.size(), file,
                             sources.begin()->first)};
  }
  if (!source.empty() && !sources.contains(source)) {
    return Error{Error::Code::NotFound, fmt::format("{} holds no source \"{}\"", file, source)};
  }
  for (std::int64_t i = 0;; ++i) {
    const auto frame = reader->next(source);
    if (!frame && frame.error().code == Error::Code::EndOfStream)
      return i > 0 ? Result<>{} : Result<>{noFrameIn(file, reader->summary().damage)};
    if (!frame) return frame.error();
    if (i % step != 0) continue;
    auto brightness = brightnessOf(*frame);
    if (!brightness) return brightness.error();
    const auto taken = take({fmt::format("{} frame {}", file, frame->sequence), *std::move(brightness)});
    if (!taken) return taken.error();
  }
}

}  // namespace toftwin::intrinsics
