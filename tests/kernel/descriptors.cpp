// SPDX-License-Identifier: Apache-2.0
#include "descriptors.h"

#include <linux/usb/ch9.h>

namespace toftwin::kernel_test {

using daemon::usb_camera::Writer;

Bytes deviceDescriptor(UsbSpeed speed, unsigned vendor, unsigned product) {
  const bool is_super = speed == UsbSpeed::Super;
  constexpr unsigned kCommon = 2, kAssociations = 1, kFirstString = 1;
  Writer writer;
  writer.u8(USB_DT_DEVICE_SIZE).u8(USB_DT_DEVICE).u16(is_super ? 0x0300 : 0x0200);
  writer.u8(USB_CLASS_MISC).u8(kCommon).u8(kAssociations);
  writer.u8(is_super ? 9 : 64).u16(vendor).u16(product).u16(0x0100);
  return writer.u8(kFirstString).u8(kFirstString + 1).u8(kFirstString + 2).u8(1).done();
}

Bytes configurationDescriptor(unsigned interfaces, const Bytes& body) {
  constexpr unsigned kFromTheBus = 0x80, kPower = 50;
  Writer writer;
  writer.u8(USB_DT_CONFIG_SIZE)
      .u8(USB_DT_CONFIG)
      .u16(USB_DT_CONFIG_SIZE + static_cast<unsigned>(body.size()));
  return writer.u8(interfaces).u8(1).u8(0).u8(kFromTheBus).u8(kPower).bytes(body).done();
}

Bytes interfaceDescriptor(unsigned number, unsigned alternate, unsigned endpoints, ClassCode code) {
  Writer writer;
  writer.u8(USB_DT_INTERFACE_SIZE).u8(USB_DT_INTERFACE).u8(number).u8(alternate).u8(endpoints);
  return writer.u8(code.main).u8(code.sub).u8(code.protocol).u8(0).done();
}

Bytes bulkEndpoint(unsigned address, UsbSpeed speed) {
  const bool is_super = speed == UsbSpeed::Super;
  Writer writer;
  writer.u8(USB_DT_ENDPOINT_SIZE).u8(USB_DT_ENDPOINT).u8(address).u8(USB_ENDPOINT_XFER_BULK);
  writer.u16(is_super ? 1024 : 512).u8(0);
  if (is_super) writer.u8(USB_DT_SS_EP_COMP_SIZE).u8(USB_DT_SS_ENDPOINT_COMP).u8(0).u8(0).u16(0);
  return writer.done();
}

}  // namespace toftwin::kernel_test
