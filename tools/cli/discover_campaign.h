// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/cli/arguments.h"
#include "tools/cli/command.h"

namespace toftwin::cli {

/// What `toftwin discover` asks for where it searches a run of `toftwin measure`, or a recording.
struct CampaignOptions {
  std::string model, scene, poses;
  std::vector<std::string> scenes_of;
  bool is_b = false;
  bool keep_locked = false;
  int samples_per_pixel = 256;
  std::optional<int> max_surfaces{};
  std::vector<std::string> without;
  std::string note;
  void add(Arguments& args);
  /// What is missing for this run or recording, or is for the other of the two.
  [[nodiscard]] Result<> check(const std::string& data) const;
  /// Whether any of them was given that a table does not take.
  [[nodiscard]] bool isGivenForRuns() const;
};

/// Searches the run and leaves its report in the folder.
Result<Exit> discoverRun(const std::string& run, const std::string& output,
                         const CampaignOptions& options);

}  // namespace toftwin::cli
