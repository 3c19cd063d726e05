// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <string>
#include <string_view>

#include <toftwin/result.h>

#include "drivers/logging.h"

namespace toftwin::daemon {

/// In a catch (...): what was thrown, whatever it was, as an Error that says who threw it.
inline Error thrownError(std::string_view who) {
  const std::string threw = std::string{who} + " threw ";
  try {
    throw;
  } catch (const std::exception& e) {
    return {Error::Code::Internal, threw + "an exception: " + e.what()};
  } catch (...) {
    return {Error::Code::Internal, threw + "something that is no exception of the standard library"};
  }
}

/// In a catch (...) behind which all goes on: tells the log, if there is memory for that.
inline void logThrown(std::string_view who) noexcept {
  try {
    logging::error("{}", thrownError(who).message);
  } catch (...) {
    return;
  }
}

}  // namespace toftwin::daemon
