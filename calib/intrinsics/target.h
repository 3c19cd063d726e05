// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>
#include <toftwin/units.h>

namespace toftwin::intrinsics {

/// Pixel coordinates; (0, 0) is the centre of the first pixel.
struct Pixel {
  double u = 0.0, v = 0.0;
  bool operator==(const Pixel&) const = default;
};

/// A flat calibration target: corners in columns and rows. Its frame: the first corner is the origin, x runs
/// along the columns, y along the rows, z away from a camera that sees it.
struct Target {
  enum class Kind { Checkerboard, Charuco, Tags };
  Kind kind = Kind::Checkerboard;
  int columns = 0;           ///< of corners: inner corners of squares; of tags, which have two each
  int rows = 0;              ///< likewise
  Length square{};           ///< side of a square; Tags: from one tag to the next
  Length marker{};           ///< Charuco, Tags: side of a marker
  std::string dictionary{};  ///< Charuco, Tags: as OpenCV names it, such as "DICT_4X4_50"
  int cells = 0;             ///< Charuco, Tags: across a marker, with its dark border, which is one cell wide

  [[nodiscard]] std::size_t corners() const {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  }
  /// Of a corner, from the first; index = row · columns + column.
  [[nodiscard]] Length x(std::size_t corner) const {
    return along(corner % static_cast<std::size_t>(columns));
  }
  [[nodiscard]] Length y(std::size_t corner) const {
    return along(corner / static_cast<std::size_t>(columns));
  }
  bool operator==(const Target&) const = default;

 private:
  [[nodiscard]] Length along(std::size_t i) const {
    if (kind != Kind::Tags) return static_cast<double>(i) * square;
    return static_cast<double>(i / 2) * square + static_cast<double>(i % 2) * marker;
  }
};

/// A board as a person describes it.
struct BoardWords {
  std::string corners{};  ///< "8x5": inner corners of a checkerboard, or of a ChArUco board if it has markers
  std::string tags{};     ///< "5x4": tags of a grid of markers, instead
  Length square{};        ///< side of a square; tags: from one tag to the next
  Length marker{};        ///< side of a marker; 0: a checkerboard
  std::string dictionary{};  ///< empty: DICT_4X4_50, of tags DICT_APRILTAG_36h11
};
/// An Error says what such a board must have.
Result<Target> targetOf(const BoardWords& words);

/// "8x5": inner corners in a row and in a column. An Error says what a board must have.
Result<Target> targetOf(std::string_view columns_by_rows, Length square);

/// Makes a ChArUco board of a checkerboard: markers of the dictionary, as OpenCV names it ("DICT_4X4_50"), in its
/// bright squares. Errors: no such dictionary, too few markers in it, a marker that does not fit, built without ArUco.
Result<Target> charucoOf(Target board, Length marker, const std::string& dictionary);

/// "5x4": a grid of the dictionary's markers, number 0 at the top left, row by row; `pitch` from the edge of
/// one to the same edge of the next. Errors as above.
Result<Target> tagsOf(std::string_view columns_by_rows, Length pitch, Length marker,
                      const std::string& dictionary);

/// Error where a board looks the same when it is turned by half, so that its pose would be one of two: a
/// checkerboard without markers whose counts of inner corners are both even or both odd. It calibrates a
/// lens.
Result<> tellsItsPose(const Target& target);

/// "checkerboard 8x5, squares of 32 mm".
std::string inWords(const Target& target);

}  // namespace toftwin::intrinsics
