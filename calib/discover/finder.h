// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/discover/finding.h"

/// From evidence to effects: is there anything, which is it, what shape has it, could it be something else?
namespace toftwin::discover {

Finding find(const RowSource& source, const FinderOptions& options);

}  // namespace toftwin::discover
