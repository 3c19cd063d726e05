// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor/exposures.h"

#include <cstdint>

#include <toftwin/frame.h>

#include "sim/images/rows.h"

namespace toftwin::sim {
namespace {

/// Whether a shorter exposure is needed. One that was too dark, or contradicted itself, would be so all the more: of close
/// frequencies it would pass for another turn of the phase.
bool isSaturated(const RangeImage& image, std::size_t pixel) {
  return (image.flags[pixel] & static_cast<std::uint8_t>(PixelFlag::Saturated)) != 0;
}

void take(const RangeImage& from, std::size_t pixel, RangeImage& to) {
  to.range_m[pixel] = from.range_m[pixel];
  to.amplitude[pixel] = from.amplitude[pixel];
  to.ambient[pixel] = from.ambient[pixel];
  to.flags[pixel] = from.flags[pixel];
  for (std::size_t f = 0; f < to.phasors.size(); ++f) to.phasors[f][pixel] = from.phasors[f][pixel];
}

}  // namespace

Samples samplesOfExposure(const Samples& all, std::size_t exposure, std::size_t count) {
  const auto part = [&](const auto& items) {
    using Items = std::remove_cvref_t<decltype(items)>;
    const auto size = static_cast<std::ptrdiff_t>(items.size() / count);
    const auto first = items.begin() + static_cast<std::ptrdiff_t>(exposure) * size;
    return Items(first, first + size);
  };
  return {.frequencies = part(all.frequencies),
          .steps = all.steps,
          .taps = all.taps,
          .electrons = part(all.electrons),
          .flags = all.flags};
}

Samples joinExposures(std::span<const Samples> parts) {
  Samples all{.steps = parts.front().steps, .taps = parts.front().taps};
  for (const Samples& part : parts) {
    all.frequencies.insert(all.frequencies.end(), part.frequencies.begin(), part.frequencies.end());
    all.electrons.insert(all.electrons.end(), part.electrons.begin(), part.electrons.end());
    if (all.flags.empty()) all.flags = part.flags;
    for (std::size_t i = 0; i < part.flags.size(); ++i)
      all.flags[i] = static_cast<std::uint8_t>(all.flags[i] | part.flags[i]);
  }
  return all;
}

RangeImage mergeExposures(std::span<const RangeImage> parts) {
  RangeImage merged = parts.front();
  merged.exposure = Image<std::uint8_t>{merged.range_m.width(), merged.range_m.height()};
  const int width = merged.range_m.width();
  forRows(merged.range_m.height(), [&](int first_row, int last_row) {
    const auto first = static_cast<std::size_t>(first_row) * static_cast<std::size_t>(width);
    const auto last = static_cast<std::size_t>(last_row) * static_cast<std::size_t>(width);
    for (std::size_t e = 1; e < parts.size(); ++e) {
      for (std::size_t i = first; i < last; ++i) {
        if (!isSaturated(merged, i)) continue;
        take(parts[e], i, merged);
        merged.exposure[i] = static_cast<std::uint8_t>(e);
      }
    }
  });
  return merged;
}

}  // namespace toftwin::sim
