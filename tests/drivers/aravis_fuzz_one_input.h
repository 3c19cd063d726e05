// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace toftwin::drivers::aravis {

/// Reads bytes as everything that comes from a camera; aborts if what comes out contradicts itself.
void fuzzOneInput(std::span<const std::byte> bytes);

}  // namespace toftwin::drivers::aravis
