// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "calib/table/number.h"
#include "calib/table/table.h"
#include "calib/table/times.h"
#include "calib/table/units.h"
#include "calib/table/words.h"
#include "tools/cli/campaign/trajectory.h"

namespace toftwin::cli {
namespace {

/// What a column of a trajectory is called: our name of it, and what others write, without units, in small
/// letters.
struct PoseColumn {
  const char* name;
  std::array<std::string_view, 7> written;
};
constexpr std::array<PoseColumn, 8> kColumns{
    {{"time_s", {}},  // by its words
     {"x_m", {"x", "tx", "px", "pos_x", "position_x", "translation_x", "x_pos"}},
     {"y_m", {"y", "ty", "py", "pos_y", "position_y", "translation_y", "y_pos"}},
     {"z_m", {"z", "tz", "pz", "pos_z", "position_z", "translation_z", "z_pos"}},
     {"q_w", {"q_w", "qw", "quat_w", "rotation_w", "orientation_w", "w", "rot_w"}},
     {"q_x", {"q_x", "qx", "quat_x", "rotation_x", "orientation_x", "i", "rot_x"}},
     {"q_y", {"q_y", "qy", "quat_y", "rotation_y", "orientation_y", "j", "rot_y"}},
     {"q_z", {"q_z", "qz", "quat_z", "rotation_z", "orientation_z", "k", "rot_z"}}}};
/// As the RGB-D benchmark of TUM writes poses where no line names the columns: t x y z qx qy qz qw.
constexpr std::array<std::size_t, 8> kOrderOfTum{0, 1, 2, 3, 7, 4, 5, 6};
constexpr double kMostPosition_m = 1e6;

/// Where each of kColumns is; nothing for one that is not there.
using Places = std::array<std::optional<std::size_t>, kColumns.size()>;

std::string plainName(const table::TableColumn& column) {
  std::string name = table::folded(column.stem);
  std::ranges::replace_if(
      name, [](char c) { return c == '.' || c == ' ' || c == '-' || c == '/'; }, '_');
  while (!name.empty() && name.front() == '_') name.erase(name.begin());
  return name;
}

bool isTime(const table::TableColumn& column) {
  const table::Unit* unit = table::findUnit(column.unit);
  const bool is_unit_of_time =
      column.unit.empty() || (unit != nullptr && unit->quantity == table::Quantity::Time);
  return column.kind == table::Kind::Time ||
         (is_unit_of_time && table::says(column.stem, table::Meaning::Time));
}

Result<Places> placesIn(const table::Table& rows) {
  Places places;
  if (!rows.has_header && rows.columns.size() == kColumns.size()) {
    for (std::size_t i = 0; i < kColumns.size(); ++i) places[i] = kOrderOfTum[i];
    return places;
  }
  std::vector<const char*> names;
  for (const PoseColumn& column : kColumns) names.push_back(column.name);
  for (std::size_t i = 0; i < kColumns.size(); ++i) {
    if (const auto at = rows.find(kColumns[i].name)) places[i] = *at;
    for (std::size_t c = 0; c < rows.columns.size() && !places[i]; ++c) {
      const table::TableColumn& column = rows.columns[c];
      const bool is_it =
          i == 0 ? isTime(column)
                 : std::ranges::find(kColumns[i].written, plainName(column)) != kColumns[i].written.end();
      if (is_it) places[i] = c;
    }
    if (places[i] || i == 0) continue;
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}: no column is called {}, only: {}. Needed: {}; time_s may be left out",
                             rows.file.string(), kColumns[i].name, fmt::join(rows.headers(), ", "),
                             fmt::join(names, ", "))};
  }
  return places;
}

/// Seconds, or metres; of turns as they are.
Result<std::vector<double>> valuesOf(const table::Table& rows, std::size_t column, std::size_t what) {
  const table::TableColumn& from = rows.columns[column];
  auto values = rows.numbers(column);
  if (!values) return values;
  const auto epoch = what == 0 && from.kind == table::Kind::Number && from.unit.empty()
                         ? table::epochOf(*values, false)
                         : std::nullopt;
  const double factor = epoch                            ? epoch->seconds_per_unit
                        : what == 0                      ? table::factorBetween(from.unit, "s")
                        : what < 4 && !from.unit.empty() ? table::factorBetween(from.unit, "m")
                                                         : 1.0;
  for (double& value : *values) value *= factor;
  for (std::size_t row = 0; row < rows.rows(); ++row) {
    const double most = what == 0 ? kMostTime_s : kMostPosition_m;
    if (!std::isfinite((*values)[row]))
      return rows.errorAt(
          column, row,
          fmt::format("is not a finite number, and {} needs one in each row", kColumns[what].name));
    if (std::abs((*values)[row]) > most)
      return rows.errorAt(column, row,
                          fmt::format("must be within ±{} {}", most,
                                      what == 0  ? "s"
                                      : what < 4 ? "m"
                                                 : ""));
  }
  return values;
}

Result<sim::Motion::Key> poseOf(const std::array<double, kColumns.size()>& v, const table::Table& rows,
                                std::size_t row) {
  const auto at = [&](const std::string& what) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}:{}: {}", rows.file.string(), rows.line[row], what)};
  };
  if (v[0] < 0.0) return at(fmt::format("time_s = {} must be 0 or more: it counts from device time 0", v[0]));
  const double length = std::sqrt(v[4] * v[4] + v[5] * v[5] + v[6] * v[6] + v[7] * v[7]);
  if (!(length > 1e-6)) return at("q_w, q_x, q_y, q_z are all zero, which is no rotation");
  return sim::Motion::Key{
      v[0], {v[4] / length, v[5] / length, v[6] / length, v[7] / length}, {v[1], v[2], v[3]}};
}

}  // namespace

Result<Trajectory> loadTrajectoryCsv(const std::filesystem::path& file) {
  const auto rows = table::readTable(file);
  if (!rows) return rows.error();
  const auto places = placesIn(*rows);
  if (!places) return places.error();
  std::array<std::vector<double>, kColumns.size()> columns;
  for (std::size_t i = 0; i < kColumns.size(); ++i) {
    auto values = (*places)[i] ? valuesOf(*rows, *(*places)[i], i) : std::vector<double>(rows->rows(), 0.0);
    if (!values) return values.error();
    columns[i] = *std::move(values);
  }
  Trajectory trajectory{.poses = {}, .has_times = (*places)[0].has_value()};
  for (std::size_t row = 0; row < rows->rows(); ++row) {
    std::array<double, kColumns.size()> v{};
    for (std::size_t i = 0; i < v.size(); ++i) v[i] = columns[i][row];
    const auto pose = poseOf(v, *rows, row);
    if (!pose) return pose.error();
    if (trajectory.has_times && row > 0 && !(pose->time_s > trajectory.poses.back().time_s)) {
      return Error{
          Error::Code::InvalidArgument,
          fmt::format(
              "{}:{}: time_s = {} is not later than that of the pose before, {}; sort the lines by time",
              file.string(), rows->line[row], pose->time_s, trajectory.poses.back().time_s)};
    }
    trajectory.poses.push_back(*pose);
  }
  return trajectory;
}

}  // namespace toftwin::cli
