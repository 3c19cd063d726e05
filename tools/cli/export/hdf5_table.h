// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <toftwin/result.h>

namespace toftwin::cli {

/// A column of a table: a dataset of one dimension.
struct TableColumn {
  std::string path;  ///< "/run/folder"; the part before the last slash is made if it is not there
  std::variant<std::vector<double>, std::vector<std::int64_t>, std::vector<std::string>> values;
};

/// Writes an HDF5 file, whole or not at all: numbers of 64 bits, texts in UTF-8 of variable length; `about`
/// as attributes of the file. Errors as of files.
Result<> writeHdf5Table(const std::filesystem::path& file, const std::vector<TableColumn>& columns,
                        const std::vector<std::pair<std::string, std::string>>& about);

}  // namespace toftwin::cli
