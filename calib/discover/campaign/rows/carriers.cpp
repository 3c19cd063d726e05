// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/rows/carriers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "calib/discover/campaign/captures/catalogue.h"
#include "calib/discover/campaign/rows/phasor_change.h"
#include "calib/discover/campaign/rows/pose_errors.h"
#include "calib/discover/campaign/rows/smeared_ranges.h"
#include "calib/discover/campaign/rows/spilled_light.h"
#include "calib/discover/campaign/rows/unequal_exposures.h"
#include "calib/discover/candidates.h"
#include "sim/effects/effects.h"
#include "sim/images/box_mean.h"

namespace toftwin::discover {
namespace {

constexpr std::string_view kNeighbours = "neighbours";
/// Half widths of the squares; the last one is the whole image.
constexpr std::array kReaches{1, 3, 7, 15, 31, 1'000'000};

std::string neighbourName(int reach) {
  return reach > 10'000 ? fmt::format("{}:everywhere", kNeighbours)
                        : fmt::format("{}:{}px", kNeighbours, reach);
}

constexpr std::string_view kMirrored = "mirrored";
/// Of squares about the mirrored place: a second image may be sharp, and seldom is.
constexpr std::array kMirroredReaches{0, 3, 10};
std::string mirroredName(int reach) { return fmt::format("{}:{}px", kMirrored, reach); }
/// By how much the light changes where the mirrored place lies farther right or down: what turns the image need not be
/// at its principal point, and squares about another place leave light that goes along columns and rows.
constexpr std::string_view kMirroredRight = "mirrored:right", kMirroredDown = "mirrored:down";
constexpr int kMirroredStep = 3;  // pixels each way; of squares as large

/// Turned by half a turn about the principal point; dark beyond the image's edge.
Phasors mirrored(const Phasors& z, const CameraInfo& camera) {
  Phasors turned(z.width(), z.height());
  const auto across = static_cast<int>(std::lround(2.0 * camera.cx)),
             along = static_cast<int>(std::lround(2.0 * camera.cy));
  for (int y = 0; y < z.height(); ++y) {
    for (int x = 0; x < z.width(); ++x) {
      const int from_x = across - x, from_y = along - y;
      if (from_x >= 0 && from_x < z.width() && from_y >= 0 && from_y < z.height())
        turned(x, y) = z(from_x, from_y);
    }
  }
  return turned;
}

/// From what lies (right, down) against the mirrored place to what lies that much on its other side.
Phasors acrossMirrored(const Phasors& turned, int right, int down) {
  const auto at = [&](int x, int y) {
    const bool is_inside = x >= 0 && x < turned.width() && y >= 0 && y < turned.height();
    return is_inside ? turned(x, y) : std::complex<float>{};  // dark beyond the image's edge
  };
  Phasors change(turned.width(), turned.height());
  for (int y = 0; y < change.height(); ++y)
    for (int x = 0; x < change.width(); ++x) change(x, y) = at(x - right, y - down) - at(x + right, y + down);
  return change;
}

/// How z changes as a pixel looks one pixel farther out, or in, than before: towards the next pixels on that
/// side, as light between pixels is interpolated.
Phasors changeTowards(const Phasors& z, const CameraInfo& camera, double out) {
  Phasors change(z.width(), z.height());
  for (int y = 0; y < z.height(); ++y) {
    for (int x = 0; x < z.width(); ++x) {
      const double across = out * (x - camera.cx), down = out * (y - camera.cy),
                   radius = std::hypot(across, down);
      if (!(radius > 0.0)) continue;
      const int beside = std::clamp(x + (across > 0.0 ? 1 : -1), 0, z.width() - 1);
      const int below = std::clamp(y + (down > 0.0 ? 1 : -1), 0, z.height() - 1);
      change(x, y) = static_cast<float>(std::abs(across) / radius) * (z(beside, y) - z(x, y)) +
                     static_cast<float>(std::abs(down) / radius) * (z(x, below) - z(x, y));
    }
  }
  return change;
}

}  // namespace

std::map<std::string, Reading> carriersOf(const sim::SensorModel& model, const Reading& declared,
                                          double period_m, double exposure_us) {
  std::map<std::string, Reading> all;
  const Phasors z = phasorOf(declared, period_m);
  for (const int reach : kReaches) {
    const Phasors mean = sim::boxMean(z, std::min(reach, std::max(z.width(), z.height())));
    all.emplace(neighbourName(reach),
                changeBy(shareOf(z, [&](std::size_t i) { return 0.01F * mean[i]; }), period_m));
  }
  for (const std::string_view carrier : {kAlongRow, kAlongColumn}) {
    const bool is_row = carrier == kAlongRow;
    const Phasors mean = sim::boxMean(z, is_row ? z.width() : 0, is_row ? 0 : z.height());
    all.emplace(carrier, changeBy(shareOf(z, [&](std::size_t i) { return 0.01F * mean[i]; }), period_m));
  }
  const Phasors turned = mirrored(z, model.camera());
  for (const int reach : kMirroredReaches) {
    const Phasors mean = sim::boxMean(turned, reach);
    all.emplace(mirroredName(reach),
                changeBy(shareOf(z, [&](std::size_t i) { return 0.01F * mean[i]; }), period_m));
  }
  const Phasors smooth = sim::boxMean(turned, kMirroredStep);
  for (const auto& [carrier, right] : {std::pair{kMirroredRight, true}, std::pair{kMirroredDown, false}}) {
    const Phasors change = acrossMirrored(smooth, right ? kMirroredStep : 0, right ? 0 : kMirroredStep);
    all.emplace(carrier, changeBy(shareOf(z, [&](std::size_t i) { return 0.01F * change[i]; }), period_m));
  }
  for (const auto& [carrier, out] : {std::pair{kOutwardCarrier, 1.0}, std::pair{kInwardCarrier, -1.0}}) {
    const Phasors change = changeTowards(z, model.camera(), out);
    all.emplace(carrier, changeBy(shareOf(z, [&](std::size_t i) { return change[i]; }), period_m));
  }
  const double steps = std::max<double>(1.0, static_cast<double>(model.exposures({}).size()));
  const auto electron = static_cast<float>(2.0 / steps);
  const auto add = [&](std::string_view carrier, float electrons) {
    all.emplace(fmt::format("{}:in_phase", carrier),
                changeBy(shareOf(z, [&](std::size_t) { return std::complex{electrons, 0.0F}; }), period_m));
    all.emplace(fmt::format("{}:quadrature", carrier),
                changeBy(shareOf(z, [&](std::size_t) { return std::complex{0.0F, electrons}; }), period_m));
  };
  add(kChargeCarrier, electron), add(kConverterCarrier, electron);
  add(kStrayCarrier, electron * static_cast<float>(exposure_us * 1e-3));  // of a millisecond
  Reading& gain = all[std::string{kGainCarrier}];
  gain.range_m = gain.log_amplitude = Image<float>(z.width(), z.height());
  for (float& change : gain.log_amplitude.pixels()) change = 0.01F;
  Reading of_converter = gain;
  all.emplace(fmt::format("{}:gain", kConverterCarrier), std::move(of_converter));
  return all;
}

std::vector<TermGroup> carrierGroups(std::span<const CovariateInfo> covariates, bool has_delay) {
  std::vector<TermGroup> groups;
  TermGroup light{"light from neighbours", Kind::Generic, {}, 0};
  for (const int reach : kReaches) light.terms.push_back({{}, Stage::Light, neighbourName(reach)});
  groups.push_back(std::move(light));
  groups.push_back({"light from the row and the column",
                    Kind::Generic,
                    {{{}, Stage::Light, std::string{kAlongRow}}, {{}, Stage::Light, std::string{kAlongColumn}}},
                    0});
  groups.back().is_rare = true;
  TermGroup ghost{"light from the mirrored place", Kind::Generic, {}, 0};
  for (const int reach : kMirroredReaches) ghost.terms.push_back({{}, Stage::Light, mirroredName(reach)});
  for (const std::string_view carrier : {kMirroredRight, kMirroredDown})
    ghost.terms.push_back({{}, Stage::Light, std::string{carrier}});
  groups.push_back(std::move(ghost));
  groups.push_back({"stray light, the same in all pixels",
                    Kind::Generic,
                    {{{}, Stage::Light, fmt::format("{}:in_phase", kStrayCarrier)},
                     {{}, Stage::Light, fmt::format("{}:quadrature", kStrayCarrier)}},
                    0,
                    std::string{kChargeCarrier}});  // it goes with exposure by itself
  const auto add = [&](std::string name, const std::vector<Term>& factors) {
    TermGroup charge{std::move(name), Kind::Generic, {}, 0};
    for (const char* part : {"in_phase", "quadrature"}) {
      for (Term term : factors) {
        term.stage = Stage::Samples, term.carrier = fmt::format("{}:{}", kChargeCarrier, part);
        charge.terms.push_back(std::move(term));
      }
    }
    groups.push_back(std::move(charge));
  };
  add("a constant charge", {Term{}});
  groups.back().simpler_than = kConverterCarrier;  // of which all columns have the same
  for (const CovariateInfo& covariate : covariates) {
    // Electronics beside the pixels glow, and warm those near to them.
    if (covariate.word != "exposure" && covariate.word != "ambient" && covariate.word != "temperature" &&
        covariate.word != "position")
      continue;
    std::vector<Term> factors{Term{}};
    for (Term& term : smoothIn(covariate, 4).terms) factors.push_back(std::move(term));
    add("a charge that goes with " + covariate.name, factors);
  }
  for (const CovariateInfo& covariate : covariates) {
    for (const std::string_view carrier : {kGainCarrier, kDelayCarrier, kOutwardCarrier, kInwardCarrier}) {
      if (carrier == kDelayCarrier && !has_delay) continue;
      const bool is_shift = carrier == kOutwardCarrier || carrier == kInwardCarrier;
      if (is_shift && covariate.name != "radius_px") continue;
      TermGroup of_light = smoothIn(covariate, kSmoothKnots);
      of_light.name = fmt::format("a {}{} that is {}", carrier, is_shift ? " shift" : "", of_light.name);
      for (Term& term : of_light.terms) term.stage = Stage::Light, term.carrier = carrier;
      if (!of_light.terms.empty()) groups.push_back(std::move(of_light));
    }
  }
  return groups;
}

std::vector<TermGroup> pixelGroups(bool has_delay, std::size_t numbers) {
  std::vector<TermGroup> groups;
  const auto add = [&](std::string_view of, Stage stage) {
    groups.push_back({fmt::format("a pattern of pixels, in the {}", of),
                      Kind::Generic,
                      {{{}, stage, fmt::format("{}:{}", kPixelCarrier, of)}},
                      static_cast<int>(numbers)});
  };
  add("range", Stage::Range);
  add("gain", Stage::Light);
  if (has_delay) add("delay", Stage::Light);
  return groups;
}

std::optional<int> reachOfNeighbours(std::string_view carrier) {
  for (const int reach : kReaches)
    if (carrier == neighbourName(reach)) return reach;
  return std::nullopt;
}

std::optional<int> reachOfMirrored(std::string_view carrier) {
  for (const int reach : kMirroredReaches)
    if (carrier == mirroredName(reach)) return reach;
  return std::nullopt;
}

std::optional<std::array<double, 2>> mirrorMovedBy(std::string_view carrier) {
  if (carrier == kMirroredRight) return std::array{double{kMirroredStep}, 0.0};
  if (carrier == kMirroredDown) return std::array{0.0, double{kMirroredStep}};
  return std::nullopt;
}

std::string_view wordOfCarrier(std::string_view carrier) {
  for (const std::string_view of_neighbours :
       {kNeighbours, kMirrored, kOutwardCarrier, kSmearedCarrier, kSpilledCarrier})
    if (carrier == of_neighbours) return "neighbours";
  if (carrier == kPixelCarrier) return "position";
  if (carrier == kUnequalCarrier) return "range";
  if (carrier == kPoseCarrier) return kPoseCarrier;
  const bool is_charge = carrier == kChargeCarrier || carrier == kStrayCarrier || carrier == kConverterCarrier ||
                         carrier == kAmplifiedCarrier;
  return is_charge ? "amplitude" : "";
}

}  // namespace toftwin::discover
