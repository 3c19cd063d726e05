// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>

#include <toftwin/result.h>

namespace toftwin::cli {

/// Writes a file whole or not at all: into a file beside it first, which then takes its name. What
/// is there and no regular file (a pipe, /dev/stdout) is written to directly.
Result<> writeWhole(const std::filesystem::path& file, std::span<const std::byte> bytes);
Result<> writeWhole(const std::filesystem::path& file, std::string_view text);

}  // namespace toftwin::cli
