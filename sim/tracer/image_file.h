// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include <toftwin/geometry.h>
#include <toftwin/image.h>
#include <toftwin/result.h>

namespace toftwin::sim {

/// Reads a PNG, JPEG, TIFF or Radiance HDR picture as one channel: colours become their mean. Integers are
/// scaled so that the largest is 1; floating-point values are kept. Not finite or negative is an error.
Result<Image<float>> loadGrey(const std::filesystem::path& file);

}  // namespace toftwin::sim
