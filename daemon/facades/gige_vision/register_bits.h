// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace toftwin::daemon::gige_vision {

/// Bits of bootstrap registers (GigE Vision 2.0): SCCFG's multipart, GVSPCFG's extended ids, GVCPCFG's
/// PENDING_ACK.
inline constexpr std::uint32_t kMultipartBit = 0x40, kLongIdsBit = 0x4000'0000, kPendingBit = 0x2;

}  // namespace toftwin::daemon::gige_vision
