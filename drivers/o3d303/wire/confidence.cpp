// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/wire/confidence.h"

#include <algorithm>
#include <array>
#include <utility>

#include <toftwin/frame.h>

namespace toftwin::o3d303 {
namespace {

constexpr std::array<std::pair<Confidence, PixelFlag>, 6> kPairs{{
    {Confidence::Invalid, PixelFlag::Invalid},
    {Confidence::Saturated, PixelFlag::Saturated},
    {Confidence::Asymmetric, PixelFlag::Asymmetric},
    {Confidence::LowAmplitude, PixelFlag::LowAmplitude},
    {Confidence::Clipped, PixelFlag::OutOfRange},
    {Confidence::Suspect, PixelFlag::UnwrapUnreliable},
}};

constexpr unsigned kLongestExposure = 3, kExposureShift = 4;

constexpr unsigned bits(auto flag) { return static_cast<unsigned>(flag); }

}  // namespace

std::uint8_t flagsOf(std::uint8_t confidence) {
  unsigned flags = 0;
  for (const auto& [theirs, ours] : kPairs) {
    if ((confidence & bits(theirs)) != 0) flags |= bits(ours);
  }
  return static_cast<std::uint8_t>(flags);
}

std::uint8_t confidenceOf(std::uint8_t flags) {
  unsigned confidence = (flags & bits(PixelFlag::Mixed)) != 0 ? bits(Confidence::Suspect) : 0U;
  for (const auto& [theirs, ours] : kPairs) {
    if ((flags & bits(ours)) != 0) confidence |= bits(theirs);
  }
  return static_cast<std::uint8_t>(confidence);
}

std::uint8_t exposureOf(std::uint8_t confidence) {
  const unsigned number = (confidence & bits(Confidence::Exposure)) >> kExposureShift;
  return static_cast<std::uint8_t>(number == 0 ? 0 : kLongestExposure - number);
}

std::uint8_t confidenceOfExposure(unsigned index) {
  return static_cast<std::uint8_t>((kLongestExposure - std::min(index, kLongestExposure - 1))
                                   << kExposureShift);
}

}  // namespace toftwin::o3d303
