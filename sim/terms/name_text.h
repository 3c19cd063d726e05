// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

/// How names stand in a term's text.
namespace toftwin::terms {

/// Independent of the locale. A name's first character is no digit, so that it is no number.
constexpr bool isLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
constexpr bool isDigit(char c) { return c >= '0' && c <= '9'; }

inline std::string quotedText(std::string_view name) {
  std::string text = "'";
  for (char c : name) text += c == '\'' ? std::string{"''"} : std::string{c};
  return text + "'";
}

/// Bare where that is unmistakable: "inf" and "nan" are numbers.
inline std::string nameText(std::string_view name) {
  bool is_word = !name.empty() && isLetter(name.front()) && name != "inf" && name != "nan";
  for (char c : name) is_word = is_word && (isLetter(c) || isDigit(c));
  return is_word ? std::string{name} : quotedText(name);
}

}  // namespace toftwin::terms
