// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include <chrono>
#include <cstdint>
#include <optional>

#include "daemon/facades/gige_vision/device.h"
#include "protocol/wire/messages.h"

namespace toftwin::daemon::gige_vision {

/// A frame's time stamp: when its first exposure began, on the source's clock or on the daemon's.
std::int64_t stampOf(const Frame& frame, bool on_host_clock);

/// Keeps what the camera shows of its source: what that says of itself, and what its last frame said.
class SourceWatch {
 public:
  void note(const Frame& frame);
  [[nodiscard]] SourceFacts facts(const Result<wire::SourceDescription>& description,
                                  bool on_host_clock) const;

 private:
  struct Seen {
    std::int64_t device_ns = 0;
    ClockRelation clock;
    std::chrono::steady_clock::time_point at;
    std::array<double, 4> temperatures_c;
    double exposure_us = 0.0;
  };
  std::optional<Seen> seen_;
};

}  // namespace toftwin::daemon::gige_vision
