// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/plan/run_index.h"

/// Locked captures are opened once: what is judged on them twice is fitted to them. What one camera of a run
/// recorded is known by that alone, so that each is opened by itself.
namespace toftwin::plan {

enum class OpenedOf { A, B, Both };

/// The name of the note that they were opened, in the run's folder.
std::string openedFile(OpenedOf cameras);

/// Error where one of these cameras' locked captures was opened before: it says when and for what; or where
/// no note of it could be written.
Result<> checkClosed(const std::filesystem::path& run, OpenedOf cameras);

/// Error where a recording of these cameras is missing or not the one that was captured. Tells nothing of
/// what is in it.
Result<> checkHashes(const std::filesystem::path& run, OpenedOf cameras,
                     const std::vector<CaptureRecord>& records);

/// For what they are opened.
struct Opening {
  std::filesystem::path run;
  OpenedOf cameras = OpenedOf::Both;
  std::filesystem::path report;
  std::string note{};
};

/// Checks both, and leaves the note before anything is read.
Result<> openLocked(const Opening& opening, const std::vector<CaptureRecord>& records);

}  // namespace toftwin::plan
