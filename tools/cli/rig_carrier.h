// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>

#include "calib/compare/capture.h"

namespace toftwin::cli {

/// The rig of that file as what carries a comparison's cameras; it must know where it is. Ctrl-C
/// stops it.
Result<std::unique_ptr<compare::Carrier>> openCarrier(const std::filesystem::path& rig_file);

}  // namespace toftwin::cli
