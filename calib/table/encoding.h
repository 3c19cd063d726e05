// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <toftwin/result.h>

namespace toftwin::table {

/// A text as UTF-8, without a byte order mark.
struct DecodedText {
  std::string text{};
  std::string note{};  ///< "the file is no UTF-8: read as Windows-1252 (Latin-1)"; empty for UTF-8
};

/// Decodes UTF-8, UTF-16 in either byte order (by its mark, or by where its zero bytes are), and what is neither as
/// Windows-1252. Malformed: the bytes are no text; where they are a spreadsheet, an archive or another known kind of
/// file, the message says which.
Result<DecodedText> decodeText(std::string_view bytes);

}  // namespace toftwin::table
