// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <toftwin/result.h>

namespace toftwin::openni2 {

/// One source of one daemon; the address as `Client::connect` takes it.
struct Place {
  std::string address;
  std::string source;
  bool operator==(const Place&) const = default;
};

/// Whether a device's URI is meant for us: "toftwin:…".
bool isOurs(std::string_view uri);

/// "toftwin:SOURCE" (at `first_address`), "toftwin://HOST[:PORT]/SOURCE", "toftwin:///SOCKET'S PATH/SOURCE".
Result<Place> placeOf(std::string_view uri, std::string_view first_address);

/// The URI that `placeOf` reads.
std::string uriOf(const Place& place, std::string_view first_address);

}  // namespace toftwin::openni2
