// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

/// Words and numbers of a text, whatever the computer's language.
namespace toftwin::sim::meshes {

inline bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f' || c == '\r' || c == '\n'; }

/// The next word of `rest`, taken from it; empty if there is none.
inline std::string_view takeWord(std::string_view& rest) {
  std::size_t begin = 0;
  while (begin < rest.size() && isBlank(rest[begin])) ++begin;
  std::size_t end = begin;
  while (end < rest.size() && !isBlank(rest[end])) ++end;
  const std::string_view word = rest.substr(begin, end - begin);
  rest.remove_prefix(end);
  return word;
}

/// The next line of `rest`, taken from it, without what ends it: LF, CR or both.
inline std::string_view takeLine(std::string_view& rest) {
  const std::size_t end = rest.find_first_of("\r\n");
  const std::string_view line = rest.substr(0, end);
  if (end == std::string_view::npos) {
    rest = {};
    return line;
  }
  const bool is_pair = rest[end] == '\r' && end + 1 < rest.size() && rest[end + 1] == '\n';
  rest.remove_prefix(end + (is_pair ? 2 : 1));
  return line;
}

/// A number with a decimal point; one too large is infinite. Nothing if the word is none.
inline std::optional<double> numberOf(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0.0;
  const auto [end, fault] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (fault == std::errc::invalid_argument || end != word.data() + word.size()) return std::nullopt;
  if (fault != std::errc::result_out_of_range) return value;
  const bool is_tiny = word.find("e-") != word.npos || word.find("E-") != word.npos;
  return is_tiny ? 0.0 : INFINITY;
}

inline std::optional<long long> integerOf(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  long long value = 0;
  const auto [end, fault] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (fault != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// A URI's path with its escapes (%20) undone [RFC 3986, section 2.1].
inline std::string withoutPercents(std::string_view uri) {
  std::string path;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    unsigned char code = 0;
    const std::string_view digits = uri.substr(i).substr(0, 3);
    const bool is_escape = digits.size() == 3 && digits[0] == '%' &&
                           std::from_chars(digits.data() + 1, digits.data() + 3, code, 16).ptr == digits.data() + 3;
    path += is_escape ? static_cast<char>(code) : uri[i];
    if (is_escape) i += 2;
  }
  return path;
}

}  // namespace toftwin::sim::meshes
