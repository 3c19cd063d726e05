// SPDX-License-Identifier: Apache-2.0
#include "tools/validate/line_rows.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "tools/validate/traced_line.h"

namespace toftwin::validate {

using compare::quantile;

namespace {

/// Nearer readings are none.
constexpr double kNearest_mm = 300.0;
/// So far beside the plate's edge, in t, rows see the wall alone, and the plate alone.
constexpr double kClear_t = 0.08, kOnPlate_t = 0.03, kFirst_t = 0.02;

Result<ScanLine> lineOf(const Task& task, const std::string& file, const Line& what) {
  const auto columns = columnsOf(task, file, {what.x, what.z});
  if (!columns) return columns.error();
  return toScanLine((*columns)[0], (*columns)[1]);
}

double lengthAlong(const Line& what, double t) { return what.along == Line::Along::Depth ? std::sqrt(1.0 + t * t) : 1.0; }

Result<LineRows> againstReference(const Line& what, const Task& task, const std::vector<double>& pixels_t) {
  const auto measured = lineOf(task, what.files.front(), what);
  if (!measured) return measured.error();
  const auto reference = lineOf(task, what.reference, what);
  if (!reference) return reference.error();
  const std::vector<EdgePoint> edges = edgePoints(what.edges_mm);
  LineRows rows;
  rows.t = what.rays == Line::Rays::Reference ? reference->t : what.rays == Line::Rays::Measured ? measured->t : pixels_t;
  rows.run.assign(rows.t.size(), 0);
  for (const double t : rows.t) {
    const double on_reference = rangeAlong(*reference, t);
    rows.on_reference_mm.push_back(on_reference);
    rows.place_mm.push_back(placeOf(edges, t, on_reference));
    rows.measured_mm.push_back((rangeAlong(*measured, t) - on_reference) / lengthAlong(what, t));
  }
  return rows;
}

/// Walls along the background as it was measured: medians of equal parts of the row.
std::string backgroundToml(std::span<const double> t, std::span<const double> background_mm, double height_mm) {
  constexpr int kParts = 24;
  const auto [first, last] = std::ranges::minmax(t);
  std::vector<std::vector<double>> depth(kParts);
  for (std::size_t i = 0; i < t.size(); ++i) {
    const auto part = static_cast<std::size_t>((t[i] - first) / (last - first) * (kParts - 1e-9));
    depth[part].push_back(background_mm[i]);
  }
  std::string toml;
  std::optional<std::pair<double, double>> before;
  for (std::size_t part = 0; part < depth.size(); ++part) {
    if (depth[part].empty()) continue;
    const double z = quantile(depth[part], 0.5);
    const double at = first + (static_cast<double>(part) + 0.5) * (last - first) / kParts;
    const std::pair here{at * z, z};
    if (before) toml += wallToml({before->first, before->second, here.first, here.second, height_mm, "wall"});
    before = here;
  }
  return toml;
}

/// Rows of one run: the background's change beside a plate that stands right of the axis.
Result<> addRun(const Line& what, const Task& task, const std::string& file, LineRows& rows) {
  const auto columns = columnsOf(task, file, {what.x, what.z, what.background});
  if (!columns) return columns.error();
  const auto& [x, z, background] = std::tie((*columns)[0], (*columns)[1], (*columns)[2]);
  std::vector<double> t, plate, background_t, background_mm;
  for (std::size_t i = 0; i < x.size(); ++i) t.push_back(x[i] / background[i]);
  const auto isPlate = [&](std::size_t i) { return z[i] > kNearest_mm && background[i] - z[i] > what.plate_step_mm; };
  double edge = kNaN;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (t[i] > kFirst_t && isPlate(i) && !(edge <= t[i])) edge = t[i];
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (t[i] > edge + kOnPlate_t && isPlate(i)) plate.push_back(z[i]);
    if (background[i] > kNearest_mm) background_t.push_back(t[i]), background_mm.push_back(background[i]);
  }
  if (plate.size() < 10) {  // none where there is no edge
    return Error{Error::Code::InvalidArgument, fmt::format("{}: no plate before the background to the right of the axis", file)};
  }
  const auto [first, last] = std::ranges::minmax(background_t);
  PlateRun run{.plate_mm = quantile(plate, 0.5), .covered = (last - edge) / (last - first)};
  run.without = materialToml("wall", what.plate_albedo) + backgroundToml(background_t, background_mm, what.plate_height_mm);
  run.with = run.without + wallToml({edge * run.plate_mm, run.plate_mm, last * run.plate_mm, run.plate_mm, what.plate_height_mm, "wall"});
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!(background[i] > kNearest_mm) || t[i] < what.rays_t.front() || t[i] > std::min(what.rays_t.back(), edge - kClear_t) ||
        std::abs(z[i] - background[i]) > what.most_mm)
      continue;
    rows.t.push_back(t[i]), rows.place_mm.push_back(kNaN), rows.run.push_back(static_cast<int>(rows.plates.size()));
    rows.measured_mm.push_back((z[i] - background[i]) * std::sqrt(1.0 + t[i] * t[i]) / lengthAlong(what, t[i]));
  }
  rows.plates.push_back(std::move(run));
  return {};
}

}  // namespace

std::vector<EdgePoint> edgePoints(const std::vector<double>& edges_mm) {
  std::vector<EdgePoint> edges;
  for (std::size_t i = 0; i + 1 < edges_mm.size(); i += 2) edges.push_back({edges_mm[i], edges_mm[i + 1]});
  return edges;
}

Result<LineRows> readRows(const Line& what, const Task& task, const std::vector<double>& pixels_t) {
  if (!what.reference.empty()) return againstReference(what, task, pixels_t);
  LineRows rows;
  for (const std::string& file : what.files) {
    if (auto added = addRun(what, task, file, rows); !added) return added.error();
  }
  return rows;
}

Result<std::vector<double>> otherAt(const Other& other, const Line& what, const Task& task, const LineRows& rows) {
  const auto line = lineOf(task, other.file, what);
  if (!line) return line.error();
  const auto reference = lineOf(task, other.reference, what);
  if (!reference) return reference.error();
  const std::vector<EdgePoint> edges = edgePoints(other.edges_mm);
  std::vector<std::pair<double, double>> theirs;
  for (std::size_t i = 0; i < line->size(); ++i) {
    const double t = line->t[i], on_reference = rangeAlong(*reference, t), place = placeOf(edges, t, on_reference);
    const double value = (line->range_mm[i] - on_reference) / lengthAlong(what, t);
    if (std::isfinite(place + value) && place != 0.0) theirs.emplace_back(place, value);
  }
  std::ranges::sort(theirs);
  std::vector<double> values;
  for (const double place : rows.place_mm) {
    const auto above = std::ranges::lower_bound(theirs, place, {}, &std::pair<double, double>::first);
    const bool is_inside = place != 0.0 && above != theirs.begin() && above != theirs.end();
    const auto below = is_inside ? std::prev(above) : above;
    if (!is_inside || below->first * above->first < 0.0) {
      values.push_back(kNaN);
      continue;
    }
    const double share = (place - below->first) / (above->first - below->first);
    values.push_back(below->second + share * (above->second - below->second));
  }
  return values;
}

}  // namespace toftwin::validate
