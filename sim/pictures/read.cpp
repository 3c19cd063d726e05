// SPDX-License-Identifier: Apache-2.0
#include "sim/pictures/read.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <type_traits>

namespace toftwin::pictures {
namespace {

using Imread = cv::Mat(const cv::String& file, int flags);
constexpr const char* kSymbol = "_ZN2cv6imreadERKNSt7__cxx1112basic_stringIcSt11char_traitsIcESaIcEEEi";
static_assert(std::is_same_v<Imread, decltype(cv::imread)>);

/// OpenCV's imread. Its library brings GDAL and a hundred more, whose loading takes 60 ms: each program that
/// links it would begin with that, and few ever read a picture. So it is opened by the first that does, and
/// stays open.
Result<std::function<Imread>> imread() {
  static const std::string library =
      fmt::format("libopencv_imgcodecs.so.{}{:02}", CV_VERSION_MAJOR, CV_VERSION_MINOR);
  static void* const opened = ::dlopen(library.c_str(), RTLD_LAZY | RTLD_LOCAL);
  if (opened == nullptr) {
    return Error{Error::Code::Unsupported,
                 fmt::format("{}, which reads picture files, cannot be opened; is OpenCV {}.{} installed?",
                             library, CV_VERSION_MAJOR, CV_VERSION_MINOR)};
  }
  void* const symbol = ::dlsym(opened, kSymbol);
  if (symbol == nullptr) {
    return Error{
        Error::Code::Unsupported,
        fmt::format("{} has another imread than the OpenCV that this program was built with", library)};
  }
  return std::function<Imread>{reinterpret_cast<Imread*>(symbol)};
}

}  // namespace

Result<cv::Mat> read(const std::filesystem::path& file) {
  const auto decode = imread();
  if (!decode) return decode.error();
  try {
    return decode.value()(file.string(), cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    return cv::Mat{};  // thrown for some damaged files and for too large ones; for others nothing is returned
  }
}

}  // namespace toftwin::pictures
