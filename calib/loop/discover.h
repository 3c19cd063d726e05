// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <toftwin/result.h>

#include "calib/loop/discovery.h"

namespace toftwin::loop {

struct DiscoverOptions {
  double alpha = 0.01;         ///< chance that something is found where there is nothing
  double locked_share = 0.2;   ///< of the rows, only for judging
  int draws = 400;
  std::uint64_t seed = 1;
};

/// Searches a table, and judges what it would write. Errors: fewer than twenty rows that have all values; nothing that the error
/// could go with.
Result<Discovery> discover(table::Readings readings, const DiscoverOptions& options);

}  // namespace toftwin::loop
