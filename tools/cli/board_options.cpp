// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/board_options.h"

namespace toftwin::cli {

void BoardOptions::add(Arguments& args) {
  args.option("--board", corners_, "inner corners as COLSxROWS: 8x5 for 9 × 6 squares");
  args.option("--tags", tags_,
              "a grid of AprilTags or other markers instead, COLSxROWS: 5x4 for 20, number 0 at the top "
              "left, row by row");
  args.option("--square", square_mm_,
              "side of a square, mm; tags: from the edge of one to the same edge of the next")
      .within(0.1, 10'000.0);
  args.option("--marker", marker_mm_,
              "side of a tag's dark border, or of a ChArUco board's markers, mm; 0: a checkerboard")
      .within(0.0, 10'000.0);
  args.option("--dictionary", dictionary_,
              "of the markers, as OpenCV names it; default: DICT_4X4_50, of tags DICT_APRILTAG_36h11");
}

Result<> BoardOptions::check() const {
  const auto missing = [](const char* what) { return Error{Error::Code::InvalidArgument, what}; };
  if (corners_.empty() && tags_.empty())
    return missing("give --board (inner corners) or --tags, and --square");
  if (square_mm_ == 0.0) return missing("give --square, the side of a square or the length from tag to tag");
  if (!tags_.empty() && marker_mm_ == 0.0)
    return missing("--tags needs --marker, the side of a tag's dark border");
  const auto target = intrinsics::targetOf(words());
  return target ? Result<>{} : target.error();
}

intrinsics::BoardWords BoardOptions::words() const {
  return {.corners = corners_,
          .tags = tags_,
          .square = square_mm_ * millimetre,
          .marker = marker_mm_ * millimetre,
          .dictionary = dictionary_};
}

}  // namespace toftwin::cli
