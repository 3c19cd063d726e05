// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/camera_text.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace toftwin::loop {
namespace {

Result<std::string> textOf(const std::filesystem::path& file) {
  std::ifstream in{file, std::ios::binary};
  std::ostringstream text;
  if (in) text << in.rdbuf();
  if (in) return text.str();
  return Error{Error::Code::NotFound, fmt::format("{}: cannot be read", file.string())};
}

}  // namespace

Result<CameraText> loadCamera(const std::string& model) {
  constexpr std::string_view kPreset = "preset:";  // as `toftwin info` has it
  const auto names = sim::SensorModel::presetNames();
  const std::string name = model.starts_with(kPreset) ? model.substr(kPreset.size()) : model;
  const bool is_preset = std::ranges::find(names, name) != names.end();
  auto text = is_preset ? sim::SensorModel::presetText(name) : textOf(model);
  if (!text) {
    return Error{text.error().code, fmt::format("{}; --model takes a camera file or one of the presets {}",
                                                text.error().message, fmt::join(names, ", "))};
  }
  auto parsed = sim::SensorModel::parse(*text, is_preset ? name + ".toml" : model);
  if (!parsed) return parsed.error();
  return CameraText{*std::move(parsed), *std::move(text)};
}

}  // namespace toftwin::loop
