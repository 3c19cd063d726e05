// SPDX-License-Identifier: Apache-2.0
#include "sim/pictures/read.h"

#include <fmt/format.h>

#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <type_traits>
#include <vector>

#include "sim/pictures/library.h"
#include "sim/pictures/size.h"

namespace toftwin::pictures {
namespace {

constexpr std::uint64_t kMostFileBytes = 1ull << 30;

using Imread = cv::Mat(const cv::String& file, int flags);
using Imdecode = cv::Mat(cv::InputArray bytes, int flags);
constexpr const char* kImread = "_ZN2cv6imreadERKNSt7__cxx1112basic_stringIcSt11char_traitsIcESaIcEEEi";
constexpr const char* kImdecode = "_ZN2cv8imdecodeERKNS_11_InputArrayEi";
static_assert(std::is_same_v<Imread, decltype(cv::imread)>);

/// Whether it is a picture of a known format; an error if it is one, but too large.
Result<bool> isWithinBound(std::span<const std::byte> bytes, const std::string& name) {
  const auto size = sizeOf(bytes);
  if (!size || size->width == 0 || size->height == 0) return false;
  if (size->isWithinBound()) return true;
  return Error{Error::Code::TooLarge, fmt::format("{}: the picture has {} x {} pixels, and {} are the most; make it smaller", name,
                                                  size->width, size->height, kMostPixels)};
}

/// Empty where it cannot be read.
std::vector<std::byte> bytesOf(const std::filesystem::path& file) {
  std::error_code fault;
  if (!std::filesystem::is_regular_file(file, fault)) return {};
  const std::uint64_t size = std::filesystem::file_size(file, fault);
  if (fault || size > kMostFileBytes) return {};
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  std::ifstream in{file, std::ios::binary};
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (in.gcount() != static_cast<std::streamsize>(bytes.size())) return {};
  return bytes;
}

}  // namespace

Result<cv::Mat> read(const std::filesystem::path& file) {
  const auto is_picture = isWithinBound(bytesOf(file), file.string());
  if (!is_picture) return is_picture.error();
  if (!*is_picture) return cv::Mat{};
  const auto imread = functionNamed<Imread>(kImread);
  if (!imread) return imread.error();
  try {
    return imread.value()(file.string(), cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    return cv::Mat{};  // thrown for some damaged files; for others nothing is returned
  }
}

Result<cv::Mat> decode(std::span<const std::byte> bytes, const std::string& name) {
  const auto is_picture = isWithinBound(bytes, name);
  if (!is_picture) return is_picture.error();
  if (!*is_picture) return cv::Mat{};
  const auto imdecode = functionNamed<Imdecode>(kImdecode);
  if (!imdecode) return imdecode.error();
  try {
    const cv::Mat all{1, static_cast<int>(bytes.size()), CV_8U, const_cast<std::byte*>(bytes.data())};
    return imdecode.value()(all, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    return cv::Mat{};
  }
}

}  // namespace toftwin::pictures
