// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "sim/effects/effects.h"

namespace toftwin::discover {

/// A form of the simulator's for something without a name; `free`: its numbers that are fitted through the simulator.
struct LearnedEffect {
  sim::AnyEffect effect;
  std::vector<std::string> free{};
};

}  // namespace toftwin::discover
