// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "calib/intrinsics/collector.h"
#include "tools/cli/options.h"

namespace toftwin::cli {

struct LiveOptions {
  std::string source;
  int most_views = 60;
  bool until_enough = true;
};

/// Called with each image whose view was kept.
using OnView = std::function<void(const intrinsics::NamedImage&)>;

/// Takes views of a camera until they are enough, or Ctrl-C. What is still missing is written to standard
/// error whenever that changes.
Result<> collectLive(const DaemonOptions& daemon, const LiveOptions& live, intrinsics::Collector& collector,
                     const OnView& on_view);

}  // namespace toftwin::cli
