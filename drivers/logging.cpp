// SPDX-License-Identifier: Apache-2.0
#include "drivers/logging.h"

#include <spdlog/spdlog.h>

namespace toftwin::logging {
namespace {

spdlog::level::level_enum levelOf(Level level) {
  switch (level) {
    case Level::Debug:
      return spdlog::level::debug;
    case Level::Info:
      return spdlog::level::info;
    case Level::Warn:
      return spdlog::level::warn;
    case Level::Error:
      return spdlog::level::err;
  }
  return spdlog::level::info;
}

}  // namespace

void write(Level level, fmt::string_view format, fmt::format_args values) noexcept try {
  spdlog::logger* const log = spdlog::default_logger_raw();
  const auto wanted = levelOf(level);
  if (!log->should_log(wanted)) return;
  log->log(wanted, spdlog::string_view_t(fmt::vformat(format, values)));
} catch (...) {  // no memory for the line; there is nobody to tell
}

}  // namespace toftwin::logging
