// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <toftwin/result.h>

#include "tools/cli/command.h"

namespace toftwin::cli {

struct CorrectRecordingOptions {
  std::string file, model;
  std::string output;  ///< empty: nothing is written
  std::string source;  ///< whose frames are corrected; empty: of the only one
  bool json = false;
  bool force = false;  ///< replaces a file that is there already
};

/// Takes a model off the frames of a recording, as the daemon does with the key `correction`: the same planes, bit for bit. Says RMS
/// before and after where frames have the true range. Errors leave no file behind: a model that cannot be taken off, or not
/// off this camera; frames that were corrected before; an output that is the input or is there already.
Result<Exit> correctRecording(const CorrectRecordingOptions& options);

}  // namespace toftwin::cli
