// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3d303/bindings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace toftwin::daemon::o3d303 {
namespace {

constexpr std::array<std::string_view, 3> kRanges{"under5m", "upto30m", "morethan30m"},
    kContrasts{"low", "moderate", "high"};

std::optional<int> placeIn(std::span<const std::string_view> words, std::string_view word) {
  const auto found = std::ranges::find(words, word);
  if (found == words.end()) return std::nullopt;
  return static_cast<int>(found - words.begin()) + 1;
}

}  // namespace

std::span<const Binding> bindings() {
  using enum Binding::Object;
  using Form = Binding::Form;
  // Where a source has several of them, the first counts.
  static constexpr std::array kBindings{
      Binding{Imager, "ExposureTime", "exposure_us"},
      Binding{Imager, "ExposureTimeRatio", "exposure_ratio"},
      Binding{Imager, "FrameRate", "frame_rate_hz", Form::Real},
      Binding{Imager, "MinimumAmplitude", "minimum_amplitude"},
      Binding{Imager, "MinimumAmplitude", "minimum_amplitude_electrons", Form::Whole, 0.0, true},
      Binding{Imager, "Channel", "channel"},
      Binding{Imager, "SymmetryThreshold", "asymmetry_threshold", Form::Real},
      Binding{Imager, "SpatialFilterType", "spatial_filter"},
      Binding{Imager, "TemporalFilterType", "temporal_filter"},
      Binding{Imager, "EnableFilterDistanceImage", "filters_range", Form::Switch},
      Binding{Imager, "EnableFilterAmplitudeImage", "filters_amplitude", Form::Switch},
      Binding{SpatialFilter, "MaskSize", "spatial_filter_reach", Form::Whole, 1.0},
      Binding{TemporalFilter, "NumberOfImages", "temporal_filter_images"},
  };
  return kBindings;
}

std::string Bound::text(double source) const {
  const double camera = fromSource(source);
  switch (binding->form) {
    case Binding::Form::Switch:
      return camera == 0.0 ? "false" : "true";
    case Binding::Form::Whole:
      return fmt::format("{:.0f}", camera);
    case Binding::Form::Real:
      break;
  }
  return fmt::format("{:g}", camera);
}

Bounds Bound::bounds() const {
  return {fromSource(parameter->bounds.min), fromSource(parameter->bounds.max)};
}

std::string ImagerType::text() const {
  const auto clamped = [](int count) { return static_cast<std::size_t>(std::clamp(count, 1, 3)) - 1; };
  return fmt::format("{}_{}", kRanges[clamped(frequencies)], kContrasts[clamped(exposures)]);
}

std::optional<ImagerType> ImagerType::of(std::string_view text) {
  const std::size_t cut = text.find('_');
  if (cut == std::string_view::npos) return std::nullopt;
  const auto frequencies = placeIn(kRanges, text.substr(0, cut));
  const auto exposures = placeIn(kContrasts, text.substr(cut + 1));
  if (!frequencies || !exposures) return std::nullopt;
  return ImagerType{*frequencies, *exposures};
}

}  // namespace toftwin::daemon::o3d303
