// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/target.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>

namespace toftwin::intrinsics {
namespace {

constexpr int kFewestCorners = 3, kMostCorners = 100;  // fewer corners do not tell lines from chance

std::optional<int> numberOf(std::string_view text) {
  int value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (fault != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

Result<Target> targetOf(std::string_view columns_by_rows, Length square) {
  const std::size_t cross = columns_by_rows.find_first_of("xX");
  const bool has_both = cross != std::string_view::npos;
  const auto columns = numberOf(columns_by_rows.substr(0, cross));
  const auto rows = numberOf(has_both ? columns_by_rows.substr(cross + 1) : std::string_view{});
  if (!columns || !rows) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("the board is \"{}\", but must be its inner corners as COLSxROWS, such as 8x5 "
                             "for 9 x 6 squares",
                             columns_by_rows)};
  }
  if (*columns < kFewestCorners || *rows < kFewestCorners || *columns > kMostCorners ||
      *rows > kMostCorners) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("the board has {} x {} inner corners, but needs {} to {} each way", *columns,
                             *rows, kFewestCorners, kMostCorners)};
  }
  if (!(square > 0_mm)) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("the board's squares are {:g} mm, but must be longer than 0",
                             square.in(millimetre))};
  }
  return Target{.columns = *columns, .rows = *rows, .square = square};
}

}  // namespace toftwin::intrinsics
