// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

/// Names of columns where no record of the rows' width has them.
namespace toftwin::table {

/// Fields of a comment as names of so many columns, at whichever delimiter parts it so; empty: it names none.
std::vector<std::string> namesInComment(std::string_view comment, std::size_t width, char delimiter);

/// Words of a line parted by two blanks or more, as names over columns of a fixed width; empty: they are not so many.
std::vector<std::string> namesAtWideGaps(std::string_view line, std::size_t width);

}  // namespace toftwin::table
