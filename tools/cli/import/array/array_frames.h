// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tools/cli/import/array/byte_stream.h"
#include "tools/cli/import/array/numbers.h"
#include "tools/cli/import/import_source.h"

namespace toftwin::cli {

/// Numbers in rows and columns, and perhaps frames.
struct Array {
  std::string name;  ///< for errors
  NumberType type;
  std::uint64_t frames = 1, rows = 0, columns = 0;
  PlaneKind kind = PlaneKind::Depth;
  std::unique_ptr<ByteStream> numbers;
};

/// The header of a .npy at the beginning of a stream, which is then at its numbers. `kind` is what they are. Errors: it is no
/// array, or not of two or three axes, or of a type that is not read, or shorter than it says.
Result<Array> arrayOfNpy(std::unique_ptr<ByteStream> stream, const std::string& name, PlaneKind kind);

/// Arrays of one shape, each a plane of the frames. InvalidArgument: their shapes differ, or cannot be.
Result<std::unique_ptr<ImportSource>> framesOf(std::vector<Array> arrays, const ImportOptions& options, std::vector<std::string> notes);

}  // namespace toftwin::cli
