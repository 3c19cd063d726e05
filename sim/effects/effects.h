// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/ambient_light.h"
#include "sim/effects/delay.h"
#include "sim/effects/duty_drift.h"
#include "sim/effects/effect.h"
#include "sim/effects/fixed_pattern_phase.h"
#include "sim/effects/frequency_offset.h"
#include "sim/effects/harmonics.h"
#include "sim/effects/lens_scatter.h"
#include "sim/effects/quantisation.h"
#include "sim/effects/range_noise.h"
#include "sim/effects/read_noise.h"
#include "sim/effects/rise_drift.h"
#include "sim/effects/saturation.h"
#include "sim/effects/shot_noise.h"
#include "sim/effects/step_phase.h"
#include "sim/effects/thermal_delay.h"
#include "sim/effects/warm_up.h"

namespace toftwin::sim {

/// Every effect, in the order light meets them. This list alone feeds configuration, documents, law
/// tests and discovery.
using AllEffects = EffectList<Harmonics, RiseDrift, DutyDrift, ThermalDelay, FrequencyOffset,  // emission
                              AmbientLight, LensScatter,                                       // optics
                              FixedPatternPhase, StepPhase,                    // demodulation
                              ShotNoise, Saturation, ReadNoise, Quantisation,  // samples
                              RangeNoise, WarmUp, Delay>;                      // range

/// One effect of a model.
using AnyEffect = AllEffects::Any;

}  // namespace toftwin::sim
