// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "sim/sensor/sensor_model.h"
#include "tools/validate/description.h"
#include "tools/validate/held_out.h"

namespace toftwin::validate {

/// Why one of the number's effects does not take a value of it, or nothing.
std::string problemOf(const FreeNumber& number, const std::vector<sim::AnyEffect>& effects, double value);

/// The group's effects with those values of its numbers. A value that an effect does not take leaves it as it is.
std::vector<sim::AnyEffect> effectsAt(const EffectGroup& group, std::span<const double> values);

/// The camera with effects in addition to its own; `in_place`: in place of its own of the same kinds.
sim::SensorModel withMore(const sim::SensorModel& camera, std::vector<sim::AnyEffect> more, bool in_place);

/// A camera of which one frame is the mean of many: its noise is off, and its companding, whose steps noise smooths;
/// all else acts.
sim::SensorModel withoutNoise(const sim::SensorModel& camera);

/// Predicts all rows for values of all numbers. A number that is left out is NaN.
using PredictNumbers = Predict;

/// Fits the numbers that `is_free`; the others are left out (NaN).
CurveFit fitNumbers(std::span<const double> y, const std::vector<FreeNumber>& numbers, const std::vector<bool>& is_free,
                    const PredictNumbers& predict, const Blocks& blocks);

/// The causes of the numbers, each once, in their order.
std::vector<std::string> causesOf(const std::vector<FreeNumber>& numbers);

}  // namespace toftwin::validate
