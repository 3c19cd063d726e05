// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "sim/effects/learned/correction.h"

namespace toftwin::sim {

/// Learned terms that are to be taken off a camera's ranges.
struct LearnedCorrection {
  Correction terms;
  std::string name;           ///< "model.toml (1a2b3c4d)": the file and the beginning of its terms' hash
  int width = 0, height = 0;  ///< of the camera that the file describes; 0 where it describes none, as a table's model does
};

/// Reads the terms of all [[effect]] tables of a file that `toftwin discover` wrote, as one sum. Of its other keys only the
/// unit and the size of the lens matter. Errors name file, line and what cannot be taken off a camera's frames: effects that are not
/// learned, terms that cannot be undone, covariates that no frame has, values that are no lengths.
Result<std::shared_ptr<const LearnedCorrection>> readCorrection(const std::filesystem::path& file);

/// Why frames of that camera with these planes cannot be corrected, or nothing: a range or a depth is needed, an amplitude
/// where a term goes with it, and as many pixels as the file's camera has.
std::string problemWith(const LearnedCorrection& correction, const std::vector<PlaneKind>& planes, const CameraInfo& camera);

}  // namespace toftwin::sim
