// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/room.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>

#include <toftwin/fields.h>

#include "protocol/settings/settings.h"

namespace toftwin::reference {
namespace {

struct MaterialKeys {
  std::string name, model = "lambertian";
  double albedo = 0.5;
  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "");
    v.choice("model", model, {{"lambertian", std::string{"lambertian"}}}, "");
    v.number("albedo", albedo, {0.0, 1.0}, "");
  }
};

enum class Shape { Rectangle, Box };

struct ObjectKeys {
  std::string name, material;
  Shape shape = Shape::Rectangle;
  std::array<double, 3> size_m{1.0, 1.0, 1.0}, position_m{}, euler_deg{};
  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "");
    v.choice("shape", shape, {{"rectangle", Shape::Rectangle}, {"box", Shape::Box}}, "");
    v.numbers("size_m", size_m, {0.0, 1e5}, "");
    v.numbers("position_m", position_m, {-1e6, 1e6}, "");
    v.numbers("euler_deg", euler_deg, {-360.0, 360.0}, "");
    v.text("material", material, "");
  }
};

struct SceneKeys {
  std::vector<MaterialKeys> materials;
  std::vector<ObjectKeys> objects;
  template <class Visitor>
  void visit(Visitor& v) {
    v.group("material", materials, "");
    v.group("object", objects, "");
  }
};

/// About the fixed world axes x, then y, then z.
Vec3d turned(Vec3d v, const std::array<double, 3>& euler_deg) {
  constexpr double kToRadian = std::numbers::pi / 180.0;
  const double cx = std::cos(euler_deg[0] * kToRadian), sx = std::sin(euler_deg[0] * kToRadian);
  const double cy = std::cos(euler_deg[1] * kToRadian), sy = std::sin(euler_deg[1] * kToRadian);
  const double cz = std::cos(euler_deg[2] * kToRadian), sz = std::sin(euler_deg[2] * kToRadian);
  v = {v.x, cx * v.y - sx * v.z, sx * v.y + cx * v.z};
  v = {cy * v.x + sy * v.z, v.y, -sy * v.x + cy * v.z};
  return {cz * v.x - sz * v.y, sz * v.x + cz * v.y, v.z};
}

Board board(Vec3d centre, Vec3d a, Vec3d b, double albedo) {
  return {centre, a, b, normalised(cross(a, b)), albedo};
}

void add(Room& room, const ObjectKeys& object, double albedo) {
  const Vec3d centre{object.position_m[0], object.position_m[1], object.position_m[2]};
  const Vec3d x = turned({object.size_m[0] / 2.0, 0, 0}, object.euler_deg);
  const Vec3d y = turned({0, object.size_m[1] / 2.0, 0}, object.euler_deg);
  if (object.shape == Shape::Rectangle) {
    room.boards.push_back(board(centre, x, y, albedo));
    return;
  }
  const Vec3d z = turned({0, 0, object.size_m[2] / 2.0}, object.euler_deg);
  for (const double side : {-1.0, 1.0}) {
    room.boards.push_back(board(centre + side * z, x, y, albedo));
    room.boards.push_back(board(centre + side * x, y, z, albedo));
    room.boards.push_back(board(centre + side * y, z, x, albedo));
  }
}

/// Distance along a ray to a board, or infinity.
double distanceTo(const Board& board, Vec3d origin, Vec3d direction) {
  const double slope = dot(direction, board.normal);
  if (slope == 0.0) return INFINITY;
  const double distance = dot(board.centre_m - origin, board.normal) / slope;
  if (!(distance > 0.0)) return INFINITY;
  const Vec3d at = origin + distance * direction - board.centre_m;
  const bool is_on = std::abs(dot(at, board.a_m)) <= dot(board.a_m, board.a_m) &&
                     std::abs(dot(at, board.b_m)) <= dot(board.b_m, board.b_m);
  return is_on ? distance : INFINITY;
}

}  // namespace

Result<Room> readRoom(const std::filesystem::path& scene) {
  const auto keys = settings::loadFile<SceneKeys>(scene);
  if (!keys) return keys.error();
  std::map<std::string, double> albedos;
  for (const MaterialKeys& material : keys->materials) albedos[material.name] = material.albedo;
  Room room;
  for (const ObjectKeys& object : keys->objects) {
    const auto albedo = albedos.find(object.material);
    if (albedo == albedos.end()) {
      return Error{Error::Code::InvalidArgument, scene.string() + ": object \"" + object.name +
                                                     "\" is of a material \"" + object.material +
                                                     "\", which the file does not describe"};
    }
    if (object.size_m[0] == 0.0 || object.size_m[1] == 0.0 ||
        (object.shape == Shape::Box && object.size_m[2] == 0.0)) {
      return Error{Error::Code::InvalidArgument,
                   scene.string() + ": object \"" + object.name + "\" has an edge of length 0"};
    }
    add(room, object, albedo->second);
  }
  return room;
}

std::optional<Meeting> firstMeeting(const Room& room, Vec3d origin_m, Vec3d direction, double least_m) {
  Meeting first{0, INFINITY};
  for (std::size_t i = 0; i < room.boards.size(); ++i) {
    const double distance = distanceTo(room.boards[i], origin_m, direction);
    if (distance > least_m && distance < first.distance_m) first = {i, distance};
  }
  if (std::isinf(first.distance_m)) return std::nullopt;
  return first;
}

double distanceBetween(Vec3d place, const Board& board) {
  const Vec3d way = place - board.centre_m;
  const double u = std::clamp(dot(way, board.a_m) / dot(board.a_m, board.a_m), -1.0, 1.0);
  const double v = std::clamp(dot(way, board.b_m) / dot(board.b_m, board.b_m), -1.0, 1.0);
  return norm(way - u * board.a_m - v * board.b_m);
}

bool areStuckTogether(const Board& a, const Board& b) {
  constexpr double kStuckOn_m = 1e-3;
  return norm(cross(a.normal, b.normal)) < 1e-9 &&
         std::abs(dot(a.centre_m - b.centre_m, a.normal)) < kStuckOn_m;
}

bool isHidden(const Room& room, Vec3d from_m, Vec3d to_m) {
  constexpr double kOnBoard = 1e-9;  // share of the way
  const Vec3d way = to_m - from_m;
  for (const Board& board : room.boards) {
    const double share = distanceTo(board, from_m, way);
    if (share > kOnBoard && share < 1.0 - kOnBoard) return true;
  }
  return false;
}

}  // namespace toftwin::reference
