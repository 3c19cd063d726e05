// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/plan/run_log.h"

namespace toftwin::plan {

/// What somebody looks for in a log; each is how its name begins, empty: any.
struct Sought {
  std::string camera{}, characteristic{}, number{};
};

/// Why nothing of `all` a log's numbers is what is sought: the first of the three that none has, as it was asked for,
/// and the names there are of what the others before it leave. "no camera begins with \"kinnect\"; there are:
/// kinect, twin".
std::string whyNone(const std::vector<LoggedTrait>& all, const Sought& sought);

}  // namespace toftwin::plan
