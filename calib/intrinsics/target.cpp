// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/target.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <utility>

#include "calib/intrinsics/dictionary.h"

namespace toftwin::intrinsics {
namespace {

constexpr int kFewestCorners = 3, kMostCorners = 100;  // fewer corners do not tell lines from chance
constexpr int kFewestTags = 2, kMostTags = 50;

Error refusal(std::string what) { return {Error::Code::InvalidArgument, std::move(what)}; }

std::optional<int> numberOf(std::string_view text) {
  int value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (fault != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// "8x5".
std::optional<std::pair<int, int>> countsOf(std::string_view columns_by_rows) {
  const std::size_t cross = columns_by_rows.find_first_of("xX");
  if (cross == std::string_view::npos) return std::nullopt;
  const auto columns = numberOf(columns_by_rows.substr(0, cross));
  const auto rows = numberOf(columns_by_rows.substr(cross + 1));
  if (!columns || !rows) return std::nullopt;
  return std::pair{*columns, *rows};
}

bool isWithin(const std::pair<int, int>& counts, int least, int most) {
  const auto [columns, rows] = counts;
  return columns >= least && rows >= least && columns <= most && rows <= most;
}

}  // namespace

Result<Target> targetOf(std::string_view columns_by_rows, Length square) {
  const auto counts = countsOf(columns_by_rows);
  if (!counts)
    return refusal(
        fmt::format("the board is \"{}\", but must be its inner corners as COLSxROWS, such as 8x5 "
                    "for 9 x 6 squares",
                    columns_by_rows));
  if (!isWithin(*counts, kFewestCorners, kMostCorners))
    return refusal(fmt::format("the board has {} x {} inner corners, but needs {} to {} each way",
                               counts->first, counts->second, kFewestCorners, kMostCorners));
  if (!(square > 0_mm))
    return refusal(
        fmt::format("the board's squares are {:g} mm, but must be longer than 0", square.in(millimetre)));
  return Target{.columns = counts->first, .rows = counts->second, .square = square};
}

Result<Target> tagsOf(std::string_view columns_by_rows, Length pitch, Length marker,
                      const std::string& dictionary) {
  const auto counts = countsOf(columns_by_rows);
  if (!counts)
    return refusal(
        fmt::format("the board is \"{}\", but must be its tags as COLSxROWS, such as 5x4 for 20 of them",
                    columns_by_rows));
  if (!isWithin(*counts, kFewestTags, kMostTags))
    return refusal(fmt::format("the board has {} x {} tags, but needs {} to {} each way", counts->first,
                               counts->second, kFewestTags, kMostTags));
  if (!(marker > 0_mm))
    return refusal(
        fmt::format("tags of {:g} mm: how long is the side of one's dark border?", marker.in(millimetre)));
  const auto known = markersOf(dictionary, counts->first * counts->second);
  if (!known) return known.error();
  Target board{.kind = Target::Kind::Tags,
               .columns = 2 * counts->first,
               .rows = 2 * counts->second,
               .square = pitch,
               .marker = marker,
               .dictionary = dictionary,
               .cells = known->cells};
  const Length gap = pitch - marker, cell = marker / board.cells;
  if (gap < cell)
    return refusal(
        fmt::format("tags of {:g} mm that follow each other at {:g} mm leave no bright gap of a cell "
                    "({:.3g} mm): give the length from the edge of one tag to the same edge of the next",
                    marker.in(millimetre), pitch.in(millimetre), cell.in(millimetre)));
  return board;
}

Result<Target> charucoOf(Target board, Length marker, const std::string& dictionary) {
  if (!(marker > 0_mm) || !(marker < board.square))
    return refusal(fmt::format("markers of {:g} mm do not fit into squares of {:g} mm", marker.in(millimetre),
                               board.square.in(millimetre)));
  const auto known = markersOf(dictionary, (board.columns + 1) * (board.rows + 1) / 2);
  if (!known) return known.error();
  board.kind = Target::Kind::Charuco;
  board.marker = marker;
  board.dictionary = dictionary;
  board.cells = known->cells;
  return board;
}

Result<Target> targetOf(const BoardWords& words) {
  const auto dictionaryOr = [&](const char* usual) {
    return words.dictionary.empty() ? std::string{usual} : words.dictionary;
  };
  if (!words.tags.empty() && !words.corners.empty())
    return refusal(fmt::format("a board has either corners ({}) or tags ({})", words.corners, words.tags));
  if (!words.tags.empty())
    return tagsOf(words.tags, words.square, words.marker, dictionaryOr("DICT_APRILTAG_36h11"));
  auto target = targetOf(words.corners, words.square);
  if (!target || words.marker == Length{}) return target;
  return charucoOf(*std::move(target), words.marker, dictionaryOr("DICT_4X4_50"));
}

Result<> tellsItsPose(const Target& target) {
  if (target.kind != Target::Kind::Checkerboard || (target.columns + target.rows) % 2 != 0) return {};
  return refusal(fmt::format(
      "a checkerboard of {}x{} inner corners looks the same when it is turned by half, so its pose is one of "
      "two: one of its numbers must be even and the other odd, as of {}x{}",
      target.columns, target.rows, target.columns, target.rows - 1));
}

std::string inWords(const Target& target) {
  const auto square = target.square.in(millimetre), marker = target.marker.in(millimetre);
  switch (target.kind) {
    case Target::Kind::Checkerboard:
      return fmt::format("checkerboard {}x{}, squares of {:g} mm", target.columns, target.rows, square);
    case Target::Kind::Charuco:
      return fmt::format("ChArUco {}x{}, squares of {:g} mm", target.columns, target.rows, square);
    case Target::Kind::Tags:
      return fmt::format("{}x{} tags of {:g} mm, one every {:g} mm ({})", target.columns / 2, target.rows / 2,
                         marker, square, target.dictionary);
  }
  return {};
}

}  // namespace toftwin::intrinsics
