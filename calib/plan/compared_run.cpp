// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/compared_run.h"

namespace toftwin::plan {

Captures capturesOf(const ComparedRun& run, std::string_view kind) {
  Captures chosen;
  for (const ComparedCapture& one : run.captures) {
    if (one.pixels > 0 && (kind.empty() || one.record.kind == kind)) chosen.push_back(&one);
  }
  return chosen;
}

Captures allCapturesOf(const ComparedRun& run, std::string_view kind) {
  Captures chosen;
  for (const ComparedCapture& one : run.captures) {
    if (one.record.kind == kind) chosen.push_back(&one);
  }
  for (const ComparedCapture& one : run.moving) {
    if (one.record.kind == kind) chosen.push_back(&one);
  }
  return chosen;
}

}  // namespace toftwin::plan
