// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace toftwin::table {

/// Small letters without accents, as words are compared: "Écart-Type" → "ecart-type", "Straße" → "strasse".
std::string folded(std::string_view text);

/// Whether a field says that there is no value: nothing, nan, NA, n/a, null, none, -, ?, a spreadsheet's error in any
/// language (#N/A, #DIV/0!, #WERT!), an instrument's overload (OL) …
bool saysNothing(std::string_view field);
/// The same of a field among names, where "none" and "-" may be names: only nothing, nan, NA, n/a and errors.
bool saysNothingAmongNames(std::string_view field);
/// "#DIV/0!", "#NAME?", "#N/A", "#NV".
bool isSpreadsheetError(std::string_view field);

/// What the points and commas of a field say about which of them is the decimal sign.
enum class Signs {
  NoNumber,
  Whole,           ///< neither, or an exponent alone
  Point,           ///< certainly a decimal point: "1520.81", "0.816", "1,234.5"
  Comma,           ///< certainly a decimal comma
  EitherOfPoint,   ///< "1.234": 1.234 or 1234
  EitherOfComma,   ///< "1,234": 1.234 or 1234
  GroupsOfPoint,   ///< "1.234.567": points part thousands, so that a comma would be the decimal sign
  GroupsOfComma,
};
Signs signsOf(std::string_view field);

/// A number with that decimal sign; the other sign, an apostrophe or a space may part groups of three digits. NaN where
/// the field says nothing, or what it says is not finite or beyond 1e100. Nothing where it is a text.
std::optional<double> numberIn(std::string_view field, char decimal_sign);

/// How many digits stand behind the decimal sign; of a number with an exponent, as without it.
int decimalsOf(std::string_view field, char decimal_sign);

/// 1 or 0, yes or no, true or false, in several languages; a field that says nothing is false. Nothing where it is
/// anything else.
std::optional<bool> flagIn(std::string_view field);

}  // namespace toftwin::table
