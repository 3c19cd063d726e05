// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/render_bands.h"

#include <utility>

#include "sim/tracer/trace_bands.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
Result<sim::Light> traceInBands(const sim::Scene& scene, const sim::TraceRequest& request) {
  Progress progress{"rows", static_cast<std::uint64_t>(request.camera.height)};
  auto light = sim::traceInBands(scene, request, [&](int first_row) {
    if (interrupted()) return false;
    progress.show(static_cast<std::uint64_t>(first_row));
    return true;
  });
  if (!light) return Error{Error::Code::Stopped, "interrupted; nothing was written"};
  return *std::move(light);
}

}  // namespace toftwin::cli
