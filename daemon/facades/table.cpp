// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "daemon/facades/facade.h"
#include "daemon/facades/gige_vision/keys.h"
#include "daemon/facades/modbus/keys.h"
#include "daemon/facades/o3d303/keys.h"
#include "daemon/facades/o3r/keys.h"
#include "daemon/facades/ros2/keys.h"
#include "daemon/facades/usb_camera/keys.h"
#include "daemon/facades/v4l2_loopback/keys.h"
#include "daemon/facades/visionary/keys.h"

namespace toftwin::daemon {

std::span<const FacadeKind> allFacades() {
  static const std::array kTable{
      o3d303::facade(), o3r::facade(),  visionary::facade(),  modbus::facade(), gige_vision::facade(),
      ros2::facade(),   usb_camera::facade(), v4l2_loopback::facade(),
  };
  return kTable;
}

}  // namespace toftwin::daemon
