// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <toftwin/result.h>

#include "protocol/wire/messages.h"

namespace toftwin::wire {

/// A decoded message as the JSON of the conformance pairs (docs/protocol.md, "Conformance"): the
/// message's name in the schema and its fields. 64-bit integers are strings, a plane's bytes are
/// hex.
std::string toJson(const Message& message);
/// What a decoder must say of bytes that are not a message.
std::string toJson(Error::Code code);

}  // namespace toftwin::wire
