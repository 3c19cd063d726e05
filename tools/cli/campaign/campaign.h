// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "tools/cli/campaign/frame_maker.h"
#include "tools/cli/campaign/manifest.h"
#include "tools/cli/campaign/memory_file.h"
#include "tools/cli/campaign/sink.h"

namespace toftwin::cli {

/// Where a campaign keeps what it needs to go on after it was killed.
struct CampaignFiles {
  std::filesystem::path manifest;
  MemoryFiles memory;
  std::vector<std::string> names;  ///< how names of files begin that are written beside the manifest
  bool overwrite = false;          ///< replace what another campaign left there
};

struct CampaignReport {
  std::uint64_t rendered = 0;
  std::uint64_t there_already = 0;
};

/// Renders the frames that are not there yet. Errors: Stopped after Ctrl-C, StorageFull, InvalidArgument
/// where another campaign is there; what is finished stays, and the same call goes on.
Result<CampaignReport> runCampaign(FrameMaker& maker, Sink& sink, const std::vector<Input>& inputs,
                                   const CampaignFiles& files);

}  // namespace toftwin::cli
