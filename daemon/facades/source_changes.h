// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <toftwin/result.h>

#include "drivers/source.h"

namespace toftwin::daemon {

/// What a facade's client has set: the source's parameters and their values.
using SourceChanges = std::vector<std::pair<std::string, double>>;

/// One may be possible only after another, as a longer exposure after a slower frame rate; so what is refused
/// is tried again as long as something else could be done. If something stays refused, all is as before.
Result<> setAll(drivers::Source& source, SourceChanges changes);

}  // namespace toftwin::daemon
