// SPDX-License-Identifier: Apache-2.0
#include "calib/table/encoding.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

namespace toftwin::table {
namespace {

/// What a file that is no text begins with.
struct Signature {
  std::string_view bytes;
  const char* what;
};
constexpr std::array kSignatures{
    Signature{"PK\x03\x04", "is a spreadsheet (.xlsx, .ods) or a zip archive: save it as CSV"},
    Signature{"\xD0\xCF\x11\xE0", "is an old spreadsheet (.xls): save it as CSV"},
    Signature{"\x1F\x8B", "is compressed (gzip): unpack it"},
    Signature{"\x28\xB5\x2F\xFD", "is compressed (zstd): unpack it"},
    Signature{"\x89HDF", "is an HDF5 file, no text table: export it as CSV"},
    Signature{"\x89MCAP", "is a recording (MCAP), no text table"},
    Signature{"PAR1", "is a Parquet file, no text table: export it as CSV"},
    Signature{"\x93NUMPY", "is a NumPy file, no text table: write it with numpy.savetxt and a header"},
    Signature{"MATLAB 5.0", "is a MATLAB file, no text table: write it with writetable"}};

Error noText(std::string_view what) { return {Error::Code::Malformed, std::string{what}}; }

/// Whether all bytes are UTF-8 as RFC 3629 has it.
bool isUtf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const std::size_t more = byte < 0x80                   ? 0
                             : byte >= 0xC2 && byte < 0xE0 ? 1
                             : byte >= 0xE0 && byte < 0xF0 ? 2
                             : byte >= 0xF0 && byte < 0xF5 ? 3
                                                           : 4;
    if (more == 4 || i + more >= text.size()) return false;
    for (std::size_t k = 1; k <= more; ++k)
      if ((static_cast<unsigned char>(text[i + k]) & 0xC0U) != 0x80U) return false;
    const auto second = more == 0 ? 0U : static_cast<unsigned char>(text[i + 1]);
    const bool is_overlong = (byte == 0xE0 && second < 0xA0) || (byte == 0xF0 && second < 0x90);
    if (is_overlong || (byte == 0xED && second > 0x9F) || (byte == 0xF4 && second > 0x8F)) return false;
    i += more + 1;
  }
  return true;
}

void appendUtf8(std::string& out, std::uint32_t point) {
  const auto tail = [&](unsigned shift) { out += static_cast<char>(0x80U | (point >> shift & 0x3FU)); };
  if (point < 0x80) {
    out += static_cast<char>(point);
  } else if (point < 0x800) {
    out += static_cast<char>(0xC0U | point >> 6U), tail(0);
  } else if (point < 0x10000) {
    out += static_cast<char>(0xE0U | point >> 12U), tail(6), tail(0);
  } else {
    out += static_cast<char>(0xF0U | point >> 18U), tail(12), tail(6), tail(0);
  }
}

/// Windows-1252, as WHATWG's Encoding Standard has it: the five bytes that mean nothing are the controls of
/// Latin-1.
std::string fromWindows1252(std::string_view text) {
  constexpr std::array<std::uint32_t, 32> kHigh{
      0x20AC, 0x81,   0x201A, 0x0192, 0x201E, 0x2026, 0x2020, 0x2021, 0x02C6, 0x2030, 0x0160,
      0x2039, 0x0152, 0x8D,   0x017D, 0x8F,   0x90,   0x2018, 0x2019, 0x201C, 0x201D, 0x2022,
      0x2013, 0x2014, 0x02DC, 0x2122, 0x0161, 0x203A, 0x0153, 0x9D,   0x017E, 0x0178};
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    appendUtf8(out, byte >= 0x80 && byte < 0xA0 ? kHigh[byte - 0x80U] : byte);
  }
  return out;
}

/// UTF-16; halves of pairs that stand alone become U+FFFD.
std::string fromUtf16(std::string_view bytes, bool is_big_endian) {
  const auto unitAt = [&](std::size_t i) {
    const auto a = static_cast<unsigned char>(bytes[i]), b = static_cast<unsigned char>(bytes[i + 1]);
    return static_cast<std::uint32_t>(is_big_endian ? a << 8 | b : b << 8 | a);
  };
  std::string out;
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    std::uint32_t point = unitAt(i);
    const bool is_first = point >= 0xD800 && point < 0xDC00;
    const std::uint32_t second = is_first && i + 3 < bytes.size() ? unitAt(i + 2) : 0;
    if (second >= 0xDC00 && second < 0xE000) {
      point = 0x10000 + ((point - 0xD800) << 10U) + (second - 0xDC00), i += 2;
    } else if (point >= 0xD800 && point < 0xE000) {
      point = 0xFFFD;
    }
    appendUtf8(out, point);
  }
  return out;
}

enum class Zeros { None, OddBytes, EvenBytes, Elsewhere };

/// Of UTF-16 without a mark nearly every second byte is zero, as digits and separators are below U+0100.
Zeros zerosIn(std::string_view bytes) {
  constexpr std::size_t kLooked = 4096;
  std::array<std::size_t, 2> count{};
  const std::size_t looked = std::min(bytes.size(), kLooked);
  for (std::size_t i = 0; i < looked; ++i)
    if (bytes[i] == '\0') ++count[i % 2];
  if (count[0] + count[1] == 0)
    return bytes.find('\0') == std::string_view::npos ? Zeros::None : Zeros::Elsewhere;
  if (count[0] == 0 && count[1] * 4 > looked) return Zeros::OddBytes;
  if (count[1] == 0 && count[0] * 4 > looked) return Zeros::EvenBytes;
  return Zeros::Elsewhere;
}

Result<DecodedText> decodedUtf16(std::string_view bytes, bool is_big_endian) {
  DecodedText decoded{fromUtf16(bytes, is_big_endian), "the file is UTF-16"};
  if (decoded.text.find('\0') != std::string::npos)
    return noText("holds zero characters: this is no text table");
  return decoded;
}

}  // namespace

Result<DecodedText> decodeText(std::string_view bytes) {
  for (const Signature& one : kSignatures)
    if (bytes.starts_with(one.bytes)) return noText(one.what);
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  if (bytes.starts_with("\xFF\xFE") || bytes.starts_with("\xFE\xFF"))
    return decodedUtf16(bytes.substr(2), bytes.front() == '\xFE');
  switch (zerosIn(bytes)) {
    case Zeros::OddBytes:
    case Zeros::EvenBytes:
      return decodedUtf16(bytes, zerosIn(bytes) == Zeros::EvenBytes);
    case Zeros::Elsewhere:
      return noText("holds zero bytes: this is no text table");
    case Zeros::None:
      break;
  }
  if (isUtf8(bytes)) return DecodedText{std::string{bytes}, {}};
  return DecodedText{fromWindows1252(bytes), "the file is no UTF-8: read as Windows-1252 (Latin-1)"};
}

}  // namespace toftwin::table
