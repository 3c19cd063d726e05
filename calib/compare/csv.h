// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

namespace toftwin::compare {

/// The columns of a numeric CSV file with a header line, in the order asked for. Errors name file,
/// line and column: a header that lacks a column or has it twice, fields that are not separated by commas, a
/// row with more or fewer fields than the header, an open quote, a field that is not a number, a file without rows.
Result<std::vector<std::vector<double>>> loadColumns(const std::filesystem::path& file,
                                                     std::initializer_list<std::string_view> columns);

/// One of them, with the same errors; nothing where the header lacks it.
Result<std::optional<std::vector<double>>> loadColumnIfAny(const std::filesystem::path& file,
                                                           std::string_view column);

/// The folder `tof-thesis-2018` of real measurements: in (or as) `given` if that is not empty, else
/// in $TOFTWIN_DATA, else in `../shared/data` of the repository that holds the working folder or
/// this program. Nothing if there is none.
std::optional<std::filesystem::path> findThesisData(const std::filesystem::path& given = {});

}  // namespace toftwin::compare
