// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/scene_meshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>

#include "sim/meshes/mesh_file.h"

namespace toftwin::sim {
namespace {

using meshes::MeshFile;

/// Objects of such a size are most likely in another unit than metres.
constexpr double kHugeObject_m = 100.0, kTinyObject_m = 0.001;

struct Extent {
  Vec3d lower{INFINITY, INFINITY, INFINITY}, upper{-INFINITY, -INFINITY, -INFINITY};
  void include(Vec3d p) {
    lower = {std::min(lower.x, p.x), std::min(lower.y, p.y), std::min(lower.z, p.z)};
    upper = {std::max(upper.x, p.x), std::max(upper.y, p.y), std::max(upper.z, p.z)};
  }
  [[nodiscard]] double largest() const {
    const Vec3d size = upper - lower;
    return std::max({size.x, size.y, size.z});
  }
};

double metresOf(LengthUnit unit) {
  switch (unit) {
    case LengthUnit::Metre:
      break;
    case LengthUnit::Centimetre:
      return 0.01;
    case LengthUnit::Millimetre:
      return 0.001;
    case LengthUnit::Inch:
      return 0.0254;
    case LengthUnit::Foot:
      return 0.3048;
  }
  return 1.0;
}

/// Turns and scales a mesh as its object says, and notes a size that cannot be meant.
void place(TriangleMesh& mesh, const PlacedObject& object, std::vector<std::string>& notes) {
  const ObjectSpec& spec = object.spec;
  const double metres = metresOf(spec.unit);
  Extent extent;
  for (Vec3d& v : mesh.vertices) {
    v = turnedUp(Vec3d{v.x * object.stretch.x, v.y * object.stretch.y, v.z * object.stretch.z} * metres, spec.up);
    extent.include(v * spec.scale);
  }
  const double size = extent.largest();
  const bool is_stretched = object.stretch != Vec3d{1, 1, 1};
  if (spec.scale != 1.0 || is_stretched || spec.unit != LengthUnit::Metre || (size < kHugeObject_m && size > kTinyObject_m)) return;
  notes.push_back(fmt::format(
      "{}: mesh {} is {:.4g} m wide: {}", object.place, object.mesh.filename().string(), size,
      size > 1.0 ? "is it in millimetres? Then say unit = \"mm\""
                 : "is it in another unit? unit and scale say so"));
}

class MeshLoading {
 public:
  MeshLoading(SceneFile& file, const SceneLoading& how) : file_(file), how_(how), notes_(file.notes) {}

  Result<std::vector<std::string>> run() {
    std::vector<PlacedObject> all;
    std::optional<Error> wrong;  // all meshes that are, one a line
    for (std::size_t i = 0; i < file_.objects.size(); ++i) {
      PlacedObject& object = file_.objects[i];
      object.number = i;
      if (object.spec.shape != Shape::Mesh || object.triangles != nullptr) {
        all.push_back(std::move(object));
        continue;
      }
      const auto added = add(object, all);
      if (!added && added.error().code == Error::Code::Stopped) return added.error();
      if (!added && wrong) wrong->message += "\n" + added.error().message;
      if (!added && !wrong) wrong = added.error();
    }
    if (wrong) return *std::move(wrong);
    file_.objects = std::move(all);
    return std::move(notes_);
  }

 private:
  /// A file as it was read, and which materials its surfaces became.
  struct Known {
    Result<MeshFile> read;
    std::vector<std::optional<std::size_t>> materials;
    std::optional<std::size_t> plain;  ///< of triangles without one
  };

  Known& known(const PlacedObject& object) {
    const auto found = files_.find(object.mesh);
    if (found != files_.end()) return found->second;
    Known& one = files_.emplace(object.mesh, Known{meshes::readMeshFile(object.mesh, {how_.stop, how_.may_convert}), {}, {}})
                     .first->second;
    if (!one.read) return one;
    for (const std::string& note : one.read->notes)
      notes_.push_back(fmt::format("{}: mesh {}: {}", object.place, object.mesh.filename().string(), note));
    one.materials.resize(one.read->surfaces.size());
    return one;
  }

  Result<> add(PlacedObject& object, std::vector<PlacedObject>& all) {
    Known& one = known(object);
    if (!one.read) {
      const Error& error = one.read.error();
      return Error{error.code, fmt::format("{}: {}", object.place, error.message)};
    }
    if (object.material) {
      addPart(object, 0, one.read->mesh.triangles.size(), all);
      return {};
    }
    for (const auto& [surface, parts] : bySurface(*one.read)) {
      PlacedObject copy = object;
      copy.material = surface ? materialFor(one, *surface, object) : plainFor(one, object);
      TriangleMesh joined;
      for (const meshes::Part* part : parts) append(joined, partOf(one.read->mesh, part->first, part->count));
      addMesh(copy, std::move(joined), all);
    }
    return {};
  }

  static std::map<std::optional<std::size_t>, std::vector<const meshes::Part*>> bySurface(const MeshFile& read) {
    std::map<std::optional<std::size_t>, std::vector<const meshes::Part*>> parts;
    for (const meshes::Part& part : read.parts) parts[part.surface].push_back(&part);
    return parts;
  }

  /// Both or neither of them have places on a picture, or none is left.
  static void append(TriangleMesh& to, const TriangleMesh& more) {
    const auto first = static_cast<std::uint32_t>(to.vertices.size());
    const bool has_places = to.places.size() == to.triangles.size() && !more.places.empty();
    to.vertices.insert(to.vertices.end(), more.vertices.begin(), more.vertices.end());
    for (const auto& [a, b, c] : more.triangles) to.triangles.push_back({first + a, first + b, first + c});
    if (has_places)
      to.places.insert(to.places.end(), more.places.begin(), more.places.end());
    else
      to.places.clear();
  }

  void addPart(PlacedObject& object, std::size_t first, std::size_t count, std::vector<PlacedObject>& all) {
    addMesh(object, partOf(files_.at(object.mesh).read->mesh, first, count), all);
  }

  void addMesh(PlacedObject& object, TriangleMesh mesh, std::vector<PlacedObject>& all) {
    place(mesh, object, notes_);
    object.triangles = std::make_shared<const TriangleMesh>(std::move(mesh));
    all.push_back(std::move(object));
  }

  std::size_t addMaterial(MaterialSpec material, NamedFile texture) {
    file_.spec.materials.push_back(std::move(material));
    file_.textures.push_back(std::move(texture));
    return file_.spec.materials.size() - 1;
  }

  std::size_t materialFor(Known& one, std::size_t surface, const PlacedObject& object) {
    auto& index = one.materials[surface];
    if (index) return *index;
    const meshes::Surface& from = one.read->surfaces[surface];
    index = addMaterial(materialOf(from), {from.picture.file, object.place, from.picture.bytes});
    return *index;
  }

  std::size_t plainFor(Known& one, const PlacedObject& object) {
    if (one.plain) return *one.plain;
    notes_.push_back(fmt::format("{}: mesh {} says nothing of the surface of some triangles; they are matt, with an albedo of 0.5",
                                 object.place, object.mesh.filename().string()));
    one.plain = addMaterial({}, {});
    return *one.plain;
  }

  SceneFile& file_;
  const SceneLoading& how_;
  std::map<std::filesystem::path, Known> files_;
  std::vector<std::string> notes_;
};

}  // namespace

TriangleMesh partOf(const TriangleMesh& mesh, std::size_t first, std::size_t count) {
  TriangleMesh part;
  std::unordered_map<std::uint32_t, std::uint32_t> taken;
  for (std::size_t i = first; i < first + count; ++i) {
    auto& triangle = part.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = mesh.triangles[i][k];
      const auto [found, is_new] = taken.emplace(vertex, static_cast<std::uint32_t>(part.vertices.size()));
      if (is_new) part.vertices.push_back(mesh.vertices[vertex]);
      triangle[k] = found->second;
    }
    if (!mesh.places.empty()) part.places.push_back(mesh.places[i]);
  }
  const bool all_have_places = std::ranges::all_of(part.places, [](const auto& places) {
    return std::ranges::all_of(places, [](TexturePlace at) { return std::isfinite(at.u) && std::isfinite(at.v); });
  });
  if (!all_have_places) part.places.clear();
  return part;
}

Vec3d turnedUp(Vec3d p, Up up) {
  switch (up) {
    case Up::MinusY:
      break;
    case Up::Y:
      return {p.x, -p.y, -p.z};
    case Up::Z:
      return {p.x, -p.z, p.y};
  }
  return p;
}

MaterialSpec materialOf(const meshes::Surface& surface) {
  const auto& [red, green, blue] = surface.base_color;
  MaterialSpec material;
  material.name = surface.name;
  material.albedo = (red + green + blue) / 3.0;
  material.color = {red, green, blue};
  material.roughness = std::clamp(surface.roughness, 0.02, 1.0);
  material.index = surface.index;
  material.model = surface.metallic >= 0.5    ? Reflection::RoughMetal
                   : surface.roughness >= 1.0 ? Reflection::Lambertian
                                              : Reflection::RoughDielectric;
  if (surface.picture.isThere()) {
    material.texture = surface.picture.file.empty() ? "(in the mesh file)" : surface.picture.file.string();
    material.texture_coding = TextureCoding::Srgb;
  }
  return material;
}

Result<std::vector<std::string>> readMeshes(SceneFile& file, const SceneLoading& how) {
  return MeshLoading{file, how}.run();
}

}  // namespace toftwin::sim
