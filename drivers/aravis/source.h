// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "drivers/aravis/aravis.h"
#include "drivers/aravis/connection.h"
#include "drivers/aravis/images.h"
#include "drivers/source.h"

namespace toftwin::drivers::aravis {

struct OpenCamera {
  Keys keys;
  SourceInfo info;
  Connection connection;
  ImageMaker images;
};
std::unique_ptr<Source> makeSource(OpenCamera camera);

}  // namespace toftwin::drivers::aravis
