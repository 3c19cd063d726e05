// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/library.h"

#include <fmt/format.h>

namespace toftwin::drivers::aravis {

Error Failure::toError(std::string_view what) const {
  const auto is = [this](ArvDeviceError code) {
    return g_error_matches(error_, ARV_DEVICE_ERROR, code) != FALSE;
  };
  Error::Code code = Error::Code::InvalidArgument;
  if (is(ARV_DEVICE_ERROR_TIMEOUT) || is(ARV_DEVICE_ERROR_NOT_CONNECTED) ||
      is(ARV_DEVICE_ERROR_TRANSFER_ERROR) || is(ARV_DEVICE_ERROR_NOT_FOUND)) {
    code = Error::Code::Disconnected;
  }
  if (is(ARV_DEVICE_ERROR_NOT_CONTROLLER) || is(ARV_DEVICE_ERROR_PROTOCOL_ERROR_ACCESS_DENIED) ||
      is(ARV_DEVICE_ERROR_PROTOCOL_ERROR_BUSY)) {
    code = Error::Code::Busy;
  }
  return {code, fmt::format("aravis: {}: {}", what,
                            error_ == nullptr ? "no reason was given" : error_->message)};
}

}  // namespace toftwin::drivers::aravis
