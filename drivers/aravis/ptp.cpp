// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/ptp.h"

#include <chrono>
#include <optional>
#include <utility>

#include "drivers/logging.h"

namespace toftwin::drivers::aravis {
namespace {

constexpr std::chrono::seconds kUntilItIs{1}, kAfterwards{10};

struct Status {
  std::string feature, value;
};

/// By SFNC's name, or that before it. SFNC's status is that of the last latch.
std::optional<Status> statusOf(const Features& features) {
  if (features.has("PtpDataSetLatch")) (void)features.setText("PtpDataSetLatch", "");
  for (const char* name : {"PtpStatus", "GevIEEE1588Status"}) {
    if (auto value = features.text(name)) return Status{name, *std::move(value)};
  }
  return std::nullopt;
}

}  // namespace

void PtpWatch::look(const Features& features, const std::string& camera, SteadyTime now) {
  if (asked_at_ && now - *asked_at_ < pause_) return;
  asked_at_ = now;
  const auto status = statusOf(features);
  const bool follows = status && status->value == "Slave";
  pause_ = status && !follows ? kUntilItIs : kAfterwards;
  if (!status) {
    if (!was_silent_) logging::warn("{}: does not tell whether its clock follows the network's", camera);
    was_silent_ = true;
    return;
  }
  if (status->value == told_) return;
  told_ = status->value;
  if (follows) {
    logging::info("{}: its clock is the network's: {} is {}", camera, status->feature, status->value);
  } else if (status->value == "Master") {
    logging::warn(
        "{}: its clock follows no other's, for it is itself the master: {} is {}; device time is of its own",
        camera, status->feature, status->value);
  } else {
    logging::warn("{}: its clock follows no other's: {} is {}; device time is of its own clock until it does",
                  camera, status->feature, status->value);
  }
}

}  // namespace toftwin::drivers::aravis
