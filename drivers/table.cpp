// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "drivers/aravis/aravis.h"
#include "drivers/kinect2/kinect2.h"
#include "drivers/not_built.h"
#include "drivers/o3d303/o3d303.h"
#include "drivers/o3r/o3r.h"
#include "drivers/openni2/openni2.h"
#include "drivers/pattern/pattern.h"
#include "drivers/replay/replay.h"
#include "drivers/sim/simulator.h"
#include "drivers/source.h"
#include "drivers/v4l2/v4l2.h"
#include "drivers/visionary/visionary.h"

namespace toftwin::drivers {

std::span<const Driver> allDrivers() {
  // One line per driver, in the order of docs/drivers/README.md.
  static const std::array rows{
      pattern::row(),
      replay::row(),
      simulator::row(),
      o3d303::row(),
      o3r::row(),
      visionary::row(),
#ifdef TOFTWIN_HAS_V4L2
      v4l2::row(),
#else
      notBuilt<v4l2::About>(),
#endif
#ifdef TOFTWIN_HAS_OPENNI2
      openni2::row(),
#else
      notBuilt<openni2::About>(),
#endif
#ifdef TOFTWIN_HAS_ARAVIS
      aravis::row(),
#else
      notBuilt<aravis::About>(),
#endif
#ifdef TOFTWIN_HAS_KINECT2
      kinect2::row(),
#else
      notBuilt<kinect2::About>(),
#endif
  };
  return rows;
}

}  // namespace toftwin::drivers
