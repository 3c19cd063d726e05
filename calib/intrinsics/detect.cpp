// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/detect.h"

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include "calib/intrinsics/looks.h"
#include "calib/intrinsics/markers.h"
#include "calib/intrinsics/median.h"

namespace toftwin::intrinsics {
namespace {

using Pixels = std::vector<Pixel>;

std::optional<Pixels> search(const Image<float>& image, const Target& target, bool is_thorough) {
  const Span span = spanOf(image);
  const cv::Size size{target.columns, target.rows};
  constexpr int kQuick = cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_ACCURACY;
  constexpr int kClassic = cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_ADAPTIVE_THRESH;
  std::vector<cv::Point2f> found;
  const std::span looks{kLooks, is_thorough ? std::size(kLooks) : kQuickLooks};
  for (const int flags : {kQuick, kQuick | cv::CALIB_CB_EXHAUSTIVE}) {
    const bool is_slow = flags != kQuick;
    for (const Look& look : is_slow ? looks.first(kSlowLooks) : looks) {
      const cv::Mat shown = show(image, span, look);
      if (cv::findChessboardCornersSB(shown, size, found, flags)) return shrunk(found, look.scale);
    }
    if (!is_thorough) return std::nullopt;
  }
  for (const Look& look : looks.first(kSlowLooks)) {
    const cv::Mat shown = show(image, span, look);
    if (cv::findChessboardCorners(shown, size, found, kClassic)) return shrunk(found, look.scale);
  }
  return std::nullopt;
}

/// Of the corners of a column or row: those beside number i, or the two of its own tag.
struct Beside {
  int before, after;
};
Beside beside(int i, int count, Target::Kind kind) {
  if (kind == Target::Kind::Tags) return {i - i % 2, i - i % 2 + 1};
  return {std::max(0, i - 1), std::min(count - 1, i + 1)};
}

/// How far around a corner nothing but what meets there is seen, in squares or sides of a tag.
double reachOf(const Target& target) {
  switch (target.kind) {
    case Target::Kind::Checkerboard:
      return CornerGuess{}.reach;
    case Target::Kind::Charuco:
      return 0.5 * (1.0 - target.marker / target.square);
    case Target::Kind::Tags:
      return 0.8 / target.cells;  // its border; the gap is no less (target.h)
  }
  return 0.0;
}

/// Of a grid of corners: where the neighbours lie.
CornerGuess guessAt(const Pixels& grid, const Target& target, int column, int row) {
  const auto at = [&](int c, int r) {
    return grid[static_cast<std::size_t>(r) * static_cast<std::size_t>(target.columns) +
                static_cast<std::size_t>(c)];
  };
  const auto [left, right] = beside(column, target.columns, target.kind);
  const auto [top, bottom] = beside(row, target.rows, target.kind);
  const Pixel l = at(left, row), r = at(right, row), t = at(column, top), b = at(column, bottom);
  const bool is_tag = target.kind == Target::Kind::Tags;
  const double inward_u = is_tag && column % 2 == 1 ? -1.0 : 1.0,
               inward_v = is_tag && row % 2 == 1 ? -1.0 : 1.0;
  return {.at = at(column, row),
          .along = {inward_u * (r.u - l.u) / (right - left), inward_u * (r.v - l.v) / (right - left)},
          .across = {inward_v * (b.u - t.u) / (bottom - top), inward_v * (b.v - t.v) / (bottom - top)},
          .reach = reachOf(target),
          .is_outer = is_tag};
}

/// Turned so that columns and rows are as on the board seen from its front, and, where turning by 180°
/// swaps black and white, so that the squares before the first corner are what they are on any image.
Pixels inOrder(Pixels grid, const Target& target, bool first_is_bright) {
  const CornerGuess first = guessAt(grid, target, 0, 0);
  if (first.along[0] * first.across[1] - first.along[1] * first.across[0] < 0.0) {
    for (int row = 0; row < target.rows; ++row) {
      const auto begin = grid.begin() + static_cast<std::ptrdiff_t>(row) * target.columns;
      std::reverse(begin, begin + target.columns);
    }
    first_is_bright = (target.columns % 2 == 0) == first_is_bright;
  }
  if ((target.columns + target.rows) % 2 == 1 && first_is_bright) std::ranges::reverse(grid);
  return grid;
}

/// The whole grid by a homography from those corners that markers told, in the image as it is.
struct PartialGrid {
  Pixels grid;
  std::vector<bool> is_found;
};
std::optional<PartialGrid> searchInPart(const Image<float>& image, const Target& target, bool is_thorough) {
  const Span span = spanOf(image);
  const std::span looks{kLooks, is_thorough ? std::size(kLooks) : kQuickLooks};
  std::vector<MarkerCorner> best;
  int scale = 1;
  for (const Look& look : looks) {
    auto found = searchMarkers(show(image, span, look), target);
    if (found.size() <= best.size()) continue;
    best = std::move(found);
    scale = look.scale;
    if (best.size() == target.corners()) break;
  }
  if (best.size() < 4) return std::nullopt;
  std::vector<cv::Point2f> on_board, seen, all, everywhere;
  const auto place = [&](std::size_t i) {
    return cv::Point2f{static_cast<float>(target.x(i) / target.square),
                       static_cast<float>(target.y(i) / target.square)};
  };
  for (const MarkerCorner& corner : best) {
    on_board.push_back(place(corner.index));
    seen.push_back(corner.at);
  }
  const cv::Mat homography = cv::findHomography(on_board, seen, cv::RANSAC, 3.0 * scale);
  if (homography.empty()) return std::nullopt;
  for (std::size_t i = 0; i < target.corners(); ++i) all.push_back(place(i));
  cv::perspectiveTransform(all, everywhere, homography);
  PartialGrid partial{shrunk(everywhere, scale), std::vector<bool>(target.corners(), false)};
  for (const MarkerCorner& corner : best) {
    partial.grid[corner.index] = shrunk({corner.at}, scale).front();
    partial.is_found[corner.index] = true;
  }
  return partial;
}

struct Fitted {
  std::vector<Corner> corners;
  std::vector<double> blurs;
  double least_square_px = std::numeric_limits<double>::infinity();
  double flattest = 1.0;  ///< least sine between along and across, times the ratio of their lengths
};

/// `wanted`: empty, or whether each corner is.
Fitted fitAll(const Image<float>& image, const Target& target, const Pixels& grid, float saturation,
              const std::vector<bool>& wanted = {}) {
  Fitted fitted;
  for (int row = 0; row < target.rows; ++row) {
    for (int column = 0; column < target.columns; ++column) {
      const auto index = static_cast<std::size_t>(row * target.columns + column);
      if (!wanted.empty() && !wanted[index]) continue;
      const CornerGuess guess = guessAt(grid, target, column, row);
      const double along = std::hypot(guess.along[0], guess.along[1]);
      const double across = std::hypot(guess.across[0], guess.across[1]);
      const double area = std::abs(guess.along[0] * guess.across[1] - guess.along[1] * guess.across[0]);
      fitted.least_square_px = std::min(fitted.least_square_px, area / std::max(along, across));
      fitted.flattest = std::min(fitted.flattest, area / std::pow(std::max(along, across), 2));
      const auto corner = fitCorner(image, guess, saturation);
      if (!corner) continue;
      fitted.corners.push_back({index, corner->at, corner->error_px});
      fitted.blurs.push_back(corner->blur_px);
    }
  }
  return fitted;
}

/// A line of the grid along one of its sides, and the one before it.
struct Side {
  bool is_row;
  int outer, inner;
};

/// Whether four squares meet there as they do at a corner of the board, with the other sign. Where its rim
/// begins, squares and rim make half of that contrast.
bool isLikeNext(const FittedCorner& there, const FittedCorner& corner) {
  constexpr double kLeastContrast = 0.75, kMostError = 3.0;
  const double share = -there.contrast / corner.contrast;
  return share > kLeastContrast && share < 1.0 / kLeastContrast &&
         there.error_px < kMostError * corner.error_px;
}

/// Whether all that a fit there would look at lies in the image. Of half of it, as where an outer square ends at the
/// image's edge, an edge between two squares fits as well as a corner of four.
bool isWhole(const CornerGuess& guess, const Image<float>& image) {
  const double half_u = guess.reach * (std::abs(guess.along[0]) + std::abs(guess.across[0])),
               half_v = guess.reach * (std::abs(guess.along[1]) + std::abs(guess.across[1]));
  return guess.at.u > half_u && guess.at.v > half_v && guess.at.u < image.width() - 1.0 - half_u &&
         guess.at.v < image.height() - 1.0 - half_v;
}

/// Whether squares go on beyond a side: then the grid is a part of a larger board, wherever the search found
/// as many corners as it was told. At most of the places one step on that are seen whole, and at three or
/// more.
bool goesOn(const Image<float>& image, const Target& target, const Pixels& grid, float saturation,
            const Side& side) {
  constexpr double kMostAlike = 0.8;
  constexpr int kFewestAlike = 3;
  const int count = side.is_row ? target.columns : target.rows;
  int whole = 0, like = 0;
  for (int i = 0; i < count; ++i) {
    const auto at = [&](int line) {
      const int column = side.is_row ? i : line, row = side.is_row ? line : i;
      return guessAt(grid, target, column, row);
    };
    const CornerGuess outer = at(side.outer), inner = at(side.inner);
    CornerGuess beyond = outer;
    beyond.at = {2.0 * outer.at.u - inner.at.u, 2.0 * outer.at.v - inner.at.v};
    const auto corner = isWhole(beyond, image) ? fitCorner(image, outer, saturation) : std::nullopt;
    if (!corner) continue;
    ++whole;
    const auto there = fitCorner(image, beyond, saturation);
    like += there && isLikeNext(*there, *corner) ? 1 : 0;
  }
  return like >= kFewestAlike && like >= kMostAlike * whole;
}

/// What is said of a board with other counts than it was told; empty: nothing shows that.
std::string otherCounts(const Image<float>& image, const Target& target, const Pixels& grid,
                        float saturation) {
  if (target.columns < 3 || target.rows < 3) return {};
  for (const bool is_row : {false, true}) {
    const int last = (is_row ? target.rows : target.columns) - 1;
    for (const Side& side : {Side{is_row, 0, 1}, Side{is_row, last, last - 1}}) {
      if (!goesOn(image, target, grid, saturation, side)) continue;
      return fmt::format("it has more than {} x {} inner corners: another {} of them lies beyond",
                         target.columns, target.rows, is_row ? "row" : "column");
    }
  }
  return {};
}

/// Why too few corners of a board with markers are there, of which the markers told so many.
void rejectForFew(Sighting& sighting, const Target& target, std::size_t told, const DetectOptions& options) {
  const double clear_px = sighting.square_px * reachOf(target),
               least_clear_px = 0.5 * std::sqrt(static_cast<double>(kFewestPixels)),
               cell_px = sighting.square_px * (target.marker / target.square) / target.cells;
  const bool is_charuco = target.kind == Target::Kind::Charuco;
  sighting.rejection = is_charuco ? Rejection::TooSmall : Rejection::CornerOutliers;
  if (is_charuco && told >= options.fewest_corners && clear_px < least_clear_px) {
    sighting.detail = fmt::format("its markers leave {:.2f} px around each corner, {:.2f} are needed: {} of {} corners "
                                  "could be fitted", clear_px, least_clear_px, sighting.corners.size(), told);
  } else if (is_charuco && told < options.fewest_corners && cell_px < options.least_marker_cell_px) {
    sighting.detail = fmt::format("cells of its markers of {:.1f} px, {:g} are needed: they tell {} of {} corners",
                                  cell_px, options.least_marker_cell_px, told, target.corners());
  } else {
    sighting.rejection = Rejection::CornerOutliers;
    sighting.detail = fmt::format("its markers tell {} of {} corners, {} of which could be fitted; {} are needed", told,
                                  target.corners(), sighting.corners.size(), options.fewest_corners);
  }
}

void judge(Sighting& sighting, const Target& target, std::size_t told, const DetectOptions& options) {
  const auto reject = [&](Rejection reason, std::string detail) {
    sighting.rejection = reason;
    sighting.detail = std::move(detail);
  };
  const auto corners = static_cast<double>(sighting.corners.size()),
             all = static_cast<double>(target.corners());
  const bool has_markers = target.kind != Target::Kind::Checkerboard;
  const bool is_enough = !has_markers ? 1.0 - corners / all <= options.most_lost
                                      : sighting.corners.size() >= options.fewest_corners;
  const bool is_tags = target.kind == Target::Kind::Tags;
  const double pattern_px = is_tags ? sighting.square_px / target.cells : sighting.square_px;
  const double least_px = is_tags ? options.least_cell_px : options.least_square_px;
  const char* const pattern = is_tags ? "cells of tags" : "squares";
  if (pattern_px < least_px) {
    reject(Rejection::TooSmall,
           fmt::format("{} of {:.1f} px, {:g} are needed", pattern, pattern_px, least_px));
  } else if (has_markers && told < options.fewest_corners) {
    rejectForFew(sighting, target, told, options);  // nor do so few tell how it is tilted
  } else if (sighting.tilt_deg > options.most_tilt_deg) {
    reject(Rejection::TooOblique, fmt::format("tilted by {:.0f} degrees, at most {:g}", sighting.tilt_deg,
                                              options.most_tilt_deg));
  } else if (has_markers && !is_enough) {
    rejectForFew(sighting, target, told, options);
  } else if (!is_enough) {
    reject(Rejection::CornerOutliers, fmt::format("{} of {} corners could be fitted", sighting.corners.size(),
                                                  target.corners()));
  } else if (sighting.blur_px > options.most_blur * pattern_px) {
    reject(Rejection::Blurred,
           fmt::format("edges are blurred by {:.2f} px (standard deviation) with {} of {:.1f} px",
                       sighting.blur_px, pattern, pattern_px));
  }
}

}  // namespace

std::string_view nameOf(Rejection reason) {
  switch (reason) {
    case Rejection::None: return "used";
    case Rejection::NotFound: return "board not found";
    case Rejection::CornerOutliers: return "corner outliers";
    case Rejection::Blurred: return "blurred";
    case Rejection::TooOblique: return "too oblique";
    case Rejection::TooSmall: return "too small";
    case Rejection::SameImage: return "given twice";
    case Rejection::LikeAnother: return "like another view";
    case Rejection::ReprojectionOutlier: return "reprojection outlier";
  }
  return "unknown";
}

std::optional<float> saturationOf(const Image<float>& image) {
  constexpr double kNotable = 0.002;
  float largest = 0.0F;
  for (const float value : image.pixels()) {
    if (std::isfinite(value)) largest = std::max(largest, value);
  }
  const auto there = std::ranges::count(image.pixels(), largest);
  if (largest <= 0.0F || static_cast<double>(there) < kNotable * static_cast<double>(image.size())) {
    return std::nullopt;
  }
  return largest;
}

namespace {

void keep(Sighting& sighting, Fitted fitted) {
  sighting.corners = std::move(fitted.corners);
  sighting.blur_px = median(std::move(fitted.blurs));
  sighting.square_px = fitted.least_square_px;
  sighting.tilt_deg = std::acos(std::clamp(fitted.flattest, 0.0, 1.0)) * 180.0 / std::numbers::pi;
}

Sighting findMarkers(const Image<float>& image, const Target& target, const DetectOptions& options) {
  Sighting sighting;
  const auto found = searchInPart(mended(image), target, options.is_thorough);
  if (!found) {
    sighting.rejection = Rejection::NotFound;
    sighting.detail = target.kind == Target::Kind::Tags
                          ? fmt::format("no two tags of {} that lie row by row, number 0 at the top left",
                                        target.dictionary)
                          : fmt::format("no markers of {} with corners between them", target.dictionary);
    return sighting;
  }
  const float saturation = saturationOf(image).value_or(std::numeric_limits<float>::infinity());
  keep(sighting, fitAll(image, target, found->grid, saturation, found->is_found));
  judge(sighting, target, static_cast<std::size_t>(std::ranges::count(found->is_found, true)), options);
  return sighting;
}

}  // namespace

Sighting findBoard(const Image<float>& image, const Target& target, const DetectOptions& options) {
  if (target.kind != Target::Kind::Checkerboard) return findMarkers(image, target, options);
  Sighting sighting;
  const auto found = search(mended(image), target, options.is_thorough);
  if (!found) {
    sighting.rejection = Rejection::NotFound;
    sighting.detail = fmt::format("no {} x {} inner corners", target.columns, target.rows);
    return sighting;
  }
  const float saturation = saturationOf(image).value_or(std::numeric_limits<float>::infinity());
  Fitted fitted = fitAll(image, target, *found, saturation);
  // The fit starts from the fitted corners once more: better neighbours make better windows.
  Pixels grid = *found;
  for (const Corner& corner : fitted.corners) grid[corner.index] = corner.at;
  const auto first = fitCorner(image, guessAt(grid, target, 0, 0), saturation);
  grid = inOrder(std::move(grid), target, first && first->contrast > 0.0);
  fitted = fitAll(image, target, grid, saturation);
  for (const Corner& corner : fitted.corners) grid[corner.index] = corner.at;
  if (std::string other = otherCounts(image, target, grid, saturation); !other.empty()) {
    sighting.rejection = Rejection::NotFound;
    sighting.has_more = true;
    sighting.detail = std::move(other);
    return sighting;
  }
  keep(sighting, std::move(fitted));
  judge(sighting, target, 0, options);
  return sighting;
}

}  // namespace toftwin::intrinsics
