// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "protocol/settings/settings.h"
#include "sim/effects/learned/learned.h"

/// What was learned, as camera files had it before there were terms: seven types of effects.
namespace toftwin::sim {

/// Whether that was one of them.
bool isOlderLearned(std::string_view type);

/// Reads the keys of one of them and says the same in terms. What is wrong is complained about in the table.
/// Precondition: it is one of them.
Learned readOlderLearned(std::string_view type, settings::Table& table);

}  // namespace toftwin::sim
