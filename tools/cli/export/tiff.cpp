// SPDX-License-Identifier: Apache-2.0
// TIFF: one channel of a plane with its numbers as they are, not compressed [TIFF 6.0, Adobe 1992, section 2].
#include <fmt/format.h>

#include <array>

#include <toftwin/names.h>

#include "tools/cli/export/export.h"

namespace toftwin::cli {
namespace {

enum class Tag : std::uint16_t {
  Width = 256,
  Length = 257,
  BitsPerSample = 258,
  Compression = 259,
  Photometric = 262,
  Description = 270,
  StripOffsets = 273,
  SamplesPerPixel = 277,
  RowsPerStrip = 278,
  StripByteCounts = 279,
  SampleFormat = 339,
};
enum class Type : std::uint16_t { Ascii = 2, Short = 3, Long = 4 };

template <class Number>
void append(std::vector<std::byte>& out, Number number) {
  const auto bytes = std::as_bytes(std::span{&number, 1});
  out.insert(out.end(), bytes.begin(), bytes.end());
}

}  // namespace

Result<Exported> toTiff(const Frame& frame, const ExportOptions& options) {
  const auto plane = choosePlane(frame, options.planes);
  if (!plane) return plane.error();
  if (const auto checked = pictureOf(**plane, options.channel); !checked) return checked.error();
  const Plane& chosen = **plane;
  const std::string note = fmt::format("{}{}{}", nameOf(chosen.kind), unitOf(chosen.kind).empty() ? "" : ", ", unitOf(chosen.kind));
  const std::size_t size = chosen.byteSize() / static_cast<std::size_t>(chosen.channels);
  const auto pixels = chosen.data.bytes().subspan(size * static_cast<std::size_t>(options.channel), size);

  constexpr std::uint32_t kEntries = 11, kHead = 8, kEntryBytes = 12;
  const std::uint32_t text_at = kHead + 2 + kEntries * kEntryBytes + 4;
  const auto text_bytes = static_cast<std::uint32_t>(note.size() + 1);
  const std::uint32_t pixels_at = (text_at + text_bytes + 3) / 4 * 4;
  struct Entry {
    Tag tag;
    Type type;
    std::uint32_t count, value;
  };
  const auto bits = static_cast<std::uint32_t>(8 * sizeOf(chosen.type));
  const std::array<Entry, kEntries> entries{{
      {Tag::Width, Type::Long, 1, static_cast<std::uint32_t>(chosen.width)},
      {Tag::Length, Type::Long, 1, static_cast<std::uint32_t>(chosen.height)},
      {Tag::BitsPerSample, Type::Short, 1, bits},
      {Tag::Compression, Type::Short, 1, 1},  // none
      {Tag::Photometric, Type::Short, 1, 1},  // 0 is black
      {Tag::Description, Type::Ascii, text_bytes, text_at},
      {Tag::StripOffsets, Type::Long, 1, pixels_at},
      {Tag::SamplesPerPixel, Type::Short, 1, 1},
      {Tag::RowsPerStrip, Type::Long, 1, static_cast<std::uint32_t>(chosen.height)},
      {Tag::StripByteCounts, Type::Long, 1, static_cast<std::uint32_t>(size)},
      {Tag::SampleFormat, Type::Short, 1, chosen.type == ElementType::F32 ? 3u : 1u},  // IEEE floats, or unsigned
  }};
  Exported exported;
  std::vector<std::byte>& out = exported.bytes;
  out.reserve(pixels_at + size);
  append(out, std::array{'I', 'I', '*', '\0'});
  append(out, kHead);
  append(out, static_cast<std::uint16_t>(kEntries));
  for (const Entry& entry : entries) {
    append(out, entry.tag);
    append(out, entry.type);
    append(out, entry.count);
    append(out, entry.value);
  }
  append(out, std::uint32_t{0});  // no further picture
  const auto text = std::as_bytes(std::span{note.c_str(), note.size() + 1});
  out.insert(out.end(), text.begin(), text.end());
  out.resize(pixels_at);
  out.insert(out.end(), pixels.begin(), pixels.end());
  exported.note = note;
  return exported;
}

}  // namespace toftwin::cli
