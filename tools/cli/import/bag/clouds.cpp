// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include <toftwin/geometry.h>
#include <toftwin/nan.h>

#include "tools/cli/import/bag/images.h"

namespace toftwin::cli {
namespace {

constexpr std::array<std::size_t, 9> kSizes{0, 1, 1, 2, 2, 4, 4, 4, 8};  // by PointField's number

template <class Number>
double read(const std::byte* from) {
  Number number{};
  std::memcpy(&number, from, sizeof number);
  return static_cast<double>(number);
}

double numberAt(const std::byte* from, std::uint8_t type) {
  switch (type) {
    case 1: return read<std::int8_t>(from);
    case 2: return read<std::uint8_t>(from);
    case 3: return read<std::int16_t>(from);
    case 4: return read<std::uint16_t>(from);
    case 5: return read<std::int32_t>(from);
    case 6: return read<std::uint32_t>(from);
    case 7: return read<float>(from);
    case 8: return read<double>(from);
    default: return static_cast<double>(kNaN);
  }
}

/// The field, if its bytes lie within a point.
const ros::PointField* fieldOf(const ros::PointCloud2& cloud, std::string_view name) {
  const auto found = std::ranges::find(cloud.fields, name, &ros::PointField::name);
  if (found == cloud.fields.end() || found->datatype == 0 || found->datatype > 8) return nullptr;
  const std::size_t size = kSizes[found->datatype];
  return cloud.point_step >= size && found->offset <= cloud.point_step - size ? &*found : nullptr;
}

/// Points in rows and columns, all of whose bytes are there.
class Grid {
 public:
  static Result<Grid> of(const ros::PointCloud2& cloud) {
    constexpr std::uint32_t kMostPixels = 1u << 26;
    Grid grid{cloud};
    const bool is_whole = grid.x_ != nullptr && grid.y_ != nullptr && grid.z_ != nullptr && cloud.width > 0 && cloud.height > 0 &&
                          cloud.width <= kMostPixels / cloud.height && cloud.data.size() >= grid.step_ * (cloud.height - 1) + grid.row_;
    if (!is_whole || cloud.is_bigendian) return Error{Error::Code::Malformed, "a cloud whose points cannot be read"};
    return grid;
  }
  [[nodiscard]] double at(const ros::PointField& field, std::size_t u, std::size_t v) const {
    return numberAt(cloud_->data.data() + step_ * v + cloud_->point_step * u + field.offset, field.datatype);
  }
  [[nodiscard]] Vec3d point(std::size_t u, std::size_t v) const { return {at(*x_, u, v), at(*y_, u, v), at(*z_, u, v)}; }

 private:
  explicit Grid(const ros::PointCloud2& cloud)
      : cloud_(&cloud), x_(fieldOf(cloud, "x")), y_(fieldOf(cloud, "y")), z_(fieldOf(cloud, "z")),
        row_(std::size_t{cloud.point_step} * cloud.width), step_(std::max<std::size_t>(cloud.row_step, row_)) {}
  const ros::PointCloud2* cloud_;
  const ros::PointField *x_, *y_, *z_;
  std::size_t row_, step_;
};

}  // namespace

Result<std::vector<float>> coordinatesOf(const ros::PointCloud2& cloud) {
  const auto grid = Grid::of(cloud);
  if (!grid) return grid.error();
  std::vector<float> numbers;
  numbers.reserve(3 * std::size_t{cloud.width} * cloud.height);
  for (std::size_t v = 0; v < cloud.height; ++v) {
    for (std::size_t u = 0; u < cloud.width; ++u) {
      const Vec3d point = grid->point(u, v);
      for (const double e : {point.x, point.y, point.z}) numbers.push_back(static_cast<float>(e));
    }
  }
  return numbers;
}

Result<std::vector<Plane>> planesOf(const ros::PointCloud2& cloud) {
  if (cloud.height < 2) return std::vector<Plane>{};
  const auto grid = Grid::of(cloud);
  if (!grid) return grid.error();
  const ros::PointField* amplitude = fieldOf(cloud, "intensity");
  if (amplitude == nullptr) amplitude = fieldOf(cloud, "amplitude");
  const int width = static_cast<int>(cloud.width), height = static_cast<int>(cloud.height);
  Image<float> range_m{width, height}, depth_m{width, height}, strength{width, height};
  for (std::size_t v = 0, i = 0; v < cloud.height; ++v) {
    for (std::size_t u = 0; u < cloud.width; ++u, ++i) {
      const Vec3d point = grid->point(u, v);
      const double range = norm(point);
      const bool is_valid = std::isfinite(range) && range > 0.0;
      range_m[i] = is_valid ? static_cast<float>(range) : kNaN;
      depth_m[i] = is_valid ? static_cast<float>(point.z) : kNaN;
      if (amplitude != nullptr) strength[i] = static_cast<float>(grid->at(*amplitude, u, v));
    }
  }
  std::vector<Plane> planes{toPlane(PlaneKind::Range, std::move(range_m)), toPlane(PlaneKind::Depth, std::move(depth_m))};
  if (amplitude != nullptr) planes.push_back(toPlane(PlaneKind::Amplitude, std::move(strength)));
  return planes;
}

}  // namespace toftwin::cli
