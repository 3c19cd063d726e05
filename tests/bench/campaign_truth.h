// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "calib/discover/campaign/answer/discover_campaign.h"
#include "calib/discover/campaign/captures/campaign.h"

/// What only one knows who hid the effect: a benchmark simulates the same captures free of noise, with the
/// truth and with what was found.
namespace toftwin::discover::bench {

/// Captures of a simulated run and their light.
class KnownCaptures {
 public:
  /// The open captures, or (opened before) the locked ones. Ends the program where they cannot be read.
  static KnownCaptures open(const std::filesystem::path& run, const Declared& declared,
                            const TraceOptions& trace);
  static KnownCaptures locked(const std::filesystem::path& run, const Declared& declared,
                              const TraceOptions& trace);

  /// χ² of what one list of effects says against another, free of noise, whitened by the captures' noise;
  /// poses, light, offset and gain integrated out. For the truth against the declared model it is λ.
  [[nodiscard]] double between(const std::vector<sim::AnyEffect>& a,
                               const std::vector<sim::AnyEffect>& b) const;

 private:
  KnownCaptures(const Declared& declared, std::vector<MeasuredCapture> captures, const TraceOptions& trace);
  const Declared& declared_;
  std::vector<MeasuredCapture> captures_;
  std::vector<std::shared_ptr<const TracedCapture>> traced_;
};

/// How much of the hidden effect a search removed in the locked captures, which it has judged.
struct Removed {
  double explainable =
      0.0;             ///< χ² of the truth against the camera file with the light's delay that was found
  double share = 0.0;  ///< 1 − χ² against what was found / explainable; NaN where nothing shows
};
Removed removedFrom(const KnownCaptures& locked, const Declared& declared, const sim::SensorModel& truth,
                    const CampaignFinding& finding);

}  // namespace toftwin::discover::bench
