// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/frame.h>

namespace toftwin::daemon::o3d303 {

/// How two by two pixels become one.
enum class Binning {
  ByAmplitude,  ///< ranges count by their amplitudes, as where charges are added before the range is made
  Simple        ///< all ranges count alike (UseSimpleBinning)
};

/// The frame with half as many rows and columns; an odd last one is left out. Of the valid pixels the ranges
/// or depths are averaged, the amplitudes too, and their flags are joined; where none is valid, the flags of
/// all four are. Planes beside range, depth, amplitude, flags and exposure do not come along.
Frame binned(const Frame& frame, Binning how);

}  // namespace toftwin::daemon::o3d303
