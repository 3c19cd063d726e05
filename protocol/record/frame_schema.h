// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocol/record/mcap_records.h"

namespace toftwin::record {

/// What recordings say that their messages are: a message of the protocol (preamble, header,
/// planes).
inline constexpr const char* kMessageEncoding = "toftwin";

/// The schema record: the compiled FlatBuffers schema (.bfbs) of the header inside each message.
mcap::Schema frameSchema();

}  // namespace toftwin::record
