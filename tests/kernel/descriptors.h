// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usb_names.h"

/// The standard descriptors of emulated cameras of several functions. [USB 3.2, chapter 9.6]
namespace toftwin::kernel_test {

/// What an interface is for.
struct ClassCode {
  unsigned main = 0, sub = 0, protocol = 0;
};

/// Of the class "miscellaneous", as of every device whose interfaces say what they are; its strings 1 to 3
/// are its maker, its name and its serial number.
Bytes deviceDescriptor(UsbSpeed speed, unsigned vendor, unsigned product);
/// The only configuration; `body` is all that it has.
Bytes configurationDescriptor(unsigned interfaces, const Bytes& body);
Bytes interfaceDescriptor(unsigned number, unsigned alternate, unsigned endpoints, ClassCode code);
/// With the companion that USB 3 has.
Bytes bulkEndpoint(unsigned address, UsbSpeed speed);

}  // namespace toftwin::kernel_test
