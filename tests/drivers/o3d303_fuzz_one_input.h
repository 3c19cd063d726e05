// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace toftwin::o3d303 {

/// Reads hostile bytes as everything that an O3D303 or its client may send. What can be read must
/// be readable to its last byte and, where we can write it, come back the same; aborts otherwise.
void fuzzOneInput(std::span<const std::byte> bytes);

}  // namespace toftwin::o3d303
