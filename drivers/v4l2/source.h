// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "drivers/source.h"
#include "drivers/v4l2/controls.h"
#include "drivers/v4l2/images.h"
#include "drivers/v4l2/stream.h"
#include "drivers/v4l2/v4l2.h"

namespace toftwin::drivers::v4l2 {

/// A node, ready to stream.
struct Channel {
  std::unique_ptr<Device> device;
  Layout layout;
  Duration interval;  ///< 0: not told
};

/// A camera with everything settled but the streaming.
struct Parts {
  SourceInfo info;
  Channel depth;
  std::optional<Channel> infrared;
  ImageMaker images;
  std::vector<Control> controls;
  Keys keys;
};
std::unique_ptr<Source> makeSource(Parts parts);

}  // namespace toftwin::drivers::v4l2
