// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/ambient_light.h"
#include "sim/effects/ambient_suppression.h"
#include "sim/effects/bilateral_filter.h"
#include "sim/effects/calibration_table.h"
#include "sim/effects/clock_scale.h"
#include "sim/effects/column_comb.h"
#include "sim/effects/companding.h"
#include "sim/effects/defocus.h"
#include "sim/effects/delay.h"
#include "sim/effects/distortion_misfit.h"
#include "sim/effects/duty_drift.h"
#include "sim/effects/edge_filter.h"
#include "sim/effects/effect.h"
#include "sim/effects/fixed_pattern_phase.h"
#include "sim/effects/flying_pixel_filter.h"
#include "sim/effects/frequency_offset.h"
#include "sim/effects/harmonics.h"
#include "sim/effects/internal_reflection.h"
#include "sim/effects/lag.h"
#include "sim/effects/learned/learned.h"
#include "sim/effects/lens_ghost.h"
#include "sim/effects/lens_scatter.h"
#include "sim/effects/low_amplitude_filter.h"
#include "sim/effects/median_filter.h"
#include "sim/effects/nonlinearity.h"
#include "sim/effects/propagation_delay.h"
#include "sim/effects/quantisation.h"
#include "sim/effects/range_noise.h"
#include "sim/effects/read_noise.h"
#include "sim/effects/residual_drift.h"
#include "sim/effects/rise_drift.h"
#include "sim/effects/sample_gain.h"
#include "sim/effects/sample_offset.h"
#include "sim/effects/saturation.h"
#include "sim/effects/shot_noise.h"
#include "sim/effects/step_phase.h"
#include "sim/effects/temporal_filter.h"
#include "sim/effects/thermal_delay.h"
#include "sim/effects/time_walk.h"
#include "sim/effects/vignetting.h"
#include "sim/effects/warm_up.h"

namespace toftwin::sim {

/// Every effect, in the order light meets them. This list alone feeds configuration, documents, law
/// tests and discovery.
using AllEffects = EffectList<
    Harmonics, RiseDrift, DutyDrift, ThermalDelay, FrequencyOffset,                     // light: emission
    AmbientLight,                                                                       // the scene
    DistortionMisfit, Defocus, Vignetting, LensScatter, LensGhost, InternalReflection,  // optics
    PropagationDelay, FixedPatternPhase, StepPhase,                // demodulation
    Lag, ShotNoise, AmbientSuppression, Saturation,                // samples: the pixel
    Nonlinearity, SampleGain, SampleOffset, ColumnComb, ReadNoise, Quantisation,
    Companding,                                                                        // the converter
    RangeNoise, WarmUp, TimeWalk, ClockScale, ResidualDrift, Delay, CalibrationTable,  // range: decoding
    LowAmplitudeFilter, FlyingPixelFilter, EdgeFilter, MedianFilter, BilateralFilter,
    TemporalFilter,  // filters
    Learned>;        // what has no name yet, at any stage

/// One effect of a model.
using AnyEffect = AllEffects::Any;

inline terms::Stage stageOf(const AnyEffect& any) {
  return std::visit([](const auto& effect) { return stageOf(effect); }, any);
}
template <class On>
bool actsOn(const AnyEffect& any) {
  return stageOf(any) == kStageOf<On>;
}
inline Covariates explainsOf(const AnyEffect& any) {
  return std::visit([](const auto& effect) { return explainsOf(effect); }, any);
}

}  // namespace toftwin::sim
