// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <toftwin/frame.h>

namespace toftwin {

/// The one word for a value, as in configuration, command line and documents ("range", "simulated").
std::string_view nameOf(PlaneKind kind);
std::string_view nameOf(FrameKind kind);
std::string_view nameOf(PixelFlag flag);

/// The value of a word, or nothing.
std::optional<PlaneKind> planeKindNamed(std::string_view name);

/// For who asks for a plane by another camera's word: "" or `; for what others call "ir" see amplitude`.
std::string otherWordFor(std::string_view plane);

}  // namespace toftwin
