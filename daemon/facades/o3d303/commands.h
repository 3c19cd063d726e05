// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "drivers/o3d303/wire/schema.h"

namespace toftwin::daemon::o3d303 {

/// What a connection wants to be sent without asking: the bits of the command "p".
struct Output {
  static constexpr unsigned kResults = 1, kErrors = 2, kNotifications = 4, kAlgorithm = 8;
  static constexpr unsigned kAll = kResults | kErrors | kNotifications;
};

/// A PCIC command as the camera understands it.
struct Command {
  enum class Kind {
    SetSchema,  ///< "c", nine digits, JSON
    AskSchema,  ///< "C?"
    SetOutput,  ///< "p" and a hexadecimal digit
    Trigger,    ///< "t"
    AskError,   ///< "E?"
    Refused,    ///< one of these with what cannot be
    Other       ///< for the device, or not known
  };
  Kind kind = Kind::Other;
  toftwin::o3d303::Schema schema{};
  unsigned output = 0;
};
/// Whether every frame can be written after that schema.
bool isServed(const toftwin::o3d303::Schema& schema);
/// Any bytes are safe.
Command readCommand(std::string_view content);

}  // namespace toftwin::daemon::o3d303
