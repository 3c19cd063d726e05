// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/rig_carrier.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "drivers/rig/rig.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace {

using compare::Json;

class RigCarrier final : public compare::Carrier {
 public:
  explicit RigCarrier(std::unique_ptr<rig::Rig> mover) : mover_(std::move(mover)) {}

  Result<Transform<World, Camera>> go(const compare::PoseSpec& pose) override {
    auto reached = mover_->moveTo(pose.world_from_camera(), interrupted);
    if (!reached) return reached.error();
    reached_ = *std::move(reached);
    return mover_->poseAt(reached_.positions);
  }

  Result<> stillThere() override {
    const auto now = mover_->state();
    if (!now) return now.error();
    const auto& axes = mover_->file().axes;
    for (std::size_t i = 0; i < axes.size(); ++i) {
      const double moved = std::abs(now->positions[i] - reached_.positions[i]);
      // It was within its tolerance of the target then, and may be on the other side of it now.
      if (moved <= 2.0 * axes[i].tolerance) continue;
      return Error{
          Error::Code::Internal,
          fmt::format("the rig moved while its pose was captured: {} from {:.3f} to {:.3f}",
                      axes[i].name, reached_.positions[i], now->positions[i])};
    }
    if (now->is_emergency || now->has_fault) {
      return Error{
          Error::Code::Internal,
          "the rig stopped being well while its pose was captured: emergency stop or fault"};
    }
    return {};
  }

  [[nodiscard]] Json log() const override {
    Json axes = Json::object(), temperatures = Json::object(), entry = Json::object();
    for (std::size_t i = 0; i < reached_.positions.size(); ++i) {
      axes.set(mover_->file().axes[i].name, reached_.positions[i]);
    }
    for (const auto& one : reached_.temperatures)
      temperatures.set(one.where, one.value.in(celsius));
    entry.set("axes", std::move(axes)).set("temperatures_c", std::move(temperatures));
    return entry;
  }
  [[nodiscard]] std::vector<NamedTemperature> temperatures() const override { return reached_.temperatures; }

 private:
  std::unique_ptr<rig::Rig> mover_;
  rig::RigState reached_;
};

}  // namespace

Result<std::unique_ptr<compare::Carrier>> openCarrier(const std::filesystem::path& rig_file) {
  auto file = rig::loadRig(rig_file);
  if (!file) return file.error();
  auto mover = rig::Rig::open(*std::move(file));
  if (!mover) return mover.error();
  return std::unique_ptr<compare::Carrier>{std::make_unique<RigCarrier>(*std::move(mover))};
}

}  // namespace toftwin::cli
