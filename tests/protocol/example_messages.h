// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "protocol/wire/messages.h"

namespace toftwin::wire {

struct ExampleMessage {
  std::string name;
  Message message;
};

/// Every kind of message at least once, with every field set to something that is not its default,
/// and once more with all that may be absent left out. The same values each time.
std::vector<ExampleMessage> exampleMessages();

/// A frame of width × height with range (F32), amplitude (F32) and flags (U8).
Frame exampleFrame(int width, int height);

/// So many zeros, aligned, which take no memory as long as they are only read.
Buffer zeros(std::size_t bytes);

}  // namespace toftwin::wire
