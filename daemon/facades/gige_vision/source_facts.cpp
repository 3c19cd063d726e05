// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/gige_vision/source_facts.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <string_view>

namespace toftwin::daemon::gige_vision {
namespace {

using std::chrono::steady_clock;

std::optional<SourceNumber> numberOf(const wire::SourceDescription& description,
                                     std::initializer_list<std::string_view> names) {
  for (const Parameter& one : description.parameters) {
    if (std::ranges::count(names, one.name) > 0 && one.value)
      return SourceNumber{*one.value, one.bounds.min, one.bounds.max, one.name};
  }
  return std::nullopt;
}

bool hasPlane(const wire::SourceDescription& description, PlaneKind kind) {
  return std::ranges::count(description.planes, kind) > 0;
}

}  // namespace

std::int64_t stampOf(const Frame& frame, bool on_host_clock) {
  const std::int64_t device_ns = frame.moment.exposures.empty() ? 0 : frame.moment.exposures.front().start.ns;
  return std::max<std::int64_t>(0, device_ns + (on_host_clock ? frame.moment.clock.host_minus_device_ns : 0));
}

void SourceWatch::note(const Frame& frame) {
  Seen seen{.device_ns = stampOf(frame, false),
            .clock = frame.moment.clock,
            .at = steady_clock::now(),
            .temperatures_c = SourceFacts{}.temperatures_c};
  constexpr std::array<std::string_view, 4> kWhere{"illumination", "sensor", "housing", "room"};
  for (const NamedTemperature& one : frame.moment.temperatures) {
    const auto where = std::ranges::find(kWhere, one.where);
    if (where != kWhere.end())
      seen.temperatures_c[static_cast<std::size_t>(where - kWhere.begin())] = one.value.in(celsius);
  }
  for (const Exposure& one : frame.moment.exposures)
    seen.exposure_us = std::max(seen.exposure_us, one.duration.in(microsecond));
  seen_ = seen;
}

SourceFacts SourceWatch::facts(const Result<wire::SourceDescription>& description, bool on_host_clock) const {
  SourceFacts facts;
  if (description) {
    facts.is_there = true;
    facts.model = description->summary.model;
    facts.camera = description->camera;
    facts.has_range = hasPlane(*description, PlaneKind::Range) || hasPlane(*description, PlaneKind::Depth);
    facts.has_intensity = hasPlane(*description, PlaneKind::Amplitude);
    facts.has_confidence = hasPlane(*description, PlaneKind::Flags);
    facts.exposure_us = numberOf(*description, {"exposure_us", "ExposureTime"});
    facts.frame_rate_hz = numberOf(*description, {"frame_rate_hz", "AcquisitionFrameRate"});
    if (!facts.frame_rate_hz && description->frame_interval && *description->frame_interval > 0_s)
      facts.frame_rate_hz = SourceNumber{.value = 1.0 / description->frame_interval->in(second)};
    facts.is_triggered = description->can_trigger;
    facts.can_choose_trigger = numberOf(*description, {"triggered"}).has_value();
  }
  using std::chrono::system_clock, std::chrono::nanoseconds;
  const auto host_ns =
      std::chrono::duration_cast<nanoseconds>(system_clock::now().time_since_epoch()).count();
  if (on_host_clock) facts.now_ns = host_ns;
  if (!seen_) return facts;
  if (!facts.exposure_us) facts.exposure_us = SourceNumber{.value = seen_->exposure_us};
  facts.temperatures_c = seen_->temperatures_c;
  if (seen_->clock.uncertainty_ns >= 0) {
    facts.clock_uncertainty_ns = seen_->clock.uncertainty_ns;
    if (!on_host_clock) facts.now_ns = std::max<std::int64_t>(0, host_ns - seen_->clock.host_minus_device_ns);
  } else {
    // No relation is known: behind by how long the frame took to come.
    const nanoseconds since = steady_clock::now() - seen_->at;
    facts.now_ns = seen_->device_ns + since.count() + (on_host_clock ? seen_->clock.host_minus_device_ns : 0);
  }
  return facts;
}

}  // namespace toftwin::daemon::gige_vision
