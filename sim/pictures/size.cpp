// SPDX-License-Identifier: Apache-2.0
#include "sim/pictures/size.h"

#include <algorithm>
#include <charconv>
#include <string_view>

namespace toftwin::pictures {
namespace {

/// Numbers at places of the file; beyond its end they are zero, which no size is.
class Bytes {
 public:
  explicit Bytes(std::span<const std::byte> file) : file_(file) {}

  [[nodiscard]] std::uint64_t big(std::uint64_t at, std::uint64_t size) const {
    std::uint64_t value = 0;
    for (std::uint64_t i = 0; i < size; ++i) value = value << 8 | at8(at + i);
    return value;
  }
  [[nodiscard]] std::uint64_t little(std::uint64_t at, std::uint64_t size) const {
    std::uint64_t value = 0;
    for (std::uint64_t i = size; i > 0; --i) value = value << 8 | at8(at + i - 1);
    return value;
  }
  [[nodiscard]] std::uint64_t number(std::uint64_t at, std::uint64_t size, bool is_big) const {
    return is_big ? big(at, size) : little(at, size);
  }
  [[nodiscard]] std::uint64_t size() const { return file_.size(); }
  [[nodiscard]] std::string_view text(std::size_t most) const {
    return {reinterpret_cast<const char*>(file_.data()), std::min(most, file_.size())};
  }

 private:
  [[nodiscard]] std::uint64_t at8(std::uint64_t at) const { return at < file_.size() ? std::to_integer<std::uint64_t>(file_[at]) : 0; }
  std::span<const std::byte> file_;
};

/// Segments up to the one that starts the frame [ITU-T T.81, B.2.2].
std::optional<PictureSize> sizeOfJpeg(const Bytes& file) {
  for (std::uint64_t at = 2; at + 9 < file.size();) {
    if (file.big(at, 1) != 0xff) return std::nullopt;
    const std::uint64_t marker = file.big(at + 1, 1);
    if (marker == 0xff || (marker >= 0xd0 && marker <= 0xd8) || marker == 0x01) {
      at += marker == 0xff ? 1 : 2;  // a filler, or a marker without a body
      continue;
    }
    const bool is_frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (is_frame) return PictureSize{file.big(at + 7, 2), file.big(at + 5, 2)};
    at += 2 + std::max<std::uint64_t>(2, file.big(at + 2, 2));
  }
  return std::nullopt;
}

/// Tags 256 and 257 of the first directory; a BigTIFF's are longer.
std::optional<PictureSize> sizeOfTiff(const Bytes& file, bool is_big) {
  const bool is_large = file.number(2, 2, is_big) == 43;
  const std::uint64_t directory = is_large ? file.number(8, 8, is_big) : file.number(4, 4, is_big);
  if (directory >= file.size()) return std::nullopt;
  const std::uint64_t count = file.number(directory, is_large ? 8 : 2, is_big), entry = is_large ? 20 : 12;
  PictureSize size;
  for (std::uint64_t i = 0; i < std::min<std::uint64_t>(count, 4'096); ++i) {
    const std::uint64_t at = directory + (is_large ? 8 : 2) + i * entry, tag = file.number(at, 2, is_big);
    const std::uint64_t type = file.number(at + 2, 2, is_big), value = at + (is_large ? 12 : 8);
    const std::uint64_t number = file.number(value, type == 3 ? 2 : type == 16 ? 8 : 4, is_big);
    if (tag == 256) size.width = number;
    if (tag == 257) size.height = number;
  }
  return size;
}

/// The next number of a text, taken from it.
std::uint64_t takeNumber(std::string_view& text) {
  while (!text.empty() && (text[0] < '0' || text[0] > '9')) {
    if (text[0] == '#') text.remove_prefix(std::min(text.find('\n'), text.size() - 1));  // a comment
    text.remove_prefix(1);
  }
  std::uint64_t value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return fault == std::errc{} ? value : 0;
}

/// "-Y height +X width", or the like, behind an empty line.
std::optional<PictureSize> sizeOfHdr(const Bytes& file) {
  std::string_view text = file.text(65'536);
  const std::size_t blank = text.find("\n\n");
  if (blank == text.npos) return std::nullopt;
  text.remove_prefix(blank + 2);
  const std::uint64_t first = takeNumber(text), second = takeNumber(text);
  return PictureSize{second, first};
}

std::optional<PictureSize> sizeOfPnm(const Bytes& file) {
  std::string_view text = file.text(4'096).substr(2);
  const std::uint64_t width = takeNumber(text);
  return PictureSize{width, takeNumber(text)};
}

/// Rows count down where they stand from the bottom up: the height may be negative.
PictureSize sizeOfBmp(const Bytes& file) {
  if (file.little(14, 4) == 12) return {file.little(18, 2), file.little(20, 2)};
  const auto height = static_cast<std::int32_t>(static_cast<std::uint32_t>(file.little(22, 4)));
  return {file.little(18, 4), static_cast<std::uint64_t>(std::abs(static_cast<std::int64_t>(height)))};
}

}  // namespace

std::optional<PictureSize> sizeOf(std::span<const std::byte> bytes) {
  const Bytes file{bytes};
  const std::string_view start = file.text(16);
  if (start.starts_with("\x89PNG\r\n\x1a\n")) return PictureSize{file.big(16, 4), file.big(20, 4)};
  if (start.starts_with("\xff\xd8")) return sizeOfJpeg(file);
  if (start.starts_with("II")) return sizeOfTiff(file, false);
  if (start.starts_with("MM")) return sizeOfTiff(file, true);
  if (start.starts_with("#?")) return sizeOfHdr(file);
  if (start.starts_with("BM")) return sizeOfBmp(file);
  if (start.size() > 2 && start[0] == 'P' && start[1] >= '1' && start[1] <= '7') return sizeOfPnm(file);
  return std::nullopt;
}

}  // namespace toftwin::pictures
