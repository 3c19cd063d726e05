// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "daemon/facades/o3d303/device.h"

namespace toftwin::daemon::o3d303 {

/// Of a source that has all that the camera's parameters can set, with one exposure time of 1 ms.
inline SourceFacts operableFacts(Bounds frame_rate_hz) {
  SourceFacts facts;
  facts.parameters = {{"exposure_us", 1000.0, {1.0, 20'000.0}},
                      {"frame_rate_hz", 10.0, frame_rate_hz},
                      {"triggered", 0.0, {0.0, 1.0}},
                      {"frequencies", 1.0, {1.0, 3.0}},
                      {"exposures", 1.0, {1.0, 3.0}},
                      {"exposure_ratio", 40.0, {2.0, 50.0}},
                      {"minimum_amplitude_electrons", 252.0, {0.0, 1e9}},
                      {"asymmetry_threshold", 0.4, {0.0, 1e9}},
                      {"spatial_filter", 0.0, {0.0, 3.0}},
                      {"spatial_filter_reach", 1.0, {1.0, 2.0}},
                      {"temporal_filter", 0.0, {0.0, 2.0}},
                      {"temporal_filter_images", 2.0, {2.0, 25.0}},
                      {"filters_range", 1.0, {0.0, 1.0}},
                      {"filters_amplitude", 1.0, {0.0, 1.0}}};
  facts.frame_rate_hz = 10.0;
  facts.exposures_us = {1000};
  return facts;
}

}  // namespace toftwin::daemon::o3d303
