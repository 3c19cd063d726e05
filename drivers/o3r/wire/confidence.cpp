// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3r/wire/confidence.h"

#include <array>
#include <utility>

#include <toftwin/frame.h>

namespace toftwin::o3r {
namespace {

constexpr std::array<std::pair<Confidence, PixelFlag>, 7> kConfidencePairs{{
    {Confidence::Invalid, PixelFlag::Invalid},
    {Confidence::Saturated, PixelFlag::Saturated},
    {Confidence::Asymmetric, PixelFlag::Asymmetric},
    {Confidence::LowAmplitude, PixelFlag::LowAmplitude},
    {Confidence::OutOfRange, PixelFlag::OutOfRange},
    {Confidence::Edge, PixelFlag::Mixed},
    {Confidence::Implausible, PixelFlag::UnwrapUnreliable},
}};

}  // namespace

std::uint8_t flagsOf(std::uint16_t confidence) {
  unsigned flags = 0;
  for (const auto& [theirs, ours] : kConfidencePairs) {
    if ((confidence & static_cast<unsigned>(theirs)) != 0) flags |= static_cast<unsigned>(ours);
  }
  return static_cast<std::uint8_t>(flags);
}

std::uint16_t confidenceOf(std::uint8_t flags) {
  unsigned confidence = 0;
  for (const auto& [theirs, ours] : kConfidencePairs) {
    if ((flags & static_cast<unsigned>(ours)) != 0) confidence |= static_cast<unsigned>(theirs);
  }
  return static_cast<std::uint16_t>(confidence);
}

}  // namespace toftwin::o3r
