// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/discover/table_data.h"

namespace toftwin::discover {

/// Random signs of n captures have one probability of 2^(1−n) that is the least they can say: a tenth of α = 0.01 takes
/// eleven. Fewer open captures have an offset each, free as those of few sessions are: they are the sessions from here
/// on, and the rows within them are what is tested.
inline constexpr std::size_t kFewestCaptures = 11;
void giveFewCapturesOffsets(TableData& data);

/// Covariates that change from session to session (or capture) and hardly within one. Where each has an offset of its
/// own, nothing can be said of them.
std::vector<std::string> onlyBetweenSessions(const TableData& data);

}  // namespace toftwin::discover
