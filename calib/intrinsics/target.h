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

/// A flat calibration target of squares. Its frame: the first inner corner is the origin, x runs along
/// the columns, y along the rows, z away from a camera that sees it.
struct Target {
  enum class Kind { Checkerboard, Charuco };
  Kind kind = Kind::Checkerboard;
  int columns = 0;           ///< inner corners
  int rows = 0;              ///< inner corners
  Length square{};           ///< side of a square
  Length marker{};           ///< Charuco: side of a marker
  std::string dictionary{};  ///< Charuco: as OpenCV names it, such as "DICT_4X4_50"

  [[nodiscard]] std::size_t corners() const {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  }
  /// Of the corner that lies so many squares from the first; index = row · columns + column.
  [[nodiscard]] Length x(std::size_t corner) const {
    return static_cast<double>(corner % static_cast<std::size_t>(columns)) * square;
  }
  [[nodiscard]] Length y(std::size_t corner) const {
    return static_cast<double>(corner / static_cast<std::size_t>(columns)) * square;
  }
  bool operator==(const Target&) const = default;
};

/// "8x5": inner corners in a row and in a column. An Error says what a board must have.
Result<Target> targetOf(std::string_view columns_by_rows, Length square);

/// Makes a ChArUco board of a checkerboard: markers of the dictionary, as OpenCV names it ("DICT_4X4_50"), in its
/// bright squares. Errors: no such dictionary, too few markers in it, a marker that does not fit, built without ArUco.
Result<Target> charucoOf(Target board, Length marker, const std::string& dictionary);

}  // namespace toftwin::intrinsics
