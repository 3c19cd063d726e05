// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/tracer/trace.h"

#include <toftwin/result.h>

namespace toftwin::cli {

/// The same light as `sim::trace` gives, traced in bands of rows so that progress can be shown and
/// Ctrl-C heard (Error Stopped).
Result<sim::Light> traceInBands(const sim::Scene& scene, const sim::TraceRequest& request);

}  // namespace toftwin::cli
