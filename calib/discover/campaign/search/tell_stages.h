// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/discover/campaign/search/raw_witness.h"
#include "calib/discover/campaign/search/round.h"

namespace toftwin::discover {

/// Where what was found acts: what raw exposures say of each effect, where there are any (null: none), and what follows
/// for those without a name.
Result<> tellStages(const RawWitness* witness, Round& round);

}  // namespace toftwin::discover
