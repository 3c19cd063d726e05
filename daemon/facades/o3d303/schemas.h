// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/o3d303/wire/schema.h"

namespace toftwin::daemon::o3d303 {

/// Whether every frame can be written after that schema.
bool isServed(const toftwin::o3d303::Schema& schema);
/// What the command "I" asks for by that number, up to 9 and 11; empty: nothing has it.
toftwin::o3d303::Schema schemaOfImage(int number);

}  // namespace toftwin::daemon::o3d303
