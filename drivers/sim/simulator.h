// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/source.h"

/// The simulator as a camera: neither the daemon nor a client can tell it from a real one.
namespace toftwin::drivers::simulator {

Driver row();

}  // namespace toftwin::drivers::simulator
