// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/usb_camera/operations.h"

#include <fmt/format.h>
#include <linux/usb/ch9.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "daemon/facades/usb_camera/big_endian.h"

namespace toftwin::daemon::usb_camera {
namespace {

constexpr std::uint32_t kUsbipVersion = 0x0111, kAskList = 0x8005, kAskImport = 0x8003, kList = 0x0005,
                        kImport = 0x0003;
constexpr std::size_t kOperationBytes = 8, kPathBytes = 256, kBusIdBytes = 32;
constexpr std::uint32_t kBus = 1, kDevice = 2;  // numbers at our end, which nobody needs

void appendText(Bytes& to, std::string_view text, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i)
    to.push_back(i < text.size() ? static_cast<std::byte>(text[i]) : std::byte{0});
}

Bytes headOf(std::uint32_t code, std::uint32_t status) {
  Bytes bytes;
  bytes.reserve(kOperationBytes);
  appendBig16(bytes, kUsbipVersion);
  appendBig16(bytes, code);
  appendBig32(bytes, status);
  return bytes;
}

using Classes = std::array<std::byte, 3>;  // class, subclass, protocol
std::vector<Classes> interfacesOf(std::span<const std::byte> configuration) {
  std::vector<Classes> all;
  for (std::size_t at = 0; at + 8 < configuration.size();) {
    const auto length = std::to_integer<std::size_t>(configuration[at]);
    const bool is_first_setting =
        configuration[at + 1] == std::byte{USB_DT_INTERFACE} && configuration[at + 3] == std::byte{0};
    if (is_first_setting)
      all.push_back({configuration[at + 5], configuration[at + 6], configuration[at + 7]});
    at += std::max<std::size_t>(length, 1);
  }
  return all;
}

void appendFacts(Bytes& to, const UsbDevice& device) {
  const Bytes descriptor = device.deviceDescriptor();
  const auto interfaces = interfacesOf(device.configurationDescriptor());
  const auto byte = [&](std::size_t at) { return std::to_integer<std::uint32_t>(descriptor.at(at)); };
  appendText(to, fmt::format("/toftwin/usb{}/{}", kBus, kBusId), kPathBytes);
  appendText(to, kBusId, kBusIdBytes);
  appendBig32(to, kBus);
  appendBig32(to, kDevice);
  appendBig32(to, static_cast<std::uint32_t>(device.speed()));
  for (const std::size_t at : {8U, 10U, 12U})  // vendor, product, version
    appendBig16(to, byte(at) | byte(at + 1) << 8U);
  for (const std::size_t at : {4U, 5U, 6U}) to.push_back(descriptor.at(at));  // class, subclass, protocol
  for (const std::size_t one :
       {std::size_t{1}, std::size_t{1}, interfaces.size()})  // configuration, of how many
    to.push_back(static_cast<std::byte>(one));
}

}  // namespace

Result<std::optional<Operation>> readOperation(std::span<const std::byte> bytes) {
  if (bytes.size() < kOperationBytes) return std::optional<Operation>{};
  const std::uint32_t version = big16At(bytes, 0), code = big16At(bytes, 2);
  if (version != kUsbipVersion) {
    return Error{Error::Code::Unsupported,
                 fmt::format("it speaks version {:#06x} of USB/IP, not {:#06x}", version, kUsbipVersion)};
  }
  if (code == kAskList) return std::optional{Operation{.size = kOperationBytes}};
  if (code != kAskImport)
    return Error{Error::Code::InvalidArgument, fmt::format("{:#06x} is no request of USB/IP", code)};
  Operation import{.kind = Operation::Kind::Import, .size = kOperationBytes + kBusIdBytes};
  if (bytes.size() < import.size) return std::optional<Operation>{};
  for (std::size_t at = kOperationBytes; at < import.size && bytes[at] != std::byte{0}; ++at)
    import.bus_id.push_back(static_cast<char>(bytes[at]));
  return std::optional{import};
}

Bytes listAnswer(const UsbDevice* device) {
  Bytes answer = headOf(kList, 0);
  appendBig32(answer, device != nullptr ? 1 : 0);
  if (device == nullptr) return answer;
  appendFacts(answer, *device);
  for (const Classes& one : interfacesOf(device->configurationDescriptor())) {
    answer.insert(answer.end(), one.begin(), one.end());
    answer.push_back(std::byte{0});
  }
  return answer;
}

Bytes importAnswer(ImportStatus status, const UsbDevice* device) {
  Bytes answer = headOf(kImport, static_cast<std::uint32_t>(status));
  if (status == ImportStatus::Imported && device != nullptr) appendFacts(answer, *device);
  return answer;
}

}  // namespace toftwin::daemon::usb_camera
