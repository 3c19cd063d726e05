// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "calib/discover/campaign/captures/reading.h"

/// A delay of the light, of which nobody knows where its zero lies.
namespace toftwin::discover {

/// That delay as an effect.
sim::AnyEffect delayInLight(const sim::SensorModel& model, double millimetres);
/// By which the light is late to see what a delay does.
inline constexpr double kDelay_mm = 5.0;
/// The effects with a delay more in the light: in a frequency_offset of theirs, or in one more.
std::vector<sim::AnyEffect> withDelay(const sim::SensorModel& model, std::vector<sim::AnyEffect> effects,
                                      double millimetres);
/// What is compared with the measurement: the camera file's effects but noise, with the delay of the light.
std::vector<sim::AnyEffect> declaredEffects(const Declared& declared);
/// For each of that list its place in the camera file; none: the delay of the light.
std::vector<std::optional<std::size_t>> placesInFile(const Declared& declared);
/// Whether an effect of that list is nothing but the delay: the camera file has no frequency_offset.
bool isOnlyDelay(const Declared& declared, const sim::AnyEffect& effect);
/// Whether it can be told from an offset of the range: its changes vary by more than 2 % of themselves.
bool isNoOffset(std::span<const Reading> changes);

}  // namespace toftwin::discover
