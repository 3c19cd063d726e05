// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace toftwin::sim {

/// The first 32 hex digits of the SHA-256 of `bytes`: what the protocol calls a content hash.
std::string contentHash(std::string_view bytes);

}  // namespace toftwin::sim
