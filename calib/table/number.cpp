// SPDX-License-Identifier: Apache-2.0
#include "calib/table/number.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>

namespace toftwin::table {
namespace {

using Words = std::initializer_list<std::string_view>;

bool isOneOf(std::string_view word, Words words) { return std::ranges::find(words, word) != words.end(); }

bool isDigit(char c) { return c >= '0' && c <= '9'; }

/// A letter of Latin-1 or Latin Extended-A without its accent; nothing of another.
std::string_view withoutAccent(std::uint32_t point) {
  struct Range {
    std::uint32_t first, last;
    std::string_view letters;
  };
  constexpr std::array kRanges{
      Range{0xC0, 0xC5, "a"},  Range{0xC6, 0xC6, "ae"}, Range{0xC7, 0xC7, "c"},   Range{0xC8, 0xCB, "e"},
      Range{0xCC, 0xCF, "i"},  Range{0xD1, 0xD1, "n"},  Range{0xD2, 0xD6, "o"},   Range{0xD8, 0xD8, "o"},
      Range{0xD9, 0xDC, "u"},  Range{0xDD, 0xDD, "y"},  Range{0xDF, 0xDF, "ss"},  Range{0xE0, 0xE5, "a"},
      Range{0xE6, 0xE6, "ae"}, Range{0xE7, 0xE7, "c"},  Range{0xE8, 0xEB, "e"},   Range{0xEC, 0xEF, "i"},
      Range{0xF1, 0xF1, "n"},  Range{0xF2, 0xF6, "o"},  Range{0xF8, 0xF8, "o"},   Range{0xF9, 0xFC, "u"},
      Range{0xFD, 0xFD, "y"},  Range{0xFF, 0xFF, "y"},  Range{0x152, 0x153, "oe"}};
  for (const Range& one : kRanges)
    if (point >= one.first && point <= one.last) return one.letters;
  return {};
}

/// A number's text in parts; "−" (U+2212) is a minus sign, an apostrophe or space between digits is '\''.
struct Parts {
  std::array<char, 64> mantissa{};  ///< digits and signs
  std::size_t size = 0;
  std::string_view exponent{};  ///< digits with a sign
  bool is_negative = false, is_number = false;
};

/// Takes a mark between groups of three off the front: ', ’, space, no-break space, thin spaces.
bool takesGroupMark(std::string_view& text) {
  for (const std::string_view mark : {"'", " ", "\xC2\xA0", "\xE2\x80\xAF", "\xE2\x80\x89", "\xE2\x80\x99"}) {
    if (!text.starts_with(mark)) continue;
    text.remove_prefix(mark.size());
    return true;
  }
  return false;
}

std::string_view withoutSign(std::string_view text, bool& is_negative) {
  constexpr std::string_view kMinus = "\xE2\x88\x92";
  if (text.starts_with(kMinus)) {
    is_negative = true;
    return text.substr(kMinus.size());
  }
  if (!text.empty() && (text.front() == '-' || text.front() == '+')) {
    is_negative = text.front() == '-';
    return text.substr(1);
  }
  return text;
}

Parts partsOf(std::string_view field) {
  Parts parts;
  std::string_view text = withoutSign(field, parts.is_negative);
  bool has_digit = false;
  while (!text.empty() && parts.size < parts.mantissa.size()) {
    if (isDigit(text.front()) || text.front() == '.' || text.front() == ',') {
      has_digit = has_digit || isDigit(text.front());
      parts.mantissa[parts.size++] = text.front();
      text.remove_prefix(1);
    } else if (has_digit && takesGroupMark(text)) {
      parts.mantissa[parts.size++] = '\'';
    } else {
      break;
    }
  }
  if (!has_digit) return parts;
  if (!text.empty() && isOneOf(text.substr(0, 1), {"e", "E", "d", "D"})) {
    parts.exponent = text.substr(1);
    bool ignored = false;
    const std::string_view digits = withoutSign(parts.exponent, ignored);
    if (digits.empty() || digits.size() > 4 || !std::ranges::all_of(digits, isDigit)) return parts;
    text = {};
  }
  parts.is_number = text.empty();
  return parts;
}

/// Whether marks of this kind part groups of three digits before `end`, the first of which has one to three.
bool areGroups(const Parts& parts, char mark, std::size_t end) {
  std::size_t digits = 0;
  bool is_first = true;
  for (std::size_t i = 0; i < end; ++i) {
    if (isDigit(parts.mantissa[i])) {
      ++digits;
    } else {
      if (parts.mantissa[i] != mark || parts.mantissa[0] == '0' || digits == 0 || digits > 3 ||
          (!is_first && digits != 3))
        return false;
      is_first = false, digits = 0;
    }
  }
  return is_first || digits == 3;
}

std::string_view mantissaOf(const Parts& parts) { return {parts.mantissa.data(), parts.size}; }

/// Of a number in which only one kind of sign stands.
Signs signsOfOneKind(const Parts& parts, char sign, std::ptrdiff_t count) {
  const std::string_view text = mantissaOf(parts);
  const bool is_point = sign == '.';
  if (count > 1) {
    if (!areGroups(parts, sign, text.size())) return Signs::NoNumber;
    return is_point ? Signs::GroupsOfPoint : Signs::GroupsOfComma;
  }
  const std::size_t at = text.find(sign);
  const bool has_mark = text.find('\'') != std::string_view::npos;
  if (has_mark && !areGroups(parts, '\'', at)) return Signs::NoNumber;
  const bool may_part = !has_mark && at >= 1 && at <= 3 && text.size() - at == 4 && text.front() != '0' &&
                        parts.exponent.empty();
  if (may_part) return is_point ? Signs::EitherOfPoint : Signs::EitherOfComma;
  return is_point ? Signs::Point : Signs::Comma;
}

}  // namespace

std::string folded(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const bool is_pair = byte >= 0xC3 && byte <= 0xC5 && i + 1 < text.size();
    const auto letters =
        is_pair ? withoutAccent((byte & 0x1FU) << 6U | (static_cast<unsigned char>(text[i + 1]) & 0x3FU))
                : std::string_view{};
    if (!letters.empty()) {
      out += letters, ++i;
    } else {
      out += static_cast<char>(std::tolower(byte));
    }
  }
  return out;
}

bool isSpreadsheetError(std::string_view field) {
  constexpr std::size_t kLongest = 14;
  if (field.size() < 3 || field.size() > kLongest || field.front() != '#') return false;
  const bool is_shouted =
      (field[1] >= 'A' && field[1] <= 'Z') || field[1] == '\xC2';  // "#¡DIV/0!" in Spanish
  if (field.back() == '!' || field.back() == '?') return is_shouted;
  return isOneOf(folded(field), {"#n/a", "#na", "#nv", "#n/d", "#nd"});
}

bool saysNothingAmongNames(std::string_view field) {
  return field.empty() || isSpreadsheetError(field) ||
         isOneOf(folded(field), {"nan", "na", "n/a", "<na>", "null", "\\n"});
}

bool saysNothing(std::string_view field) {
  constexpr std::size_t kLongest = 16;
  if (field.empty() || (field.size() == 1 && isDigit(field.front()))) return field.empty();
  if (isDigit(field.back()) && field.find('#') == std::string_view::npos) return false;  // most fields by far
  if (field.size() > kLongest) return false;
  if (saysNothingAmongNames(field)) return true;
  if (field.find_first_not_of("-*?._") == std::string_view::npos) return true;
  return isOneOf(folded(field),
                 {"-nan",       "+nan",         "nan(ind)",     "-nan(ind)",    "1.#qnan",      "-1.#ind",
                  "1.#ind",     "1.#inf",       "-1.#inf",      "inf",          "+inf",         "-inf",
                  "infinity",   "-infinity",    "none",         "nil",          "nat",          "n.a.",
                  "n. a.",      "n.d.",         "nd",           "k.a.",         "k. a.",        "(null)",
                  "missing",    "invalid",      "leer",         "fehlt",        "ungultig",     "ol",
                  "o.l",        "overload",     "overflow",     "over",         "out of range", "no data",
                  "no reading", "\xE2\x80\x93", "\xE2\x80\x94", "\xE2\x88\x9E", "-\xE2\x88\x9E"});
}

Signs signsOf(std::string_view field) {
  const Parts parts = partsOf(field);
  if (!parts.is_number) return Signs::NoNumber;
  const std::string_view text = mantissaOf(parts);
  const auto points = std::ranges::count(text, '.'), commas = std::ranges::count(text, ',');
  if (points == 0 && commas == 0) {
    const bool has_mark = text.find('\'') != std::string_view::npos;
    return has_mark && !areGroups(parts, '\'', text.size()) ? Signs::NoNumber : Signs::Whole;
  }
  if (points == 0 || commas == 0)
    return signsOfOneKind(parts, points > 0 ? '.' : ',', std::max(points, commas));
  const bool ends_in_point = text.rfind('.') > text.rfind(',');
  const char decimal = ends_in_point ? '.' : ',', group = ends_in_point ? ',' : '.';
  if (std::ranges::count(text, decimal) != 1 || !areGroups(parts, group, text.find(decimal)))
    return Signs::NoNumber;
  return ends_in_point ? Signs::Point : Signs::Comma;
}

std::optional<double> numberIn(std::string_view field, char decimal_sign) {
  constexpr double kMost = 1e100;  // squares of what is larger overflow before anything can be said about it
  double value = 0.0;
  const auto checked = [&] { return std::isfinite(value) && std::abs(value) < kMost ? value : std::nan(""); };
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  const bool is_whole_field = error == std::errc{} && end == field.data() + field.size();
  if (is_whole_field && (decimal_sign == '.' || field.find('.') == std::string_view::npos)) return checked();
  if (saysNothing(field)) return std::nan("");
  const Parts parts = partsOf(field);
  if (!parts.is_number) return std::nullopt;
  const std::string_view text = mantissaOf(parts);
  const std::size_t decimal = std::min(text.find(decimal_sign), text.size());
  const char other = decimal_sign == '.' ? ',' : '.';
  const bool has_other = text.find(other) != std::string_view::npos;
  if (!areGroups(parts, has_other ? other : '\'', decimal)) return std::nullopt;
  std::string plain{parts.is_negative ? "-" : ""};
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (isDigit(text[i])) plain += text[i];
    if (i == decimal) plain += '.';
    if (i > decimal && !isDigit(text[i])) return std::nullopt;
  }
  if (!parts.exponent.empty())
    plain += "e" + std::string{parts.exponent.substr(parts.exponent.front() == '+' ? 1 : 0)};
  const auto [last, failed] = std::from_chars(plain.data(), plain.data() + plain.size(), value);
  if (failed == std::errc::result_out_of_range) return std::nan("");
  return failed == std::errc{} && last == plain.data() + plain.size() ? std::optional{checked()}
                                                                      : std::nullopt;
}

int decimalsOf(std::string_view field, char decimal_sign) {
  const Parts parts = partsOf(field);
  const std::string_view text = mantissaOf(parts);
  const std::size_t at = text.find(decimal_sign);
  int decimals = at == std::string_view::npos ? 0 : static_cast<int>(text.size() - at - 1);
  int exponent = 0;
  const std::string_view digits = parts.exponent.substr(parts.exponent.starts_with('+') ? 1 : 0);
  std::from_chars(digits.data(), digits.data() + digits.size(), exponent);
  return decimals - exponent;
}

std::optional<bool> flagIn(std::string_view field) {
  const std::string word = folded(field);
  if (isOneOf(word, {"1", "yes", "y", "true", "t", "x", "ja", "j", "wahr", "oui", "o", "vrai", "si", "s",
                     "vero", "verdadero"}))
    return true;
  if (isOneOf(word, {"0", "no", "n", "false", "f", "nein", "falsch", "non", "faux", "falso"}) ||
      saysNothing(field))
    return false;
  const auto number = numberIn(field, word.find(',') == std::string::npos ? '.' : ',');
  if (number == 1.0) return true;
  return number == 0.0 ? std::optional{false} : std::nullopt;
}

}  // namespace toftwin::table
