// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/loop/left.h"

namespace toftwin::loop {

/// The shape with the inner numbers nearby that leave least: jumps by steps that shrink to a row, all others by Gauss and Newton.
Shape descend(const Left& left, Shape shape);

}  // namespace toftwin::loop
