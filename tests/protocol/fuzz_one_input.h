// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace toftwin::wire {

/// Decodes hostile bytes, once as they are and once with lengths and checksums mended so that what
/// lies behind them is reached too. What decodes must be readable to its last byte and must come
/// back the same from another round through the codec; aborts otherwise.
void fuzzOneInput(std::span<const std::byte> bytes);

}  // namespace toftwin::wire
