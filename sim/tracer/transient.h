// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <functional>
#include <vector>

#include <toftwin/image.h>
#include <toftwin/units.h>

namespace toftwin::sim {

class Scene;
struct TraceRequest;
struct DirectLight;
struct LaneSums;

/// Intervals of path length, from emitter over all surfaces to the pinhole: [first + i width, first + (i+1)
/// width).
struct TransientBins {
  Length first{};
  Length width{};
  int count = 0;
};

/// Light by the time of its arrival: what each pixel sees after a single, infinitely short pulse of 1 J of
/// each emitter's watts. Any waveform can be applied afterwards; phasors are one of them.
struct Transient {
  TransientBins bins;
  std::vector<Image<float>> radiance;  ///< mean over the pixel's samples, W/(m² sr), one image for each bin
  Image<float> outside;                ///< radiance of light that came before the first bin or after the last

  /// Σ w exp(−i 2π f L/c) with all light of a bin in its middle: a phase error of π f width/c at most.
  [[nodiscard]] std::complex<double> phasor(Frequency f, int x, int y) const;
};

/// The paths of trace() with the same request, sorted by their lengths. `tell` is called with the number of
/// rows that are done, again and again; where it returns false, tracing ends, and what is not traced yet
/// stays zero.
Transient traceTransient(const Scene& scene, const TraceRequest& request, const TransientBins& bins,
                         const std::function<bool(int)>& tell = {});

/// Adds light to LaneSums::bins, the last of which takes what is outside.
void addToBins(const TransientBins& bins, const DirectLight& light, LaneSums& sums);

}  // namespace toftwin::sim
