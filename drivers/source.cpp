// SPDX-License-Identifier: Apache-2.0
#include "drivers/source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace toftwin::drivers {
namespace {

Error unsupported(const SourceInfo& info, std::string_view what) {
  return {Error::Code::Unsupported,
          fmt::format("{} ({} driver) cannot {}", info.model, info.driver, what)};
}

}  // namespace

Result<> checkPose(const Transform<World, Camera>& world_from_camera) {
  const auto& q = world_from_camera.rotation_wxyz;
  const Vec3d& t = world_from_camera.translation_m;
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (std::abs(length - 1.0) < 1e-6 && std::isfinite(t.x + t.y + t.z)) return {};
  return Error{Error::Code::InvalidArgument,
               fmt::format("a pose needs a unit quaternion and finite metres, but was ({}, {}, {}, {}) at ({}, {}, {})", q[0],
                           q[1], q[2], q[3], t.x, t.y, t.z)};
}

Error answerAtOpening(Error error) {
  if (error.code == Error::Code::InvalidArgument) error.code = Error::Code::Incompatible;
  return error;
}

SourceState Source::state() const {
  SourceState state;
  for (const std::string& name : info().parameters) state.parameters.push_back({.name = name});
  return state;
}

Result<> Source::setPose(const Transform<World, Camera>&) {
  return unsupported(info(), "be given a pose: its pose is where it stands, or recorded");
}

Result<> Source::setParameter(std::string_view name, double) {
  return unsupported(info(), fmt::format("set a parameter \"{}\": it has none", name));
}

Result<> Source::setParameterText(std::string_view name, std::string_view text) {
  if (std::ranges::find(info().parameters, name) == info().parameters.end())
    return unsupported(info(), fmt::format("set a parameter \"{}\": it has none of that name", name));
  return Error{Error::Code::InvalidArgument,
               fmt::format("{} = {} cannot be set: it must be a number", name, text)};
}

Result<> Source::trigger() {
  return unsupported(info(), "be triggered: it takes frames by itself");
}

}  // namespace toftwin::drivers
