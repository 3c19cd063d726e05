// SPDX-License-Identifier: Apache-2.0
#include "sim/pictures/library.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <opencv2/core/version.hpp>
#include <string>

namespace toftwin::pictures {

Result<void*> libraryFunction(const char* name) {
  static const std::string library =
      fmt::format("libopencv_imgcodecs.so.{}{:02}", CV_VERSION_MAJOR, CV_VERSION_MINOR);
  static void* const opened = ::dlopen(library.c_str(), RTLD_LAZY | RTLD_LOCAL);
  if (opened == nullptr) {
    return Error{Error::Code::Unsupported,
                 fmt::format("{}, which reads and writes picture files, cannot be opened; is OpenCV {}.{} installed?",
                             library, CV_VERSION_MAJOR, CV_VERSION_MINOR)};
  }
  void* const symbol = ::dlsym(opened, name);
  if (symbol == nullptr) {
    return Error{Error::Code::Unsupported,
                 fmt::format("{} has other functions than the OpenCV that this program was built with", library)};
  }
  return symbol;
}

}  // namespace toftwin::pictures
