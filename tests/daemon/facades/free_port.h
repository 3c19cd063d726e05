// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace toftwin::daemon::test {

/// A TCP port of this computer that nobody listens at, and that no other test, of this process or another, is
/// given while this process runs. (Of a port that is only free just now another test's facade may be there
/// first: the driver would open that one's camera.)
std::uint16_t freePort();

}  // namespace toftwin::daemon::test
