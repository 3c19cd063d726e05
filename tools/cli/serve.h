// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "protocol/record/recording.h"
#include "tools/cli/command.h"

namespace toftwin::cli {

/// Options of `toftwin replay --serve`.
struct ServeOptions {
  int port = 47800;
  std::string socket;
  std::string pace = "exact";
  bool loop = false;
  void add(Arguments& args, const Argument& serve);  ///< which each of them needs
};

/// Becomes a `toftwind` (the one beside this program, else the one in PATH) whose sources are those
/// of the recording. Comes back only with an error.
Result<Exit> serve(const std::string& file, const std::string& source,
                   const record::Summary& summary, const ServeOptions& options);

}  // namespace toftwin::cli
