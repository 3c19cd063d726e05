// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <toftwin/frame.h>
#include <toftwin/result.h>

namespace toftwin::cli {

/// What the camera really looked at, said by somebody who measured it. Becomes the plane truth_range of each frame.
class Reference {
 public:
  virtual ~Reference() = default;
  /// Adds the plane to a frame that has none. Errors: it is not known for this frame, or of another size.
  virtual Result<> add(Frame& frame) = 0;
};

/// "2.5": a wall across the axis at so many metres. "NX,NY,NZ,D": the plane n · p = D in the camera's frame, n of any length, D in
/// metres for a unit n. A recording: its ranges, frame by frame. A table: a row for each frame with the distance of a wall across
/// the axis, in its only column of lengths, or FILE:COLUMN.
Result<std::unique_ptr<Reference>> referenceNamed(const std::string& name);

}  // namespace toftwin::cli
