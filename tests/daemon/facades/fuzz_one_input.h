// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace toftwin::daemon {

/// What one facade's parsers make of any bytes; aborts where they break a promise.
void fuzzOneInput(std::span<const std::byte> bytes);

}  // namespace toftwin::daemon
