// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "daemon/facades/visionary/device.h"

/// A camera whose source can be set as a simulated one.
namespace toftwin::daemon::test {

inline visionary::Device visionaryDevice() {
  visionary::Device device{{.serial = "12345678",
                            .address = "127.0.0.1",
                            .stream_port = 2114,
                            .passwords = {{visionary::UserLevel::AuthorizedClient, "CLIENT"},
                                          {visionary::UserLevel::Service, ""}}}};
  visionary::SourceFacts facts{.frame_interval_us = 33'333.0};
  facts.parameters = {{.name = "exposure_us", .value = 1000.0, .bounds = {10.0, 8000.0}},
                      {.name = "frame_rate_hz", .value = 30.0, .bounds = {0.1, 60.0}}};
  device.update(std::move(facts));
  return device;
}

}  // namespace toftwin::daemon::test
