// SPDX-License-Identifier: Apache-2.0
// Events that come in bursts: lines that have one fault with their neighbours, frames that are lost together.
#include <utility>

#include "planted.h"

namespace toftwin::compare {
namespace {

/// Of an edge of 480 lines, 8 of which each have the same: a pixel that flies in 35 %, and where it hangs.
Planted linesInRuns() {
  return {"flying pixels of lines in runs of 8",
          {{"flying", 0.35}, {"offset", 0.4}, {"near side", 0.75}},
          [](Noise& noise) {
            constexpr int kLines = 480, kRun = 8, kWidth = 24, kEdge = 12;
            Image<float> range(kWidth, kLines);
            bool flies = false;
            double share = 0.0;
            for (int y = 0; y < kLines; ++y) {
              if (y % kRun == 0) flies = noise.chance(0.35), share = noise.uniform(0.2, 0.6);
              for (int x = 0; x < kWidth; ++x) {
                const double at = x < kEdge ? 1.0 : x == kEdge && flies ? 1.0 + share : 2.0;
                range(x, y) = static_cast<float>(at + noise(0.002));
              }
            }
            return flyingTraits(range);
          }};
}

/// 3 % of 2000 frames are lost, four in a burst on the mean.
Planted framesInBursts() {
  return {"frame timing, bursts of four lost frames",
          {{"interval", 33.3}, {"jitter", 0.4}, {"lost", 0.03}},
          [](Noise& noise) {
            constexpr double kBurst = 4.0, kLost = 0.03, kBegins = kLost / (1.0 - kLost) / kBurst;
            Columns starts{0.0};
            double now = 0.0;
            bool is_lost = false;
            for (int i = 0; i < 2000; ++i) {
              now += 0.0333 + noise(0.0004);
              is_lost = is_lost ? !noise.chance(1.0 / kBurst) : noise.chance(kBegins);
              if (!is_lost) starts.push_back(now);
            }
            return timingTraits(starts);
          }};
}

/// As a link that is bad for ten frames on the mean, and loses half of them: 3 % of 6000.
Planted framesOfABadLink() {
  return {"frame timing, bursts that let half through", {{"lost", 0.03}}, [](Noise& noise) {
            constexpr double kBad = 10.0, kShare = 0.06, kBegins = kShare / (1.0 - kShare) / kBad;
            Columns starts{0.0};
            double now = 0.0;
            bool is_bad = false;
            for (int i = 0; i < 6000; ++i) {
              now += 0.0333 + noise(0.0004);
              is_bad = is_bad ? !noise.chance(1.0 / kBad) : noise.chance(kBegins);
              if (!is_bad || noise.chance(0.5)) starts.push_back(now);
            }
            return timingTraits(starts);
          }};
}

}  // namespace

std::vector<Planted> plantedBursts() { return {linesInRuns(), framesInBursts(), framesOfABadLink()}; }

}  // namespace toftwin::compare
