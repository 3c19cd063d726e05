// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/scene.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <span>

#include "protocol/settings/describe.h"
#include "sim/tracer/hit.h"
#include "sim/tracer/mesh.h"
#include "sim/tracer/quadric_embree.h"
#include "sim/tracer/scene_file.h"
#include "sim/tracer/scene_impl.h"

namespace toftwin::sim {
namespace {

/// SHA-256 over what is added.
class Hash {
 public:
  Hash() { EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr); }
  void add(const void* bytes, std::size_t size) { EVP_DigestUpdate(context_.get(), bytes, size); }
  void add(const std::string& text) { add(text.c_str(), text.size() + 1); }
  template <class Aggregate>
  void addSettings(const Aggregate& aggregate, std::initializer_list<std::string_view> except = {}) {
    for (const settings::Key& key : settings::keysOf(aggregate)) {
      if (std::find(except.begin(), except.end(), key.name) == except.end()) add(key.name + "=" + key.value);
    }
  }
  /// The first 128 bits, as 32 hex digits.
  std::string hex() {
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned size = 0;
    EVP_DigestFinal_ex(context_.get(), digest.data(), &size);
    std::string text;
    for (std::size_t i = 0; i < 16; ++i) text += fmt::format("{:02x}", digest[i]);
    return text;
  }

 private:
  struct Free {
    void operator()(EVP_MD_CTX* context) const { EVP_MD_CTX_free(context); }
  };
  std::unique_ptr<EVP_MD_CTX, Free> context_{EVP_MD_CTX_new()};
};

bool isQuadric(Shape shape) {
  return shape == Shape::Sphere || shape == Shape::Disc || shape == Shape::Cylinder;
}

Quadric quadricOf(const PlacedObject& object, Vec3d origin_in_world) {
  const ObjectSpec& spec = object.spec;
  Quadric quadric;
  quadric.kind = spec.shape == Shape::Sphere ? Quadric::Kind::Sphere
                 : spec.shape == Shape::Disc ? Quadric::Kind::Disc
                                             : Quadric::Kind::Cylinder;
  quadric.radius = spec.radius.in(metre) * spec.scale;
  quadric.centre = object.world_from_object.translation_m - origin_in_world;
  if (spec.shape == Shape::Cylinder) quadric.half_height = spec.height.in(metre) * spec.scale / 2.0;
  quadric.axes = {object.world_from_object.rotate({1, 0, 0}), object.world_from_object.rotate({0, 1, 0}),
                  object.world_from_object.rotate({0, 0, 1})};
  return quadric;
}

/// Stands for a quadric among the triangles: every ray counts as next to its edge, where the tracer
/// looks more closely.
constexpr TrianglePlane kNoTriangle{.normal = {0, 0, 1}, .level = 0.0, .offset = 0.0f, .margin = 0.0f, .margin_share = INFINITY};

struct Box {
  Vec3d lower{INFINITY, INFINITY, INFINITY};
  Vec3d upper{-INFINITY, -INFINITY, -INFINITY};
  void include(Vec3d p) {
    lower = {std::min(lower.x, p.x), std::min(lower.y, p.y), std::min(lower.z, p.z)};
    upper = {std::max(upper.x, p.x), std::max(upper.y, p.y), std::max(upper.z, p.z)};
  }
};

Result<TriangleMesh> meshOf(const PlacedObject& object) {
  const auto& spec = object.spec;
  if (spec.shape == Shape::Rectangle) return rectangleMesh(spec.size_m[0], spec.size_m[1]);
  if (spec.shape == Shape::Box) return boxMesh(spec.size_m[0], spec.size_m[1], spec.size_m[2]);
  auto mesh = loadMesh(object.mesh);
  if (!mesh) return Error{mesh.error().code, fmt::format("{}: {}", object.place, mesh.error().message)};
  return mesh;
}

RTCGeometry makeTriangleGeometry(RTCDevice device, const BuiltObject& object) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  // Embree owns its copy: a shared buffer would need 16 bytes of padding behind the last vertex.
  auto* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           3 * sizeof(float), object.vertices.size());
  std::ranges::transform(object.vertices, static_cast<std::array<float, 3>*>(vertices), [](const Vec3d& v) {
    return std::array{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
  });
  auto* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            3 * sizeof(std::uint32_t), object.triangles.size());
  std::ranges::copy(object.triangles, static_cast<std::array<std::uint32_t, 3>*>(triangles));
  return geometry;
}

}  // namespace

Scene::Impl::~Impl() {
  if (embree != nullptr) rtcReleaseScene(embree);
  if (device != nullptr) rtcReleaseDevice(device);
}

const std::string& Scene::id() const { return impl_->id; }

/// The steps from a checked file to a built scene.
struct SceneBuilder {
  explicit SceneBuilder(const SceneFile& f) : file(f) {}

  const SceneFile& file;
  std::vector<TriangleMesh> meshes;  ///< in the world; empty for quadrics
  std::shared_ptr<Scene::Impl> scene = std::make_shared<Scene::Impl>();

  Result<> loadMeshes() {
    for (const PlacedObject& object : file.objects) {
      TriangleMesh& placed = meshes.emplace_back();
      if (isQuadric(object.spec.shape)) continue;
      auto mesh = meshOf(object);
      if (!mesh) return mesh.error();
      placed = *std::move(mesh);
      for (Vec3d& v : placed.vertices) {
        v = (object.world_from_object * Point<Object>{v * object.spec.scale}).m;
      }
    }
    return {};
  }

  void hash() {
    Hash all;
    for (const MaterialSpec& material : file.spec.materials) all.addSettings(material);
    for (std::size_t i = 0; i < file.objects.size(); ++i) {
      all.addSettings(file.objects[i].spec, {"name", "mesh"});
      const TriangleMesh& mesh = meshes[i];
      all.add(mesh.vertices.data(), mesh.vertices.size() * sizeof(mesh.vertices[0]));
      all.add(mesh.triangles.data(), mesh.triangles.size() * sizeof(mesh.triangles[0]));
    }
    all.addSettings(file.spec.ambient);
    scene->id = all.hex();
  }

  void chooseOrigin() {
    Box box;
    for (std::size_t i = 0; i < file.objects.size(); ++i) {
      for (const Vec3d& v : meshes[i].vertices) box.include(v);
      if (isQuadric(file.objects[i].spec.shape)) box.include(file.objects[i].world_from_object.translation_m);
    }
    scene->origin_in_world = (box.lower + box.upper) / 2.0;
  }

  void placeObjects() {
    for (const MaterialSpec& material : file.spec.materials) scene->materials.push_back(materialOf(material));
    scene->ambient_radiance = static_cast<float>(file.spec.ambient.radiance);
    for (std::size_t i = 0; i < file.objects.size(); ++i) {
      BuiltObject& object = scene->objects.emplace_back();
      object.material = file.objects[i].material;
      if (isQuadric(file.objects[i].spec.shape)) {
        object.quadric = quadricOf(file.objects[i], scene->origin_in_world);
      }
      object.vertices = std::move(meshes[i].vertices);
      for (Vec3d& v : object.vertices) v = v - scene->origin_in_world;
      object.triangles = std::move(meshes[i].triangles);
      for (const auto& [a, b, c] : object.triangles) {
        object.planes.push_back(planeOf(object.vertices[a], object.vertices[b], object.vertices[c]));
      }
    }
    for (const BuiltObject& object : scene->objects) {
      scene->rows.push_back({.planes = object.planes.empty() ? &kNoTriangle : object.planes.data(),
                             .material = scene->materials[object.material]});
    }
    scene->rows.push_back({.planes = &kNoTriangle, .material = {.albedo = 0.0f}});
  }

  Result<> buildEmbree() {
#if defined(__SANITIZE_THREAD__)
    scene->device = rtcNewDevice("threads=1");  // it cannot see how Embree's threads synchronise
#else
    scene->device = rtcNewDevice(nullptr);
#endif
    if (scene->device == nullptr) {
      return Error{Error::Code::Internal, fmt::format("Embree refused to start (error {})",
                                                      static_cast<int>(rtcGetDeviceError(nullptr)))};
    }
    scene->embree = rtcNewScene(scene->device);
    // Robust: rays through a shared edge or a rectangle's diagonal meet one of the two triangles.
    rtcSetSceneFlags(scene->embree, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene->embree, RTC_BUILD_QUALITY_MEDIUM);
    for (std::size_t i = 0; i < scene->objects.size(); ++i) {
      const BuiltObject& object = scene->objects[i];
      RTCGeometry geometry = object.triangles.empty() ? makeQuadricGeometry(scene->device, object.quadric)
                                                      : makeTriangleGeometry(scene->device, object);
      rtcCommitGeometry(geometry);
      rtcAttachGeometryByID(scene->embree, geometry, static_cast<unsigned>(i));
      rtcReleaseGeometry(geometry);
    }
    rtcCommitScene(scene->embree);
    if (const RTCError error = rtcGetDeviceError(scene->device); error != RTC_ERROR_NONE) {
      return Error{Error::Code::Internal,
                   fmt::format("Embree could not build the scene (error {})", static_cast<int>(error))};
    }
    return {};
  }

  static Result<Scene> build(const Result<SceneFile>& file) {
    if (!file) return file.error();
    SceneBuilder builder{*file};
    if (auto loaded = builder.loadMeshes(); !loaded) return loaded.error();
    builder.hash();
    builder.chooseOrigin();
    builder.placeObjects();
    if (auto built = builder.buildEmbree(); !built) return built.error();
    return Scene{std::move(builder.scene)};
  }
};

Result<Scene> Scene::load(const std::filesystem::path& file) { return SceneBuilder::build(loadSceneFile(file)); }

Result<Scene> Scene::parse(std::string_view toml, const std::filesystem::path& name) {
  return SceneBuilder::build(parseSceneFile(toml, name));
}

}  // namespace toftwin::sim
