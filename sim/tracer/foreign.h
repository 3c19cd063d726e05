// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/images/light.h"
#include "sim/tracer/trace.h"

namespace toftwin::sim {

/// What to trace for a foreign emitter seen by the camera of `own`: its light alone, at its frequency.
TraceRequest foreignRequest(const ForeignEmitterSpec& emitter, const TraceRequest& own);

/// Adds a foreign emitter's light to the camera's own as one raw exposure of modulation frequency f sees it,
/// from `middle` − T/2 to `middle` + T/2 (device time). Its mean counts as ambient light; its modulation, at f + Δf,
/// beats with the pixel's reference, and what is left of it after the exposure adds to the fundamental's
/// phasor:
///     P += q P' exp(i (2π Δf t + φ)) sinc(π Δf T),    sinc x = sin x / x
/// with P' its phasor over the way to the pixel, q its modulation and φ its phase at device time 0. Only the
/// fundamental is counted, and its waveform taken for the camera's own. `middle` is that of the first row; each
/// further one is exposed by `row_delay` later.
void addForeignLight(const ForeignEmitterSpec& emitter, const Light& foreign, Frequency f, Duration middle,
                     Duration exposure, Duration row_delay, Light& light);

}  // namespace toftwin::sim
