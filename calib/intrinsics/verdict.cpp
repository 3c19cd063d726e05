// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include <toftwin/camera_info.h>

#include "protocol/types/counted.h"

namespace toftwin::intrinsics {
namespace {

ImageCover coverOf(const Calibrated& calibrated) {
  ImageCover cover{calibrated.target, calibrated.size};
  for (const std::size_t used : calibrated.estimate.used) cover.add(calibrated.sightings[used]);
  return cover;
}

/// Over the cells of the image where no board was: what the views leave open there.
double worstWhereUncovered(const Calibrated& calibrated, const ImageCover& cover) {
  const MappingError error{calibrated.estimate.bundle, calibrated.estimate.uncertainty,
                           calibrated.size.width, calibrated.size.height};
  double worst = 0.0;
  for (int row = 0; row < ImageCover::kDown; ++row) {
    for (int column = 0; column < ImageCover::kAcross; ++column) {
      if (cover.isCovered(column, row)) continue;
      const Pixel at = cover.centre(column, row);
      worst = std::max(worst, error.at(at.u, at.v));
    }
  }
  return worst;
}

void warnOfExtrapolation(const Calibrated& calibrated, std::vector<std::string>& warnings) {
  const ImageCover cover = coverOf(calibrated);
  const double missing = 1.0 - cover.share();
  if (missing < 0.05) return;
  const auto parts = cover.missing();
  const std::string where = parts.empty() ? std::string{"near its edges"}
                                          : fmt::format("least at the {}", fmt::join(parts, ", "));
  warnings.push_back(fmt::format(
      "extrapolation: the board never reached {:.0f} % of the image, {}; the lens is known to {:.2f} px (one "
      "standard error) there, and only if the {} model holds",
      100.0 * missing, where, worstWhereUncovered(calibrated, cover), nameOf(calibrated.estimate.bundle.model)));
}

/// The simplest model that does as well on held-out views as the one that was used.
const ModelScore* simplerAsGood(const Estimate& estimate, const ModelScore& used) {
  for (const ModelScore& one : estimate.scores) {
    if (one.model >= used.model) break;
    if (!gainOf(one, used).isReal()) return &one;
  }
  return nullptr;
}

void warnOfModel(const Calibrated& calibrated, std::vector<std::string>& warnings) {
  const Estimate& estimate = calibrated.estimate;
  const ModelScore* used = estimate.scoreOf(estimate.bundle.model);
  if (used == nullptr) return;
  if (const ModelScore* simpler = simplerAsGood(estimate, *used)) {
    warnings.push_back(fmt::format(
        "over-fit: {} does no better than {} on views it has not seen ({:.4f} and {:.4f} px RMS) though it fits those "
        "it has seen with {:.4f} instead of {:.4f} px; use --model {}",
        nameOf(used->model), nameOf(simpler->model), used->held_out_rms_px, simpler->held_out_rms_px,
        used->fitted_rms_px, simpler->fitted_rms_px, nameOf(simpler->model)));
  }
  if (used->model == LensModel::Rational) return;
  for (const ModelScore& richer : estimate.scores) {
    if (richer.model <= used->model || !gainOf(*used, richer).isReal()) continue;
    const bool can_store = richer.model != LensModel::Rational;
    if (can_store && !calibrated.was_model_asked) continue;
    warnings.push_back(fmt::format(
        "under-fit: {} does better on views it has not seen, by {:.0f} % ({:.4f} instead of {:.4f} px RMS){}",
        nameOf(richer.model), 100.0 * (1.0 - std::exp(-gainOf(*used, richer).mean)), richer.held_out_rms_px,
        used->held_out_rms_px,
        can_store ? fmt::format("; use --model {}", nameOf(richer.model))
                  : std::string{"; a camera file holds five terms, which are too few for this lens"}));
    return;
  }
}

/// Intervals are right if the lens has the terms of its model and no others. A term that held-out views ask for, but
/// not surely enough to be taken, may be there all the same; it counts where it moves a number out of its interval.
void warnOfTermsLeftOut(const Calibrated& calibrated, std::vector<std::string>& warnings) {
  const Estimate& estimate = calibrated.estimate;
  const ModelScore* used = estimate.scoreOf(estimate.bundle.model);
  if (used == nullptr) return;
  for (const ModelScore& richer : estimate.scores) {
    if (richer.model <= used->model || richer.model == LensModel::Rational) continue;
    const Gain gain = gainOf(*used, richer);
    if (gain.isReal() || !(gain.mean > gain.error)) continue;
    std::size_t farthest = 0;
    double most = 0.0;
    for (std::size_t i = 0; i < parametersOf(used->model); ++i) {
      const double half = estimate.uncertainty.half_width[static_cast<Eigen::Index>(i)];
      const double off = std::abs(richer.lens[i] - estimate.bundle.lens[i]) / half;
      if (off > most) most = off, farthest = i;
    }
    if (!(most > 1.0)) continue;
    warnings.push_back(fmt::format(
        "the intervals are those of {}: {} may do better on views it has not seen ({:+.1f} % ± {:.1f}), and with it {} "
        "is {:.{}f}, {:.1f} half-widths away; more views, up to the edges of the image, tell whether its terms are "
        "there (--model {} takes them)",
        nameOf(used->model), nameOf(richer.model), 100.0 * gain.mean, 100.0 * gain.error, kParameterNames[farthest],
        richer.lens[farthest], farthest < 4 ? 2 : 5, most, nameOf(richer.model)));
    return;
  }
}

/// Rays that do not come back to their pixel: the distortion folds within the image.
void warnOfFold(const Calibrated& calibrated, std::vector<std::string>& warnings) {
  const CameraInfo camera = calibration::cameraOf(fileOf(calibrated, "").lens);
  int folded = 0, all = 0;
  for (int v = 0; v < camera.height; v += std::max(1, camera.height / 24)) {
    for (int u = 0; u < camera.width; u += std::max(1, camera.width / 32)) {
      const Direction<Camera> ray = rayThroughPixel(camera, u, v);
      const auto back = pixelOfPoint(camera, {ray.v});
      ++all;
      folded += std::hypot(back[0] - u, back[1] - v) > 0.01 ? 1 : 0;
    }
  }
  if (folded == 0) return;
  warnings.push_back(fmt::format("the distortion cannot be inverted in {:.0f} % of the image: those pixels look along "
                                 "no ray of this model; add views there, or use fewer terms (--model)",
                                 std::max(1.0, 100.0 * folded / all)));
}

void warnOfViews(const Calibrated& calibrated, std::vector<std::string>& warnings) {
  const Estimate& estimate = calibrated.estimate;
  constexpr std::size_t kGood = 10;
  if (estimate.used.size() < kGood) {
    warnings.push_back(fmt::format("only {}: held-out errors and intervals are rough below {}",
                                   counted(estimate.used.size(), "view"), kGood));
  }
  if (estimate.uncertainty.clustering > kClustered) {
    warnings.push_back(fmt::format(
        "corners of one view err alike: views differ {:.1f} times more than independent corners would let them "
        "(a board that bends or moves, a lens that is not this model); the intervals are those of the views",
        estimate.uncertainty.clustering));
  }
  constexpr double kMuchOfSquare = 0.01;
  const double depth = estimate.bundle.surface.depth_mm();
  if (depth > kMuchOfSquare * calibrated.target.square.in(millimetre)) {
    warnings.push_back(fmt::format("the board is not flat: its corners span {:.2f} mm in depth; this was estimated and "
                                   "taken out (--flat leaves it in), yet a stiff board is better",
                                   depth));
  }
}

std::string modelTable(const Estimate& estimate) {
  std::string text = "  lens model       fitted   held-out   gain over the one before\n";
  const ModelScore* before = nullptr;
  for (const ModelScore& one : estimate.scores) {
    text += fmt::format("  {:<14} {:>8.4f}   {:>8.4f}", nameOf(one.model), one.fitted_rms_px, one.held_out_rms_px);
    if (before != nullptr) {
      const Gain gain = gainOf(*before, one);
      text += fmt::format("   {:+.1f} % ± {:.1f}", 100.0 * gain.mean, 100.0 * gain.error);
    }
    text += one.model == estimate.bundle.model ? "   <- used\n" : "\n";
    before = &one;
  }
  return text;
}

std::string surfaceTable(const Estimate& estimate) {
  if (estimate.surfaces.size() < 2) return {};
  std::string text = "  board            fitted   held-out   gain over a flat one\n";
  for (const ModelScore& one : estimate.surfaces) {
    const std::string name = one.degree == 0 ? "flat" : fmt::format("bent, degree {}", one.degree);
    text += fmt::format("  {:<14} {:>8.4f}   {:>8.4f}", name, one.fitted_rms_px, one.held_out_rms_px);
    const Gain gain = gainOf(estimate.surfaces.front(), one);
    if (one.degree > 0) text += fmt::format("   {:+.1f} % ± {:.1f}", 100.0 * gain.mean, 100.0 * gain.error);
    text += one.degree == estimate.bundle.surface.degree() ? "   <- used\n" : "\n";
  }
  return text;
}

std::string parameterTable(const Estimate& estimate) {
  std::string text = "                  value     95 %\n";
  const auto& half = estimate.uncertainty.half_width;
  for (std::size_t i = 0; i < parametersOf(estimate.bundle.model); ++i) {
    const int digits = i < 4 ? 2 : 5;
    text += fmt::format("  {:<4} {:>16.{}f}   ± {:.{}f}\n", kParameterNames[i], estimate.bundle.lens[i], digits,
                        half[static_cast<Eigen::Index>(i)], digits);
  }
  return text;
}

std::string viewTable(const Calibrated& calibrated) {
  std::string text;
  for (const Sighting& sighting : calibrated.sightings) {
    if (sighting.isUsed()) continue;
    text += fmt::format("  rejected {}: {} ({})\n", sighting.name, nameOf(sighting.rejection), sighting.detail);
  }
  return text;
}

}  // namespace

std::vector<std::string> warningsOf(const Calibrated& calibrated) {
  std::vector<std::string> warnings;
  warnOfModel(calibrated, warnings);
  warnOfTermsLeftOut(calibrated, warnings);
  warnOfFold(calibrated, warnings);
  warnOfExtrapolation(calibrated, warnings);
  warnOfViews(calibrated, warnings);
  return warnings;
}

std::string describe(const Calibrated& calibrated) {
  const Estimate& estimate = calibrated.estimate;
  std::size_t corners = 0, dropped = 0;
  for (const Observed& view : estimate.views) corners += view.corners.size();
  for (const std::size_t one : estimate.dropped) dropped += one;
  const ModelScore* score = estimate.scoreOf(estimate.bundle.model);
  std::string text = fmt::format("{} of {} used, {} ({} left out)\n{}\n", estimate.used.size(),
                                 counted(calibrated.sightings.size(), "view"), counted(corners, "corner"), dropped,
                                 viewTable(calibrated));
  text += surfaceTable(estimate) + modelTable(estimate) + "\n" + parameterTable(estimate);
  text += fmt::format("\nreprojection {:.4f} px RMS", estimate.rms_px_all);
  if (score != nullptr) text += fmt::format(", {:.4f} px on held-out views", score->held_out_rms_px);
  text += "\n";
  for (const std::string& warning : warningsOf(calibrated)) text += "warning: " + warning + "\n";
  return text;
}

calibration::CalibrationFile fileOf(const Calibrated& calibrated, const std::string& made) {
  const Estimate& estimate = calibrated.estimate;
  const Target& target = calibrated.target;
  const LensParameters& lens = estimate.bundle.lens;
  const ModelScore* score = estimate.scoreOf(estimate.bundle.model);
  calibration::CalibrationFile file;
  // To digits that no image can tell, and that a person can read; the id is that of these numbers.
  const auto pixels = [&](std::size_t i) { return std::round(lens[i] * 1e4) / 1e4; };
  const auto term = [&](std::size_t i) { return std::round(lens[i] * 1e8) / 1e8; };
  file.lens = {.width = calibrated.size.width,
               .height = calibrated.size.height,
               .fx = pixels(0),
               .fy = pixels(1),
               .cx = pixels(2),
               .cy = pixels(3),
               .distortion = {term(4), term(5), term(6), term(7), term(8)}};
  auto& about = file.calibration;
  about.made = made;
  about.software = "toftwin " TOFTWIN_VERSION;
  about.camera = calibrated.camera;
  about.board = inWords(target);
  about.lens_model = nameOf(estimate.bundle.model);
  about.views = static_cast<int>(estimate.used.size());
  about.rejected = static_cast<int>(calibrated.sightings.size() - estimate.used.size());
  about.rms_px = std::round(estimate.rms_px_all * 1e6) / 1e6;
  about.held_out_rms_px = score == nullptr ? 0.0 : std::round(score->held_out_rms_px * 1e6) / 1e6;
  about.board_depth_mm = std::round(estimate.bundle.surface.depth_mm() * 1e3) / 1e3;
  about.covered = coverOf(calibrated).box();
  for (double& edge : about.covered) edge = std::round(edge);
  const auto halfOf = [&](Eigen::Index i) {
    const double half = i < estimate.uncertainty.half_width.size() ? estimate.uncertainty.half_width[i] : 0.0;
    return std::round(half * 1e8) / 1e8;
  };
  about.interval = {.fx = halfOf(0),
                    .fy = halfOf(1),
                    .cx = halfOf(2),
                    .cy = halfOf(3),
                    .distortion = {halfOf(4), halfOf(5), halfOf(6), halfOf(7), halfOf(8)}};
  return file;
}

}  // namespace toftwin::intrinsics
