// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "tools/cli/command.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {

std::span<const ExitMeaning> exitMeanings() {
  static constexpr std::array kMeanings{
      ExitMeaning{Exit::Ok, "done"},
      ExitMeaning{Exit::Internal, "a bug of ours; please report it"},
      ExitMeaning{Exit::Usage, "the command line is wrong; nothing was done"},
      ExitMeaning{Exit::Unreachable, "no daemon there, it ended meanwhile, or the camera is not there now"},
      ExitMeaning{Exit::BadInput, "a file, source or value is missing, damaged or wrong"},
      ExitMeaning{Exit::Refused, "not permitted, busy, or not possible with this source"},
      ExitMeaning{Exit::CannotWrite,
                  "the output cannot be written: disk full, no such folder, a reader that is gone, …"},
      ExitMeaning{Exit::Incomplete,
                  "it ended before all that was asked for, no frame came in time, or a check failed"},
      ExitMeaning{Exit::Interrupted, "Ctrl-C or SIGTERM before it was done; what runs until then (record) is done"},
  };
  return kMeanings;
}

Exit exitOf(Error::Code code) {
  switch (code) {
    case Error::Code::Internal:
      return Exit::Internal;
    case Error::Code::InvalidArgument:
    case Error::Code::NotFound:
    case Error::Code::Malformed:
    case Error::Code::TooLarge:
    case Error::Code::Incompatible:
      return Exit::BadInput;
    case Error::Code::Unsupported:
    case Error::Code::Busy:
    case Error::Code::PermissionDenied:
      return Exit::Refused;
    case Error::Code::Disconnected:
      return Exit::Unreachable;
    case Error::Code::StorageFull:
      return Exit::CannotWrite;
    case Error::Code::Timeout:
    case Error::Code::EndOfStream:
    case Error::Code::Overrun:
      return Exit::Incomplete;
    case Error::Code::Stopped:  // by the user here, else by whoever stopped the daemon
      return interrupted() ? Exit::Interrupted : Exit::Unreachable;
  }
  return Exit::Internal;
}

}  // namespace toftwin::cli
