// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace toftwin::daemon::ifm {

/// What a request says of where it comes from and what it brings.
struct RequestHead {
  std::string_view host, origin, content_type;
};

/// HTTP status with which a request is refused that a web page may have made a browser send, and why; 0: it
/// is welcome. A page of another site says its Origin; a name that was made to lead here stands in Host; and
/// what a browser sends without asking first is no text/xml. `own_names`: by which the camera is called,
/// beside addresses in digits and localhost.
struct Refused {
  int status = 0;
  std::string why{};
};
Refused refusalOf(const RequestHead& head, const std::vector<std::string>& own_names);

}  // namespace toftwin::daemon::ifm
