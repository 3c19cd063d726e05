// SPDX-License-Identifier: Apache-2.0
#include <toftwin/names.h>

#include <array>
#include <utility>

namespace toftwin {
namespace {

constexpr std::array kPlaneNames{
    std::pair{PlaneKind::Range, "range"},
    std::pair{PlaneKind::Depth, "depth"},
    std::pair{PlaneKind::Amplitude, "amplitude"},
    std::pair{PlaneKind::Ambient, "ambient"},
    std::pair{PlaneKind::Flags, "flags"},
    std::pair{PlaneKind::Samples, "samples"},
    std::pair{PlaneKind::Phasors, "phasors"},
    std::pair{PlaneKind::TruthRange, "truth_range"},
    std::pair{PlaneKind::TruthNormal, "truth_normal"},
    std::pair{PlaneKind::Exposure, "exposure"},
    std::pair{PlaneKind::Color, "color"},
    std::pair{PlaneKind::LightSigma, "light_sigma"},
};

constexpr std::array kFrameNames{
    std::pair{FrameKind::Real, "real"},
    std::pair{FrameKind::Simulated, "simulated"},
    std::pair{FrameKind::Replayed, "replayed"},
    std::pair{FrameKind::Faulted, "faulted"},
};

constexpr std::array kFlagNames{
    std::pair{PixelFlag::Invalid, "invalid"},
    std::pair{PixelFlag::Saturated, "saturated"},
    std::pair{PixelFlag::Asymmetric, "asymmetric"},
    std::pair{PixelFlag::LowAmplitude, "low_amplitude"},
    std::pair{PixelFlag::UnwrapUnreliable, "unwrap_unreliable"},
    std::pair{PixelFlag::Mixed, "mixed"},
    std::pair{PixelFlag::OutOfRange, "out_of_range"},
    std::pair{PixelFlag::Interpolated, "interpolated"},
};

template <class Names, class Value>
std::string_view find(const Names& names, Value value) {
  for (const auto& [known, name] : names) {
    if (known == value) return name;
  }
  return "unknown";
}

/// Words of other cameras and of their programs.
constexpr std::pair<std::string_view, std::string_view> kOtherWords[]{
    {"confidence", "flags, and where a frame takes several exposures, exposure"},
    {"infrared", "amplitude"},
    {"ir", "amplitude"},
    {"intensity", "amplitude"},
    {"distance", "range"},
    {"raw", "samples"},
    {"phase", "phasors"},
    {"normal", "truth_normal"},
    {"rgb", "color"},
    {"colour", "color"},
};

}  // namespace

std::string_view nameOf(PlaneKind kind) { return find(kPlaneNames, kind); }
std::string_view nameOf(FrameKind kind) { return find(kFrameNames, kind); }
std::string_view nameOf(PixelFlag flag) { return find(kFlagNames, flag); }

std::optional<PlaneKind> planeKindNamed(std::string_view name) {
  for (const auto& [kind, known] : kPlaneNames) {
    if (name == known) return kind;
  }
  return std::nullopt;
}

std::string otherWordFor(std::string_view plane) {
  for (const auto& [word, ours] : kOtherWords) {
    if (plane == word) return "; for what others call \"" + std::string{word} + "\" see " + std::string{ours};
  }
  return {};
}

}  // namespace toftwin
