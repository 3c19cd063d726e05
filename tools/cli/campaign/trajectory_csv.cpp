// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "tools/cli/campaign/trajectory.h"

namespace toftwin::cli {
namespace {

constexpr std::array<std::string_view, 8> kColumns{"time_s", "x_m", "y_m", "z_m", "q_w", "q_x", "q_y", "q_z"};
constexpr double kMostPosition_m = 1e6, kMostTime_s = 9e9;  // as in a pose file

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> fields;
  while (true) {
    const std::size_t comma = line.find(',');
    std::string_view field = line.substr(0, comma);
    const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
    while (!field.empty() && is_blank(field.front())) field.remove_prefix(1);
    while (!field.empty() && is_blank(field.back())) field.remove_suffix(1);
    fields.push_back(field);
    if (comma == std::string_view::npos) return fields;
    line.remove_prefix(comma + 1);
  }
}

/// Where each of kColumns is among the fields; nothing for one that is not there.
using Places = std::array<std::optional<std::size_t>, kColumns.size()>;

class Lines {
 public:
  explicit Lines(const std::filesystem::path& file) : file_(file), in_(file) {}

  [[nodiscard]] Error error(std::string_view what) const {
    return {Error::Code::InvalidArgument, fmt::format("{}:{}: {}", file_.string(), number_, what)};
  }
  /// The fields of the next line that is not blank and no comment (#). False at the end.
  bool next(std::vector<std::string_view>& fields) {
    while (std::getline(in_, line_)) {
      ++number_;
      fields = split(line_);
      if (fields.size() > 1 || (!fields[0].empty() && fields[0][0] != '#')) return true;
    }
    return false;
  }
  [[nodiscard]] bool isOpen() const { return in_.is_open(); }

 private:
  std::filesystem::path file_;
  std::ifstream in_;
  std::string line_;
  int number_ = 0;
};

Result<Places> placesIn(const std::vector<std::string_view>& header, const Lines& lines) {
  Places places;
  for (std::size_t i = 0; i < kColumns.size(); ++i) {
    const auto at = std::ranges::find(header, kColumns[i]);
    if (at != header.end()) {
      places[i] = static_cast<std::size_t>(at - header.begin());
    } else if (i > 0) {
      return lines.error(
          fmt::format("the first line must name the columns; there is no {}, only: {}. Needed: {}; "
                      "time_s may be left out",
                      kColumns[i], fmt::join(header, ", "), fmt::join(kColumns, ", ")));
    }
  }
  return places;
}

Result<double> numberOf(std::string_view field, std::string_view column, double most, const Lines& lines) {
  double number = 0.0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), number);
  if (error != std::errc{} || end != field.data() + field.size())
    return lines.error(fmt::format("{} = \"{}\" is not a number", column, field));
  if (!std::isfinite(number))
    return lines.error(fmt::format("{} = {} is not a finite number", column, field));
  if (std::abs(number) > most)
    return lines.error(fmt::format("{} = {} must be within ±{}", column, field, most));
  return number;
}

Result<sim::Motion::Key> poseOf(const std::vector<std::string_view>& fields, const Places& places,
                                const Lines& lines) {
  std::array<double, kColumns.size()> v{};
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (!places[i]) continue;
    if (*places[i] >= fields.size())
      return lines.error(fmt::format("there are {} fields, so {} is missing", fields.size(), kColumns[i]));
    const auto number =
        numberOf(fields[*places[i]], kColumns[i], i == 0 ? kMostTime_s : kMostPosition_m, lines);
    if (!number) return number.error();
    v[i] = *number;
  }
  if (v[0] < 0.0)
    return lines.error(fmt::format("time_s = {} must be 0 or more: it counts from device time 0", v[0]));
  const double length = std::sqrt(v[4] * v[4] + v[5] * v[5] + v[6] * v[6] + v[7] * v[7]);
  if (!(length > 1e-6)) return lines.error("q_w, q_x, q_y, q_z are all zero, which is no rotation");
  return sim::Motion::Key{
      v[0], {v[4] / length, v[5] / length, v[6] / length, v[7] / length}, {v[1], v[2], v[3]}};
}

}  // namespace

Result<Trajectory> loadTrajectoryCsv(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    return Error{Error::Code::NotFound, fmt::format("{}: there is no such file", file.string())};
  Lines lines{file};
  std::vector<std::string_view> fields;
  if (!lines.isOpen() || !lines.next(fields))
    return Error{Error::Code::InvalidArgument, fmt::format("{}: cannot be read, or is empty", file.string())};
  const auto places = placesIn(fields, lines);
  if (!places) return places.error();
  Trajectory trajectory{.poses = {}, .has_times = (*places)[0].has_value()};
  while (lines.next(fields)) {
    const auto pose = poseOf(fields, *places, lines);
    if (!pose) return pose.error();
    if (trajectory.has_times && !trajectory.poses.empty() &&
        !(pose->time_s > trajectory.poses.back().time_s)) {
      return lines.error(
          fmt::format("time_s = {} is not later than that of the pose before, {}; sort the lines by time",
                      pose->time_s, trajectory.poses.back().time_s));
    }
    trajectory.poses.push_back(*pose);
  }
  if (trajectory.poses.empty()) return lines.error("there are no poses below the columns' names");
  return trajectory;
}

}  // namespace toftwin::cli
