// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/result.h>

/// What a file of frames holds, whatever its format: one column for each plane and for each thing that is
/// said about a frame.
namespace toftwin::cli {

enum class CellType { U8, U16, U32, U64, I64, F32, F64 };
std::size_t sizeOf(CellType type);

/// One dataset: a row for each frame, each of the same type and shape.
struct Column {
  std::string path;  ///< "/planes/range"
  CellType type = CellType::F64;
  std::vector<std::size_t> shape{};  ///< of a row; empty: one number
  std::vector<std::pair<std::string, std::string>> attributes{};

  [[nodiscard]] std::size_t rowSize() const;
};

/// A frame's cells, one for each column.
using Row = std::vector<std::vector<std::byte>>;

/// The columns for frames like this one, with these planes (empty: all that it has). NotFound names the
/// planes that there are.
Result<std::vector<Column>> columnsFor(const Frame& frame, const std::vector<PlaneKind>& planes);

/// A frame in those columns. Incompatible where it does not fit: another size, a plane that is not there,
/// another number of raw exposures or temperatures.
Result<Row> rowOf(const Frame& frame, const std::vector<Column>& columns);

/// What is said about a file of frames like this one, as attributes.
std::vector<std::pair<std::string, std::string>> textsOf(const Frame& frame);
std::vector<std::pair<std::string, std::vector<double>>> numbersOf(const Frame& frame);

}  // namespace toftwin::cli
