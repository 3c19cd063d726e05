// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <toftwin/result.h>

#include "tools/cli/campaign/campaign.h"
#include "tools/cli/export/export.h"

namespace toftwin::cli {

/// What `-o` names: one file of one frame, numbered files, a folder, or one file of all frames.
enum class TargetKind { Frame, NumberedFiles, Folder, Recording, Hdf5 };

struct Target {
  TargetKind kind = TargetKind::Frame;
  std::filesystem::path path;
};

/// `several`: whether more than one frame may come.
Target targetOf(const std::string& output, bool several);

/// Of a folder: a file for each frame and format, and for each plane where a format holds one plane only.
std::vector<Product> productsIn(const std::filesystem::path& folder, const std::vector<Format>& formats,
                                const std::vector<PlaneKind>& planes, const ExportOptions& how);

/// Where the campaign keeps its inputs and what it must remember.
CampaignFiles filesOf(const Target& target, bool overwrite);

/// A folder that is missing is made; its parent must be there.
Result<> makeFolder(const Target& target);

std::unique_ptr<Sink> sinkOf(const Target& target, const std::vector<Format>& formats,
                             const std::vector<PlaneKind>& planes, const ExportOptions& how,
                             std::uint64_t frames, std::vector<std::pair<std::string, std::string>> about);

}  // namespace toftwin::cli
