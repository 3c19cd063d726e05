// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/ptp.h"

#include <chrono>

#include "drivers/logging.h"

namespace toftwin::drivers::aravis {
namespace {

constexpr std::chrono::seconds kUntilItIs{1}, kAfterwards{10};

/// By SFNC's names, and those before it. SFNC's status is that of the last latch.
std::optional<std::string> statusOf(const Features& features) {
  if (features.has("PtpDataSetLatch")) (void)features.setText("PtpDataSetLatch", "");
  auto status = features.text("PtpStatus");
  return status ? status : features.text("GevIEEE1588Status");
}

}  // namespace

void PtpWatch::look(const Features& features, const std::string& camera, SteadyTime now) {
  if (asked_at_ && now - *asked_at_ < (is_synchronised_ ? kAfterwards : kUntilItIs)) return;
  asked_at_ = now;
  const std::string status = statusOf(features).value_or("not told by the camera");
  is_synchronised_ = status == "Slave" || status == "Master";
  if (status == told_) return;
  told_ = status;
  if (is_synchronised_) {
    logging::info("{}: its clock is the network's: PtpStatus is {}", camera, status);
  } else {
    logging::warn(
        "{}: its clock follows no other's: PtpStatus is {}; device time is of its own clock until it does",
        camera, status);
  }
}

}  // namespace toftwin::drivers::aravis
