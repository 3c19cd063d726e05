// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "drivers/o3d303/wire/schema.h"

namespace toftwin::daemon::ifm {

/// What a connection wants to be sent without asking: the bits of the command "p".
struct Output {
  static constexpr unsigned kResults = 1, kErrors = 2, kNotifications = 4, kAlgorithm = 8;
  static constexpr unsigned kAll = kResults | kErrors | kNotifications;
};

/// A PCIC command as the maker's cameras understand it. [ifm, operating instructions O3D303, process
/// interface]
struct Command {
  enum class Kind {
    SetSchema,       ///< "c", nine digits, JSON
    AskSchema,       ///< "C?"
    SetOutput,       ///< "p" and a hexadecimal digit
    Trigger,         ///< "t"
    TriggerAndWait,  ///< "T?"
    AskError,        ///< "E?"
    AskImage,        ///< "I", two digits, "?"
    AskConnection,   ///< "L?"
    AskCommands,     ///< "H?"
    Activate,        ///< "a", two digits: an application
    SetVersion,      ///< "v", two digits
    AskVersion,      ///< "V?"
    SetWire,         ///< "o", two digits, 0 or 1: an output of the camera
    AskWire,         ///< "O", two digits, "?"
    Refused,         ///< one of these with what cannot be
    Other            ///< for the device, or not known, or of another length
  };
  Kind kind = Kind::Other;
  toftwin::o3d303::Schema schema{};
  std::string schema_text{};  ///< as it came
  unsigned output = 0;
  int number = 0;  ///< of an image, an application, a version or a wire
  bool is_high = false;
};
/// Whether every frame of a camera can be written after that schema.
using ServesSchema = std::function<bool(const toftwin::o3d303::Schema&)>;
/// The same without "star" and "stop": what is sent because it was asked for has neither.
toftwin::o3d303::Schema withoutMarkers(toftwin::o3d303::Schema schema);
/// Any bytes are safe. A schema that is not served is Refused.
Command readCommand(std::string_view content, const ServesSchema& serves);
/// What the command "H?" answers.
std::string_view listOfCommands();

}  // namespace toftwin::daemon::ifm
