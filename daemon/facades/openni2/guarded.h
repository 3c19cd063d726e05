// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string_view>
#include <utility>

#include <toftwin/result.h>

// OpenNI2's own classes for drivers, which leave to the driver how it allocates.
#ifndef XN_NEW
#define XN_NEW(type, ...) new type(__VA_ARGS__)
#define XN_DELETE(pointer) delete (pointer)
#endif
#include <openni2/Driver/OniDriverAPI.h>

namespace toftwin::openni2 {

/// What `work` gives, or `otherwise` if memory or threads run out: no exception leaves this module.
template <class T, class Work>
T guarded(T otherwise, Work work) noexcept {
  try {
    return work();
  } catch (...) {
    return otherwise;
  }
}
template <class Work>
void guarded(Work work) noexcept {
  try {
    work();
  } catch (...) {  // NOLINT(bugprone-empty-catch): there is nobody to tell
  }
}

/// Tells OpenNI2 what a program then reads with oniGetExtendedError.
using Complain = std::function<void(std::string_view)>;

inline OniStatus statusOf(const Result<>& result, const Complain& complain) {
  if (result) return ONI_STATUS_OK;
  complain(result.error().message);
  switch (result.error().code) {
    case Error::Code::InvalidArgument:
      return ONI_STATUS_BAD_PARAMETER;
    case Error::Code::Unsupported:
    case Error::Code::NotFound:
      return ONI_STATUS_NOT_SUPPORTED;
    case Error::Code::Timeout:
      return ONI_STATUS_TIME_OUT;
    case Error::Code::Disconnected:
      return ONI_STATUS_NO_DEVICE;
    default:
      return ONI_STATUS_ERROR;
  }
}

}  // namespace toftwin::openni2
