// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace toftwin::daemon::test {

/// A TCP port that was free just now.
std::uint16_t freePort();

}  // namespace toftwin::daemon::test
