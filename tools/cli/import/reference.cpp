// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/import/reference.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>
#include <vector>

#include <toftwin/nan.h>

#include "calib/table/table.h"
#include "calib/table/units.h"
#include "protocol/record/recording.h"

namespace toftwin::cli {
namespace {

Error wrong(std::string_view name, std::string_view what) { return {Error::Code::InvalidArgument, fmt::format("--reference {}: {}", name, what)}; }

/// n · p = d along each pixel's ray: range = d / (n · ray), NaN where the ray does not meet it.
Plane truthOf(const CameraInfo& camera, Vec3d n, double d_m) {
  Image<float> range_m{camera.width, camera.height};
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const double range = d_m / dot(n, rayThroughPixel(camera, u, v).v);
      range_m(u, v) = std::isfinite(range) && range > 0.0 ? static_cast<float>(range) : kNaN;
    }
  }
  return toPlane(PlaneKind::TruthRange, std::move(range_m));
}

class FixedPlane final : public Reference {
 public:
  FixedPlane(Vec3d n, double d_m) : n_(n), d_m_(d_m) {}
  Result<> add(Frame& frame) override {
    if (!truth_ || of_ != frame.camera) {
      of_ = frame.camera;
      truth_ = truthOf(of_, n_, d_m_);
    }
    frame.planes.push_back(*truth_);
    return {};
  }

 private:
  Vec3d n_;
  double d_m_;
  CameraInfo of_;
  std::optional<Plane> truth_;
};

class Distances final : public Reference {
 public:
  Distances(std::string name, std::vector<double> metres) : name_(std::move(name)), metres_(std::move(metres)) {}
  Result<> add(Frame& frame) override {
    if (frame.sequence >= metres_.size()) return wrong(name_, fmt::format("it has {} rows, and there is a frame {}", metres_.size(), frame.sequence + 1));
    frame.planes.push_back(truthOf(frame.camera, {0.0, 0.0, 1.0}, metres_[frame.sequence]));
    return {};
  }

 private:
  std::string name_;
  std::vector<double> metres_;
};

class Recorded final : public Reference {
 public:
  Recorded(std::string name, record::Reader reader) : name_(std::move(name)), reader_(std::move(reader)) {}
  Result<> add(Frame& frame) override {
    const auto other = reader_.next();
    if (!other) return wrong(name_, fmt::format("it has no frame for frame {}: {}", frame.sequence + 1, other.error().message));
    const Plane* truth = other->find(PlaneKind::TruthRange);
    if (truth == nullptr) truth = other->find(PlaneKind::Range);
    if (truth == nullptr || truth->type != ElementType::F32 || truth->width != frame.camera.width || truth->height != frame.camera.height)
      return wrong(name_, fmt::format("its frames have no range of {} x {} pixels", frame.camera.width, frame.camera.height));
    frame.planes.push_back(*truth);
    frame.planes.back().kind = PlaneKind::TruthRange;
    return {};
  }

 private:
  std::string name_;
  record::Reader reader_;
};

std::optional<std::vector<double>> numbersIn(std::string_view text) {
  std::vector<double> numbers;
  while (true) {
    double number = 0.0;
    const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
    if (read.ec != std::errc{} || !std::isfinite(number)) return std::nullopt;
    numbers.push_back(number);
    text.remove_prefix(static_cast<std::size_t>(read.ptr - text.data()));
    if (text.empty()) return numbers;
    if (text[0] != ',') return std::nullopt;
    text.remove_prefix(1);
  }
}

Result<std::unique_ptr<Reference>> ofNumbers(const std::string& name, const std::vector<double>& numbers) {
  if (numbers.size() != 1 && numbers.size() != 4) return wrong(name, "one number is the depth of a wall, four are NX,NY,NZ,D of a plane");
  const Vec3d n = numbers.size() == 4 ? Vec3d{numbers[0], numbers[1], numbers[2]} : Vec3d{0.0, 0.0, 1.0};
  const double d_m = numbers.back(), length = norm(n);
  if (!(length > 0.0) || d_m == 0.0) return wrong(name, "a plane needs a normal and a distance, neither of which is 0");
  return std::unique_ptr<Reference>{std::make_unique<FixedPlane>(n / length, d_m)};
}

Result<std::unique_ptr<Reference>> ofTable(const std::string& file, const std::string& column) {
  const auto rows = table::readTable(file);
  if (!rows) return rows.error();
  std::vector<std::size_t> lengths;
  for (std::size_t i = 0; i < rows->columns.size(); ++i) {
    const bool is_named = !column.empty() && rows->columns[i].header == column;
    const table::Unit* unit = table::findUnit(rows->columns[i].unit);
    const bool is_length = unit != nullptr && unit->quantity == table::Quantity::Length;
    if (is_named || (column.empty() && rows->columns[i].kind == table::Kind::Number && is_length)) lengths.push_back(i);
  }
  if (lengths.size() != 1)
    return wrong(file, fmt::format("which column is the distance? {}:COLUMN says it, with the unit in its name; there are: {}", file, fmt::join(rows->headers(), ", ")));
  auto values = rows->numbers(lengths.front());
  if (!values) return values.error();
  const double to_metres = table::factorBetween(rows->columns[lengths.front()].unit, "m");
  for (double& value : *values) value *= to_metres;
  return std::unique_ptr<Reference>{std::make_unique<Distances>(file, *std::move(values))};
}

}  // namespace

Result<std::unique_ptr<Reference>> referenceNamed(const std::string& name) {
  if (const auto numbers = numbersIn(name)) return ofNumbers(name, *numbers);
  std::error_code fault;
  const std::size_t colon = name.rfind(':');
  const bool has_column = !std::filesystem::exists(name, fault) && colon != name.npos;
  const std::string file = name.substr(0, has_column ? colon : name.size()), column = has_column ? name.substr(colon + 1) : "";
  if (!std::filesystem::is_regular_file(file, fault)) return Error{Error::Code::NotFound, fmt::format("--reference {}: there is no such file, and it is neither one number nor four", name)};
  auto reader = record::Reader::open(file);
  if (reader) return std::unique_ptr<Reference>{std::make_unique<Recorded>(file, *std::move(reader))};
  return ofTable(file, column);
}

}  // namespace toftwin::cli
