// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include <toftwin/result.h>

#include "tools/cli/campaign/frame_maker.h"

namespace toftwin::cli {

/// What effects remember of a frame, in two files that take turns, so that a kill between a frame and its
/// memory leaves that of the frame before. In the machine's own byte order: they live as long as a campaign.
class MemoryFiles {
 public:
  explicit MemoryFiles(std::filesystem::path stem) : stem_(std::move(stem)) {}
  [[nodiscard]] Result<> save(std::uint64_t frame, const FrameMemory& memory) const;
  /// Nothing where there is none of that frame, or a damaged one.
  [[nodiscard]] std::optional<FrameMemory> load(std::uint64_t frame) const;
  void remove() const;

 private:
  [[nodiscard]] std::filesystem::path fileOf(std::uint64_t frame) const;
  std::filesystem::path stem_;
};

}  // namespace toftwin::cli
