// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "calib/compare/traits/traits.h"

namespace toftwin::compare {

/// Second less first, two independent numbers, by MOVER (G. Y. Zou, A. Donner, Stat. Med. 27 (2008) 1693): d
/// − w √((v − l)² + (u₁ − v₁)²) to d + w √((u − v)² + (v₁ − l₁)²). Of intervals with a long and a short side
/// those count that face each other. NaN where an end that it takes is not known. `wider` is of normal ones; each one's
/// sides are wider by as much of Student's distribution as it has (Trait::degrees).
Trait differenceOf(const Trait& first, const Trait& second, double wider = 1.0);

/// What intervals of 95 %, as normal ones, are to be widened by so that `count` of them hold together with 95
/// %: to Šidák's level 0.95^(1/count).
double widenedFor(std::size_t count);
/// The interval of a number, widened on both sides; of Student's distribution as differenceOf() does.
Trait widened(Trait one, double wider);

/// Whether an end of an interval says something: a number, and of lengths no more than any of the cameras
/// reads.
bool isKnown(double end, const std::string& unit);

}  // namespace toftwin::compare
