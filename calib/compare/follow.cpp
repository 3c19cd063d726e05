// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/follow.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace toftwin::compare {

bool takes(const Feed& feed, std::string_view parameter) {
  const auto& all = feed.details().parameters;
  return std::ranges::find(all, parameter, &Parameter::name) != all.end();
}

std::optional<Duration> longestExposure(const Frame& frame) {
  std::optional<Duration> longest;
  for (const Exposure& one : frame.moment.exposures) {
    if (one.duration > Duration{} && (!longest || one.duration > *longest)) longest = one.duration;
  }
  return longest;
}

std::vector<MomentSetting> settingsOf(const Frame& frame, const Carrier* carrier) {
  const Moment& moment = frame.moment;
  std::vector<MomentSetting> all;
  if (moment.since_power_on) all.push_back({kSincePowerOn, moment.since_power_on->in(second)});
  if (moment.ambient) all.push_back({kAmbient, moment.ambient->in(kilolux)});
  auto temperatures = moment.temperatures;
  if (carrier != nullptr) std::ranges::copy(carrier->temperatures(), std::back_inserter(temperatures));
  const auto room = std::ranges::find(temperatures, "room", &NamedTemperature::where);
  if (room != temperatures.end()) all.push_back({kRoom, room->value.in(celsius)});
  if (const auto exposure = longestExposure(frame)) all.push_back({kExposure, exposure->in(microsecond)});
  return all;
}

std::string momentWarning(const Frame& a, const Frame& b) {
  struct Tolerance {
    std::string_view parameter;
    double absolute, relative;
    const char* words;
  };
  constexpr std::array kTolerances{Tolerance{kExposure, 0.0, 0.02, "exposure of {:.5g} and {:.5g} µs"},
                                   Tolerance{kAmbient, 0.1, 0.1, "ambient light of {:.3g} and {:.3g} klx"},
                                   Tolerance{kRoom, 2.0, 0.0, "a room of {:.3g} and {:.3g} °C"},
                                   Tolerance{kSincePowerOn, 60.0, 0.1, "{:.0f} and {:.0f} s since power-on"}};
  const auto of_a = settingsOf(a, nullptr), of_b = settingsOf(b, nullptr);
  std::vector<std::string> differ;
  for (const Tolerance& one : kTolerances) {
    const auto isIt = [&](const MomentSetting& setting) { return setting.parameter == one.parameter; };
    const auto first = std::ranges::find_if(of_a, isIt), second = std::ranges::find_if(of_b, isIt);
    if (first == of_a.end() || second == of_b.end()) continue;
    const double apart = std::abs(second->value - first->value),
                 larger = std::max(std::abs(first->value), std::abs(second->value));
    if (apart > std::max(one.absolute, one.relative * larger))
      differ.push_back(fmt::format(fmt::runtime(one.words), first->value, second->value));
  }
  if (differ.empty()) return {};
  return fmt::format("A and B did not measure alike: {}. What this changes is in B − A and in the noise.",
                     fmt::join(differ, ", "));
}

Feed* twinOf(Feed& a, Feed& b) {
  const auto isSimulated = [](const Feed& feed) { return feed.details().entry.kind == FrameKind::Simulated; };
  if (isSimulated(a) == isSimulated(b)) return nullptr;
  return isSimulated(a) ? &a : &b;
}

std::vector<std::string> Follower::follow(const Frame& leader, const Carrier* carrier) {
  std::vector<std::string> notes;
  const std::string& name = twin_->details().entry.name;
  for (const auto& [parameter, value] : settingsOf(leader, carrier)) {
    if (!takes(*twin_, parameter)) continue;
    if (auto done = twin_->setParameter(parameter, value); !done)
      notes.push_back(fmt::format("{} did not follow {}: {}", name, leader.source, done.error().message));
    else
      set_[parameter] = value;
  }
  if (!leader.moment.since_power_on && takes(*twin_, kSincePowerOn))
    notes.push_back(fmt::format("{} does not say how long it has been on, so {} is as warm as it was.",
                                leader.source, name));
  return notes;
}

std::vector<std::string> Follower::putBack() {
  std::vector<std::string> problems;
  for (const auto& [name, value] : set_) {
    const auto& parameters = twin_->details().parameters;
    const auto before = std::ranges::find(parameters, name, &Parameter::name);
    if (before == parameters.end() || !before->value || *before->value == value) continue;
    if (auto done = twin_->setParameter(name, *before->value); !done)
      problems.push_back(fmt::format("{} was left with {} = {:.6g}: it could not be set back: {}.",
                                     twin_->details().entry.name, name, value, done.error().message));
  }
  set_.clear();
  return problems;
}

}  // namespace toftwin::compare
