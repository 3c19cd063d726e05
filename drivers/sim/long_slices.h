// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace toftwin::drivers::simulator {

/// Takes processor time in longer slices from now on, on this thread and those that compute for it. Linux (from 6.12 on)
/// lets a thread that wakes, and whose slice is shorter, take over at once: whoever sends frames or waits for them does
/// not wait until the next frame's computation has had its turn. Without effect on older kernels, for other scheduling
/// policies, and where the system forbids it.
void takeLongSlices();

}  // namespace toftwin::drivers::simulator
