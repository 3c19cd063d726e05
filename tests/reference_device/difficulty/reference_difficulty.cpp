// SPDX-License-Identifier: Apache-2.0
// Tells by what the strengths of sealed specifications are to be multiplied for λ = 150, 600 and 3000, as
// CSV.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <exception>
#include <stdexcept>

#include "calib/plan/captures.h"
#include "tests/reference_device/difficulty/difficulty.h"

namespace {

using namespace toftwin;

template <class T>
T valueOf(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return *std::move(result);
}

std::string sceneOf(const std::string& block, const std::filesystem::path& scenes) {
  return std::filesystem::exists(scenes / (block + ".toml")) ? block : "wall";
}

/// Captures as `toftwin measure` takes them; where no light comes back (dark) there is nothing to see in
/// amplitude or range.
reference::Difficulty difficultyOf(const std::filesystem::path& camera,
                                   const std::filesystem::path& plan_file,
                                   const std::filesystem::path& scenes) {
  const auto sheet = valueOf(reference::readDatasheet(camera));
  const auto plan = valueOf(plan::loadPlan(plan_file));
  const auto schedule = valueOf(plan::scheduleOf(plan));
  std::map<std::string, reference::Room> rooms;
  std::vector<reference::Setting> settings;
  for (const plan::PlannedCapture& capture : schedule.captures) {
    if (!capture.pose || capture.is_locked) continue;
    const auto again = capture.again.value_or(capture.number);
    const std::string& block = plan.blocks[schedule.captures[again].block].name;
    reference::Setting setting{.scene = sceneOf(block, scenes)};
    setting.first_frame = capture.number * static_cast<std::size_t>(capture.frames);
    setting.state = {.world_from_camera = capture.pose->world_from_camera(),
                     .since_power_on_s = capture.start.in(second),
                     .exposure_scale = capture.exposure / sheet.modulations.front().exposure,
                     .ambient_klx = capture.ambient.in(kilolux)};
    if (!rooms.contains(setting.scene))
      rooms[setting.scene] = valueOf(reference::readRoom(scenes / (setting.scene + ".toml")));
    settings.push_back(std::move(setting));
  }
  return {std::move(rooms), sheet, std::move(settings), plan.frames};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    fmt::print(stderr, "usage: reference_difficulty CAMERA PLAN SCENES SEALED...\n");
    return 2;
  }
  try {
    const auto difficulty = difficultyOf(argv[1], argv[2], argv[3]);
    fmt::print("case,lambda_150,lambda_600,lambda_3000\n");
    for (int i = 4; i < argc; ++i) {
      // λ grows with the square of the strengths: within 1 % between these three for the effects that were tried.
      const double scale = difficulty.scaleFor(argv[i], 600.0);
      fmt::print("{},{:.4g},{:.4g},{:.4g}\n", std::filesystem::path{argv[i]}.stem().string(), 0.5 * scale, scale,
                 std::sqrt(5.0) * scale);
      std::fflush(stdout);
    }
    return 0;
  } catch (const std::exception& e) {
    fmt::print(stderr, "reference_difficulty: {}\n", e.what());
    return 1;
  }
}
