// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace toftwin::test {

/// Takes hostile bytes as the answers and as the packets of a Kinect v2. What is taken must hold what it
/// promises; aborts otherwise.
void fuzzKinect2(std::span<const std::byte> bytes);

}  // namespace toftwin::test
