// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/result.h>

#include "daemon/facades/o3d303/device.h"
#include "drivers/source.h"

namespace toftwin::daemon::o3d303 {

/// One may be possible only after another, as a longer exposure after a slower frame rate; so what is refused
/// is tried again as long as something else could be done. If something stays refused, all is as before.
Result<> setAll(drivers::Source& source, SourceChanges changes);

/// What a client is told of a source's refusal.
toftwin::o3d303::XmlRpcFault faultOf(const Error& error);

}  // namespace toftwin::daemon::o3d303
