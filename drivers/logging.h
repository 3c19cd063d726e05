// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/core.h>

namespace toftwin::logging {

enum class Level { Debug, Info, Warn, Error };

/// Gives a line to the program's default log (spdlog's), if it wants lines of this level. A line that
/// cannot be made, for want of memory say, is lost: to log never fails.
/// One function, so that spdlog's headers and fmt's formatting are compiled once and not in each file that
/// logs, which costs three seconds apiece.
void write(Level level, fmt::string_view format, fmt::format_args values) noexcept;

template <class... Values>
void debug(fmt::format_string<Values...> format, Values&&... values) noexcept {
  write(Level::Debug, format, fmt::make_format_args(values...));
}

template <class... Values>
void info(fmt::format_string<Values...> format, Values&&... values) noexcept {
  write(Level::Info, format, fmt::make_format_args(values...));
}

template <class... Values>
void warn(fmt::format_string<Values...> format, Values&&... values) noexcept {
  write(Level::Warn, format, fmt::make_format_args(values...));
}

template <class... Values>
void error(fmt::format_string<Values...> format, Values&&... values) noexcept {
  write(Level::Error, format, fmt::make_format_args(values...));
}

}  // namespace toftwin::logging
