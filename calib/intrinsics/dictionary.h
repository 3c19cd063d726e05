// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <toftwin/result.h>

namespace toftwin::intrinsics {

/// A dictionary of markers.
struct Markers {
  int cells = 0;  ///< across one, with its dark border
};
/// An Error if there is no such dictionary, it has fewer than `needed`, or this build cannot read markers.
Result<Markers> markersOf(const std::string& dictionary, int needed);

}  // namespace toftwin::intrinsics
