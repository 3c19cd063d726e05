// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace toftwin::cli {

/// What a program did.
struct Ran {
  int status = -1;  ///< exit status; 128 + signal if one killed it
  std::string out;
  std::string err;
};

/// Runs a shell command line to its end.
Ran runShell(const std::string& command);
/// Runs the real `toftwin` with these arguments, as a shell would read them.
Ran toftwin(const std::string& arguments);

}  // namespace toftwin::cli
