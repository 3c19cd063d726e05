// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace toftwin::cli {

/// What a file of another program is, by its first bytes and not by its name, and what toftwin does with it.
struct FileKind {
  enum class Reader { None, Recording, Bag, Table };  ///< who of `info` can say more
  Reader reader = Reader::None;
  std::string text;  ///< "picture, 512 x 424 pixels; toftwin import makes a recording of a folder of them"
};

/// Nothing where there is no such file or folder.
std::optional<FileKind> kindOf(const std::filesystem::path& path);

}  // namespace toftwin::cli
