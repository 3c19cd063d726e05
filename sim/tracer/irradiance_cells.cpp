// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/irradiance_cells.h"

#include <algorithm>
#include <cmath>

#include "sim/images/mix_bits.h"

namespace toftwin::sim {
namespace {

constexpr std::size_t kSlots = std::size_t{1} << 16;
/// So full, the table starts anew: moving things leave cells behind.
constexpr std::size_t kMostUsed = kSlots * 3 / 4;

}  // namespace

IrradianceCells::IrradianceCells(double cell_size_m, std::size_t channels)
    : per_cell_size_(1.0 / cell_size_m),
      channels_(channels),
      keys_(kSlots),
      counts_(kSlots),
      means_(kSlots * channels) {}

void IrradianceCells::prepare(Key key) const {
  const std::size_t slot = mixBits(key) % kSlots;
  __builtin_prefetch(&keys_[slot]);
  __builtin_prefetch(&counts_[slot]);
  const float* means = &means_[slot * channels_];
  __builtin_prefetch(means);
  __builtin_prefetch(means + channels_ - 1);
}

IrradianceCells::Key IrradianceCells::keyOf(Vec3d place, Vec3d normal) const {
  const double x = std::abs(normal.x), y = std::abs(normal.y), z = std::abs(normal.z);
  std::uint64_t face = normal.z < 0.0 ? 5 : 4;
  if (x >= y && x >= z) {
    face = normal.x < 0.0 ? 1 : 0;
  } else if (y >= z) {
    face = normal.y < 0.0 ? 3 : 2;
  }
  const auto index = [&](double v) {
    constexpr double kHalf = 1 << 19;
    return static_cast<std::uint64_t>(std::clamp(std::floor(v * per_cell_size_) + kHalf, 0.0, 2.0 * kHalf - 1.0));
  };
  return ((index(place.x) << 40 | index(place.y) << 20 | index(place.z)) << 3 | face) + 1;
}

std::size_t IrradianceCells::slotOf(Key key) const {
  std::size_t slot = mixBits(key) % kSlots;
  while (keys_[slot] != 0 && keys_[slot] != key) slot = (slot + 1) % kSlots;
  return slot;
}

IrradianceCells::Known IrradianceCells::find(Key key) const {
  const std::size_t slot = slotOf(key);
  if (keys_[slot] != key || counts_[slot] < kEnough) return {};
  return {{&means_[slot * channels_], channels_}, counts_[slot]};
}

void IrradianceCells::add(Key key, std::span<const float> sample, int memory) {
  if (used_ >= kMostUsed) {
    std::fill(keys_.begin(), keys_.end(), 0);
    std::fill(counts_.begin(), counts_.end(), 0);
    used_ = 0;
  }
  const std::size_t slot = slotOf(key);
  if (keys_[slot] == 0) {
    keys_[slot] = key;
    ++used_;
  }
  counts_[slot] = std::min(counts_[slot] + 1, memory);
  const float share = 2.0f / static_cast<float>(counts_[slot] + 1);
  float* means = &means_[slot * channels_];
  // The first sample's share is 1: what the slot held before does not count.
  for (std::size_t c = 0; c < channels_; ++c) means[c] += (sample[c] - means[c]) * share;
}

}  // namespace toftwin::sim
