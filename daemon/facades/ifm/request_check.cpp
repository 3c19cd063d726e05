// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/ifm/request_check.h"

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/algorithm/string/predicate.hpp>
#include <boost/asio/ip/address.hpp>

#include <fmt/format.h>

#include <algorithm>

namespace toftwin::daemon::ifm {
namespace {

constexpr int kForbidden = 403, kUnsupportedMedia = 415;

/// Without port; without the brackets of an IPv6 address.
std::string_view nameIn(std::string_view host) {
  if (host.starts_with('[')) {
    const std::size_t end = host.find(']');
    return end == std::string_view::npos ? host : host.substr(1, end - 1);
  }
  return host.substr(0, host.find(':'));
}

bool isAddressInDigits(std::string_view name) {
  boost::system::error_code is_none;
  boost::asio::ip::make_address(std::string{name}, is_none);
  return !is_none;
}

bool isOwn(std::string_view name, const std::vector<std::string>& own_names) {
  const auto isSame = [&](std::string_view own) { return boost::algorithm::iequals(name, own); };
  return isAddressInDigits(name) || isSame("localhost") || std::ranges::any_of(own_names, isSame);
}

bool isXml(std::string_view content_type) {
  std::string_view media = content_type.substr(0, content_type.find(';'));
  while (media.ends_with(' ')) media.remove_suffix(1);
  return boost::algorithm::iequals(media, "text/xml") || boost::algorithm::iequals(media, "application/xml");
}

}  // namespace

Refused refusalOf(const RequestHead& head, const std::vector<std::string>& own_names) {
  if (!head.origin.empty())
    return {kForbidden, "a web page's requests are not for the camera: send no Origin\n"};
  if (!head.host.empty() && !isOwn(nameIn(head.host), own_names)) {
    return {kForbidden,
            "this camera is not called so: ask it by its address in digits, or by the name in its "
            "configuration\n"};
  }
  if (!isXml(head.content_type)) return {kUnsupportedMedia, "XML-RPC comes with Content-Type: text/xml\n"};
  return {};
}

}  // namespace toftwin::daemon::ifm
