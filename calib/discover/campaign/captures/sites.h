// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "calib/discover/campaign/rows/cells.h"

namespace toftwin::discover {

/// For each capture the first one of its site. Captures of one scene are of one site while what is seen lies
/// in the same cells of the grid in both, by its median less than a cell off: the scene's own patterns then
/// stay in their cells. Sites are linked: a row of captures, each near the next, is one.
std::vector<std::size_t> sitesOf(const Declared& declared, const Lit& lit, const CellGrid& grid);

}  // namespace toftwin::discover
