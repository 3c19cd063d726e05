// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>

#include <toftwin/result.h>

namespace toftwin::cli {

/// The name of a file that stands for the standard output.
inline constexpr const char* kPipe = "-";

/// Writes a file whole or not at all: into a file beside it first, which then takes its name. What
/// is there and no regular file (a pipe, /dev/stdout) is written to directly.
Result<> writeWhole(const std::filesystem::path& file, std::span<const std::byte> bytes);
Result<> writeWhole(const std::filesystem::path& file, std::string_view text);

/// What keeps a file from being written, and what to do: `number` is the system's (errno).
Error cannotWrite(const std::filesystem::path& file, int number);

}  // namespace toftwin::cli
