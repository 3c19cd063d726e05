// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "sim/tracer/transient.h"
#include "tools/cli/campaign/frame_maker.h"
#include "tools/cli/campaign/target.h"
#include "tools/cli/command.h"
#include "tools/cli/options.h"
#include "tools/cli/pose.h"

namespace toftwin::cli {

/// As a [[source]] with driver = "sim", whose defaults these are.
struct RenderOptions {
  OutputOptions output;
  PoseOptions pose;
  std::string scene;
  std::string camera;
  std::string trajectory;
  std::optional<Trajectory> poses{};  ///< instead of that file
  std::uint64_t frames = 0;
  double frame_interval_ms = 0.0;  ///< 0: the camera's own
  std::vector<std::string> format_names;
  std::vector<Format> formats;
  bool overwrite = false;
  bool images = false;
  bool transient = false;  ///< no frame, but light by the length of its way
  sim::TransientBins bins{.first = 0_m, .width = 2_cm, .count = 500};
  RenderSettings settings{.since_power_on_s = drivers::simulator::Keys{}.powered_on_before.in(second),
                          .ambient_klx = drivers::simulator::Keys{}.ambient.in(kilolux),
                          .room_temperature_c = drivers::simulator::Keys{}.room_temperature.in(celsius)};
  /// Gets what a person should know of camera and scene: each with the file that it is of.
  std::function<void(const std::string&)> tell = [](const std::string& text) { fmt::print(stderr, "toftwin: {}\n", text); };
};

Target targetOf(const RenderOptions& options);

/// What makes these frames; errors of camera, scene and trajectory name file and line.
Result<FrameMaker> makerOf(const RenderOptions& options);

/// Renders all frames into the target, and says how many and what.
Result<Exit> renderCampaign(const RenderOptions& options);

}  // namespace toftwin::cli
