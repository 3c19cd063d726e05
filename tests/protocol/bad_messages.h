// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <toftwin/result.h>

namespace toftwin::wire {

/// Bytes that a decoder must refuse, each breaking one rule of docs/protocol.md, with checksums
/// that are right where they are not the point.
struct BadMessage {
  std::string name;
  std::vector<std::byte> bytes;
  Error::Code code = Error::Code::Malformed;
  std::string why;  ///< part of the error's text
};
std::vector<BadMessage> badMessages();

}  // namespace toftwin::wire
