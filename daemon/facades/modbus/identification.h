// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/facades/modbus/requests.h"

namespace toftwin::daemon::modbus {

/// What the device says of itself: the objects 0 to 6 of the specification's "Read Device Identification",
/// function 43 with the type 14. [Modbus Application Protocol 1.1b3, 6.21]
struct Identity {
  std::string vendor = "toftwin";
  std::string product_code = "modbus";
  std::string revision = TOFTWIN_VERSION;
  std::string vendor_url{};  ///< none
  std::string product = "toftwin";
  std::string model = "time-of-flight camera";
  std::string application{};  ///< the source's name
};

/// What follows the function in the answer. Nothing of `data` is trusted.
struct Identification {
  Bytes data{};
  std::uint8_t exception = 0;
};
Identification identificationFor(std::span<const std::byte> data, const Identity& identity);

}  // namespace toftwin::daemon::modbus
