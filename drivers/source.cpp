// SPDX-License-Identifier: Apache-2.0
#include "drivers/source.h"

#include <fmt/format.h>

#include <algorithm>

namespace toftwin::drivers {
namespace {

Error unsupported(const SourceInfo& info, std::string_view what) {
  return {Error::Code::Unsupported,
          fmt::format("{} ({} driver) cannot {}", info.model, info.driver, what)};
}

}  // namespace

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
