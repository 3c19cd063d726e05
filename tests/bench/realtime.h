// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/bench/kinect_in_room.h"

namespace toftwin::bench {

/// What a client of the daemon gets: intervals of frames, as fast as they come and at the camera's pace.
Bars frames(const Files& files);
/// Prints where a frame's time goes.
void stages(const Files& files);
/// Light against 65,536 samples of the unbiased tracer, and beside the camera's noise.
Bars errors(const Files& files);
/// How time grows with pixels, samples, surfaces and raw exposures; cold start, memory of a pixel.
Bars costs(const Files& files);
/// How time and memory grow with triangles. Forks: before any thread has started.
Bars triangles();

}  // namespace toftwin::bench
