// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "tools/cli/import/array/array_frames.h"

namespace toftwin::cli {

Result<std::unique_ptr<ImportSource>> openRaw(const std::filesystem::path& file, const ImportOptions& options) {
  const auto type = numberTypeNamed(options.type.empty() ? "u2" : options.type);
  if (!type) return Error{Error::Code::InvalidArgument, fmt::format("--type {}: one of f4, f8, u1, u2, u4, i1, i2, i4, with > before it where the big end comes first", options.type)};
  const auto& shape = options.shape;
  if (shape.size() != 2 && shape.size() != 3)
    return Error{Error::Code::InvalidArgument, fmt::format("{}: these bytes are of no format that is known; if they are numbers of frames, --shape ROWS,COLUMNS says how many (and --type of which kind)", file.string())};
  auto opened = record::InputFile::open(file);
  if (!opened) return opened.error();
  const std::uint64_t size = opened->size();
  Array array{file.string(), *type, 0, shape[shape.size() - 2], shape.back(), options.plane, std::make_unique<FileStream>(*std::move(opened), 0)};
  constexpr std::uint64_t kMostSide = 1u << 26;
  const std::uint64_t each = array.rows <= kMostSide && array.columns <= kMostSide ? array.rows * array.columns * type->size : 0;
  const bool says_frames = shape.size() == 3 && shape[0] > 0;
  array.frames = says_frames ? shape[0] : each > 0 ? size / each : 0;
  std::vector<std::string> notes;
  if (options.type.empty()) notes.emplace_back("numbers are taken for integers of 16 bits, little end first (--type says otherwise)");
  if (each > 0 && size % each != 0 && !says_frames)
    return Error{Error::Code::InvalidArgument, fmt::format("{}: {} bytes are not whole frames of {} x {} numbers of {} bytes", file.string(), size, array.columns, array.rows, type->size)};
  std::vector<Array> arrays;
  arrays.push_back(std::move(array));
  return framesOf(std::move(arrays), options, std::move(notes));
}

}  // namespace toftwin::cli
