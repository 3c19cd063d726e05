// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

/// Bytes as text, RFC 4648 section 4.
namespace toftwin::o3d303 {

std::string toBase64(std::string_view bytes);
/// White space between the characters is left out. Any text is safe; what is no base64 is nothing.
std::optional<std::string> fromBase64(std::string_view text);

}  // namespace toftwin::o3d303
