// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/image.h>

namespace toftwin::discover {

/// Mean over the square of 2 `reach` + 1 pixels, what lies outside or is NaN left out.
Image<float> smoothed(const Image<float>& image, int reach);

}  // namespace toftwin::discover
