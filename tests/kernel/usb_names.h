// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "daemon/facades/usb_camera/usb_device.h"

/// What the emulated cameras, which are devices of the facade usb_camera, call the parts of theirs.
namespace toftwin::kernel_test {

using daemon::usb_camera::Answer;
using daemon::usb_camera::Bytes;
using daemon::usb_camera::Setup;
using daemon::usb_camera::SteadyTime;
using daemon::usb_camera::Transfer;
using daemon::usb_camera::UsbDevice;
using daemon::usb_camera::UsbSpeed;

}  // namespace toftwin::kernel_test
