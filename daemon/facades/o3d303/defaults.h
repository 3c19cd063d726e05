// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

#include "daemon/facades/o3d303/device.h"

/// The camera's parameters as a real one's configuration lists them, with its values.
namespace toftwin::daemon::o3d303 {

Parameters defaultDevice();
Parameters defaultNetwork();
Parameters defaultTime();
Parameters defaultApplication();
Parameters defaultImager();

/// A parameter of the imager and the source's that it stands for.
struct Binding {
  std::string_view name, source_name;
  bool is_integral;
};
std::span<const Binding> imagerBindings();
/// Of the application's TriggerMode: 1 free run is 0, 2 by command is 1.
inline constexpr std::string_view kTriggered = "triggered";

}  // namespace toftwin::daemon::o3d303
