// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/result.h>

#include "calib/compare/capture.h"
#include "calib/compare/finding.h"

namespace toftwin::compare {

/// What two captured cameras have in common and what not, as the report's first part. Error where a
/// pose cannot be compared.
Result<Finding> judgeLive(const Capture& capture);

}  // namespace toftwin::compare
