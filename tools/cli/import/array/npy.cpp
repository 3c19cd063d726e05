// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cstring>
#include <regex>

#include "tools/cli/import/array/array_frames.h"

namespace toftwin::cli {
namespace {

Error wrong(const std::string& name, std::string_view what) { return {Error::Code::Malformed, fmt::format("{}: {}", name, what)}; }

/// The dictionary that an array's file has before its numbers [NumPy's format.py: NEP 1].
Result<std::string> readDictionary(ByteStream& stream, const std::string& name) {
  std::array<std::byte, 8> start{};
  if (!stream.read(start) || std::memcmp(start.data(), "\x93NUMPY", 6) != 0) return wrong(name, "this is no array of NumPy");
  std::array<std::byte, 4> length{};
  const bool is_long = start[6] > std::byte{1};
  if (!stream.read(std::span{length}.first(is_long ? 4 : 2))) return wrong(name, "it ends within its header");
  std::uint32_t size = 0;
  std::memcpy(&size, length.data(), sizeof size);
  if (size > 65'536) return wrong(name, "its header is too long");
  std::string text(size, '\0');
  if (!stream.read(std::as_writable_bytes(std::span{text}))) return wrong(name, "it ends within its header");
  return text;
}

}  // namespace

Result<Array> arrayOfNpy(std::unique_ptr<ByteStream> stream, const std::string& name, PlaneKind kind) {
  const auto text = readDictionary(*stream, name);
  if (!text) return text.error();
  std::smatch found;
  if (!std::regex_search(*text, found, std::regex{"'descr': *'([^']*)'"})) return wrong(name, "its header names no type");
  const std::string type_name = found[1];
  const auto type = numberTypeNamed(type_name);
  if (!type) return wrong(name, fmt::format("its numbers are of type \"{}\"; floats of 32 and 64 bits and integers of 8 to 32 are read", type_name.substr(0, 20)));
  if (text->find("'fortran_order': True") != text->npos) return wrong(name, "its columns come first (fortran_order); save it with numpy.ascontiguousarray");
  if (!std::regex_search(*text, found, std::regex{"'shape': *\\(([0-9, ]*)\\)"})) return wrong(name, "its header names no shape");
  std::vector<std::uint64_t> shape;
  const std::string numbers = found[1];
  const std::regex number{"[0-9]{1,12}"};
  for (std::sregex_iterator at{numbers.begin(), numbers.end(), number}, end; at != end; ++at) shape.push_back(std::stoull(at->str()));
  if (shape.size() != 2 && shape.size() != 3)
    return wrong(name, fmt::format("it has {} axes; rows x columns or frames x rows x columns are needed", shape.size()));
  return Array{name, *type, shape.size() == 3 ? shape[0] : 1, shape[shape.size() - 2], shape.back(), kind, std::move(stream)};
}

Result<std::unique_ptr<ImportSource>> openNpy(const std::filesystem::path& file, const ImportOptions& options) {
  auto opened = record::InputFile::open(file);
  if (!opened) return Error{Error::Code::NotFound, fmt::format("{}: it cannot be read", file.string())};
  auto array = arrayOfNpy(std::make_unique<FileStream>(*std::move(opened), 0), file.string(), options.plane);
  if (!array) return array.error();
  std::vector<Array> arrays;
  arrays.push_back(*std::move(array));
  return framesOf(std::move(arrays), options, {});
}

}  // namespace toftwin::cli
