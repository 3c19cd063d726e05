// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include <toftwin/geometry.h>
#include <toftwin/image.h>
#include <toftwin/result.h>

namespace toftwin::sim {

/// Reads a PNG, JPEG, TIFF or Radiance HDR picture as one channel: colours become their mean. Integers are
/// scaled so that the largest is 1; floating-point values are kept. Not finite or negative is an error.
Result<Image<float>> loadGrey(const std::filesystem::path& file);
/// The same of a file's bytes; `name` stands for it in errors.
Result<Image<float>> decodeGrey(std::span<const std::byte> bytes, const std::string& name);

}  // namespace toftwin::sim
