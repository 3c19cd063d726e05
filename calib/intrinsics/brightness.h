// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include <toftwin/frame.h>
#include <toftwin/image.h>
#include <toftwin/result.h>

namespace toftwin::intrinsics {

/// Images that show the board, as brightness in any unit.
struct NamedImage {
  std::string name;
  Image<float> brightness;
};

/// A grey image of 8, 16 or 32 bits per pixel. One with three equal channels is grey, too. Errors: not there,
/// not an image, coloured.
Result<Image<float>> loadBrightness(const std::filesystem::path& file);

/// The amplitude of a frame, or its ambient plane if it has no amplitude. An Error if it has neither.
Result<Image<float>> brightnessOf(const Frame& frame);

/// "FILE.mcap" or "FILE.mcap#SOURCE".
bool isRecording(const std::string& name);
/// Calls `take` with every `step`-th frame of a recording until it gives an Error; the recording's source must be
/// named if there are several.
Result<> readRecording(const std::string& file_and_source, int step,
                       const std::function<Result<>(NamedImage)>& take);

}  // namespace toftwin::intrinsics
