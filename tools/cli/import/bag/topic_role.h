// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <toftwin/frame.h>

#include "tools/cli/import/bag/bag.h"

namespace toftwin::cli {

/// What a topic is to a frame, by its type and its name.
struct TopicRole {
  enum class Kind { None, Image, Compressed, Info, Cloud, Transforms };
  Kind kind = Kind::None;
  std::string camera;              ///< "/front" of "/front/depth/image_raw": topics of one camera make one frame
  std::string space;               ///< "/front/depth": where its camera_info is
  std::optional<PlaneKind> plane;  ///< if a word of the name tells
  bool is_rectified = false;
  bool is_static = false;          ///< of transforms: they hold for all times
};
TopicRole roleOf(const BagTopic& topic);

/// "front" of "/front", "front_left" of "/front/left", "camera" of "".
std::string sourceNameOf(const std::string& camera);

}  // namespace toftwin::cli
