// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/openni2/uri.h"

#include <algorithm>

#include "protocol/transport/address.h"

namespace toftwin::openni2 {
namespace {

constexpr std::string_view kScheme = "toftwin:";
constexpr std::string_view kUnix = "unix:", kTcp = "tcp:";
constexpr std::size_t kMostUri = 255;  // ONI_MAX_STR with its final 0
constexpr std::size_t kMostName = 64;
constexpr std::uint16_t kAnyPort = 1;

bool isName(std::string_view name) {
  constexpr std::string_view kOthers = "-_.";
  return !name.empty() && name.size() <= kMostName && std::ranges::all_of(name, [&](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                  kOthers.find(c) != kOthers.npos;
         });
}

Error wrong(std::string_view uri, std::string_view what) {
  return {Error::Code::InvalidArgument, "toftwin: \"" + std::string{uri.substr(0, kMostUri)} + "\" " +
                                            std::string{what} +
                                            "; write toftwin:SOURCE, toftwin://HOST:PORT/SOURCE or "
                                            "toftwin:///PATH/OF/SOCKET/SOURCE"};
}

}  // namespace

bool isOurs(std::string_view uri) { return uri.starts_with(kScheme); }

Result<Place> placeOf(std::string_view uri, std::string_view first_address) {
  if (!isOurs(uri)) return wrong(uri, "is no URI of toftwin");
  if (uri.size() > kMostUri) return wrong(uri, "is longer than 255 bytes");
  if (uri.find('\0') != uri.npos) return wrong(uri, "has a zero in it");
  std::string_view rest = uri.substr(kScheme.size());
  Place place{std::string{first_address}, {}};
  if (rest.starts_with("//")) {
    rest.remove_prefix(2);
    const std::size_t slash = rest.rfind('/');
    if (slash == rest.npos || slash == 0) return wrong(uri, "names no source");
    const std::string_view where = rest.substr(0, slash);
    place.address = std::string{where.starts_with('/') ? kUnix : kTcp} + std::string{where};
    const auto address = transport::parseAddress(place.address, kAnyPort);
    if (!address) return wrong(uri, "names no daemon: " + address.error().message);
    rest.remove_prefix(slash + 1);
  }
  if (!isName(rest)) return wrong(uri, "names no source: letters, digits, '-', '_' and '.', at most 64");
  place.source = rest;
  return place;
}

std::string uriOf(const Place& place, std::string_view first_address) {
  if (place.address == first_address) return std::string{kScheme} + place.source;
  std::string_view where = place.address;
  for (const std::string_view prefix : {kUnix, kTcp}) {
    if (where.starts_with(prefix)) where.remove_prefix(prefix.size());
  }
  return std::string{kScheme} + "//" + std::string{where} + "/" + place.source;
}

}  // namespace toftwin::openni2
