// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/source.h"

namespace toftwin::reference {

/// The reference device as a camera: driver = "reference".
drivers::Driver sourceRow();

}  // namespace toftwin::reference
