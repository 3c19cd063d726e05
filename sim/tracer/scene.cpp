// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/scene.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "protocol/settings/describe.h"
#include "sim/tracer/hit.h"
#include "sim/tracer/image_file.h"
#include "sim/tracer/mesh.h"
#include "sim/tracer/pairs.h"
#include "sim/tracer/pose.h"
#include "sim/tracer/scene_embree.h"
#include "sim/tracer/scene_file.h"
#include "sim/tracer/scene_impl.h"
#include "sim/tracer/scene_meshes.h"

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

/// In its own frame, scaled.
Quadric quadricOf(const ObjectSpec& spec) {
  Quadric quadric;
  quadric.kind = spec.shape == Shape::Sphere ? Quadric::Kind::Sphere
                 : spec.shape == Shape::Disc ? Quadric::Kind::Disc
                                             : Quadric::Kind::Cylinder;
  quadric.radius = spec.radius.in(metre)*spec.scale;
  if (spec.shape == Shape::Cylinder) quadric.half_height = spec.height.in(metre)*spec.scale / 2.0;
  quadric.axes = {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}};
  return quadric;
}

struct Box {
  Vec3d lower{INFINITY, INFINITY, INFINITY};
  Vec3d upper{-INFINITY, -INFINITY, -INFINITY};
  void include(Vec3d p) {
    lower = {std::min(lower.x, p.x), std::min(lower.y, p.y), std::min(lower.z, p.z)};
    upper = {std::max(upper.x, p.x), std::max(upper.y, p.y), std::max(upper.z, p.z)};
  }
};

TriangleMesh meshOf(const PlacedObject& object) {
  const auto& spec = object.spec;
  if (spec.shape == Shape::Rectangle) return rectangleMesh(spec.size_m[0], spec.size_m[1]);
  if (spec.shape == Shape::Box) return boxMesh(spec.size_m[0], spec.size_m[1], spec.size_m[2]);
  return *object.triangles;
}

/// The materials' colours instead of their infrared albedo.
void showIn(Band band, std::vector<MaterialSpec>& materials) {
  if (band == Band::Infrared) return;
  const std::size_t channel = band == Band::Red ? 0 : band == Band::Green ? 1 : 2;
  for (MaterialSpec& material : materials) {
    if (!material.color.empty()) material.albedo = material.color[channel];
  }
}

Result<Image<float>> pictureOf(const NamedFile& file) {
  auto picture = file.bytes.empty() ? loadGrey(file.path) : decodeGrey(file.bytes, "of a mesh file");
  if (!picture)
    return Error{picture.error().code, fmt::format("{}: {}", file.place, picture.error().message)};
  return picture;
}

}  // namespace

Scene::Impl::~Impl() {
  if (loaded != nullptr) return;  // the rest is that one's
  for (const Mover& mover : movers) {
    if (mover.embree != nullptr) rtcReleaseScene(mover.embree);
  }
  if (still != nullptr) rtcReleaseScene(still);
  if (device != nullptr) rtcReleaseDevice(device);
}

const std::string& Scene::id() const { return impl_->id; }
const std::vector<std::string>& Scene::notes() const { return impl_->notes; }
const std::vector<ForeignEmitterSpec>& Scene::foreignEmitters() const { return impl_->foreign_emitters; }

/// The steps from a checked file to a built scene.
struct SceneBuilder {
  SceneBuilder(const SceneFile& f, const SceneLoading& h) : file(f), how(h) {}

  const SceneFile& file;  ///< with its meshes read
  const SceneLoading& how;
  std::vector<TriangleMesh> meshes;  ///< in their own frames, scaled; empty for quadrics
  Hash hash;
  std::shared_ptr<Scene::Impl> scene = std::make_shared<Scene::Impl>();

  Result<> takeMeshes() {
    for (const PlacedObject& object : file.objects) {
      TriangleMesh& mesh = meshes.emplace_back();
      hash.addSettings(object.spec, {"name", "mesh", "unit", "up"});  // the last two change vertices
      for (const KeyframeSpec& frame : object.spec.keyframes) hash.addSettings(frame);
      if (isQuadric(object.spec.shape)) continue;
      mesh = meshOf(object);
      hash.add(mesh.vertices.data(), mesh.vertices.size() * sizeof(mesh.vertices[0]));
      hash.add(mesh.triangles.data(), mesh.triangles.size() * sizeof(mesh.triangles[0]));
      for (Vec3d& v : mesh.vertices) v = v * object.spec.scale;
      const NamedFile& texture = file.textures[*object.material];
      if (!texture.isThere()) {
        mesh.places.clear();
        continue;
      }
      hash.add(mesh.places.data(), mesh.places.size() * sizeof(mesh.places[0]));
      if (mesh.places.empty()) {
        return Error{Error::Code::InvalidArgument,
                     fmt::format("{}: material \"{}\" has a texture, but mesh {} has no texture coordinates",
                                 object.place, file.spec.materials[*object.material].name, object.mesh.string())};
      }
    }
    return {};
  }

  Result<> loadMaterials() {
    for (std::size_t i = 0; i < file.spec.materials.size(); ++i) {
      const MaterialSpec& spec = file.spec.materials[i];
      hash.addSettings(spec, {"texture"});
      Material material = materialOf(spec);
      if (!isMatt(spec.model)) {
        scene->models.push_back(bsdfOf(spec));
        material.special = static_cast<std::uint16_t>(scene->models.size());
        scene->has_glass |= spec.model == Reflection::ThinGlass;
      }
      if (file.textures[i].isThere()) {
        auto picture = pictureOf(file.textures[i]);
        if (!picture) return picture.error();
        for (float& value : picture->pixels()) {
          value = std::min(1.0f, spec.texture_coding == TextureCoding::Srgb ? linearOfSrgb(value) : value);
        }
        hash.add(picture->pixels().data(), picture->size() * sizeof(float));
        scene->textures.push_back(std::make_shared<const Texture>(*std::move(picture)));
        material.texture = static_cast<std::uint16_t>(scene->textures.size());
      }
      scene->materials.push_back(material);
    }
    return {};
  }

  Result<> loadSurroundings() {
    const AmbientSpec& ambient = file.spec.ambient;
    hash.addSettings(ambient, {"map"});
    for (const ForeignEmitterSpec& emitter : file.spec.foreign_emitters) hash.addSettings(emitter, {"name"});
    scene->foreign_emitters = file.spec.foreign_emitters;
    scene->ambient_radiance = static_cast<float>(ambient.radiance);
    Image<float> map;
    if (!file.map.path.empty()) {
      auto picture = pictureOf(file.map);
      if (!picture) return picture.error();
      map = *std::move(picture);
      for (float& value : map.pixels()) value *= static_cast<float>(ambient.map_radiance);
      hash.add(map.pixels().data(), map.size() * sizeof(float));
    }
    const Vec3d up = normalised(vec3Of(ambient.up)), ahead = vec3Of(ambient.ahead);
    Environment environment{
        std::move(map),
        up,
        normalised(ahead - up * dot(up, ahead)),
        {normalised(vec3Of(ambient.sun_towards)), ambient.sun.in(kilolux)*ambient.sun_irradiance_per_klx}};
    if (!environment.isDark())
      scene->environment = std::make_shared<const Environment>(std::move(environment));
    scene->is_matt = scene->models.empty() && scene->textures.empty() && scene->environment == nullptr;
    return {};
  }

  void chooseOrigin() {
    Box box;
    for (std::size_t i = 0; i < file.objects.size(); ++i) {
      const Transform<World, Object>& pose = file.objects[i].world_from_object;
      for (const Vec3d& v : meshes[i].vertices) box.include((pose * Point<Object>{v}).m);
      if (isQuadric(file.objects[i].spec.shape)) box.include(pose.translation_m);
    }
    scene->origin_in_world = (box.lower + box.upper) / 2.0;
    if (const double diagonal = norm(box.upper - box.lower); diagonal > 0.0) scene->diagonal_m = diagonal;
  }

  /// An object in its own frame, without planes.
  BuiltObject ownOf(std::size_t i) {
    BuiltObject object;
    object.material = *file.objects[i].material;
    if (isQuadric(file.objects[i].spec.shape)) object.quadric = quadricOf(file.objects[i].spec);
    object.vertices = std::move(meshes[i].vertices);
    object.triangles = std::move(meshes[i].triangles);
    object.places = std::move(meshes[i].places);
    object.is_paired = areInPairs(object.vertices, object.triangles);
    if (const auto special = scene->materials[object.material].special; special != 0) {
      object.glass = std::get_if<bsdf::ThinGlass>(&scene->models[special - 1]);
    }
    return object;
  }

  void placeObjects() {
    for (std::size_t i = 0; i < file.objects.size(); ++i) {
      BuiltObject& object = scene->owned.emplace_back(ownOf(i));
      scene->objects.emplace_back(object);
      scene->numbers.push_back(static_cast<std::int32_t>(file.objects[i].number));
      Transform<World, Object> pose = file.objects[i].world_from_object;
      pose.translation_m = pose.translation_m - scene->origin_in_world;
      if (!file.objects[i].motion.isStill()) {
        addPlanes(object);
        scene->movers.push_back({i, file.objects[i].motion, file.objects[i].world_from_object, reachOf(object)});
        continue;
      }
      moveInto(object, pose);
      addPlanes(object);
      if (!object.is_paired) continue;
      scene->still_pairs.resize(file.objects.size() + 1);
      scene->still_pairs[i] = 1;
    }
  }

  /// Still objects' triangles, if there is nothing else and they are few.
  void takeFew(const std::vector<NumberedObject>& still) {
    std::vector<FewTriangle> few;
    for (const auto& [id, object] : still) {
      if (object->triangles.empty() || object->glass != nullptr || few.size() + object->triangles.size() > kFewTriangles)
        return;
      for (std::uint32_t i = 0; i < object->triangles.size(); ++i) {
        const auto& [a, b, c] = object->triangles[i];
        few.push_back(fewTriangle(object->vertices[a], object->vertices[b], object->vertices[c], id, i));
      }
    }
    scene->still_few = std::move(few);
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
    std::vector<NumberedObject> still;
    for (std::size_t i = 0; i < scene->objects.size(); ++i) {
      if (file.objects[i].motion.isStill())
        still.push_back({static_cast<unsigned>(i), &scene->objects[i].get()});
    }
    const Error stopped{Error::Code::Stopped, "asked to stop while building a scene"};
    scene->still = makeEmbreeScene(scene->device, still, how.stop);
    if (how.stop.stop_requested()) return stopped;
    takeFew(still);
    for (Mover& mover : scene->movers) {
      const BuiltObject& object = scene->objects[mover.object];
      mover.embree = makeEmbreeScene(scene->device, {{static_cast<unsigned>(mover.object), &object}}, how.stop);
      if (how.stop.stop_requested()) return stopped;
      RTCBounds box;
      rtcGetSceneBounds(mover.embree, &box);
      mover.radius = radiusOf(object, box);
      if (object.glass == nullptr) mover.hides = hidesOf(mover.embree, box, mover.radius);
      const std::size_t quadrangles = object.triangles.size() / (object.is_paired ? 2 : 1);
      if (quadrangles > 0 && quadrangles <= CoherentTree::kMostQuadrangles && object.glass == nullptr)
        mover.tree = std::make_shared<const CoherentTree>(object.vertices, object.triangles, object.is_paired);
    }
    placeMovers(*scene, *scene, {});
    if (const RTCError error = rtcGetDeviceError(scene->device); error != RTC_ERROR_NONE) {
      return Error{Error::Code::Internal,
                   fmt::format("Embree could not build the scene (error {})", static_cast<int>(error))};
    }
    return {};
  }

  static Result<Scene> build(Result<SceneFile> file, Band band, const SceneLoading& how) {
    if (!file) return file.error();
    auto notes = readMeshes(*file, how);
    if (!notes) return notes.error();
    showIn(band, file->spec.materials);
    SceneBuilder builder{*file, how};
    builder.scene->notes = *std::move(notes);
    if (auto loaded = builder.loadMaterials(); !loaded) return loaded.error();
    if (auto taken = builder.takeMeshes(); !taken) return taken.error();
    if (auto loaded = builder.loadSurroundings(); !loaded) return loaded.error();
    builder.scene->id = builder.hash.hex();
    builder.chooseOrigin();
    builder.placeObjects();
    if (auto built = builder.buildEmbree(); !built) return built.error();
    return Scene{std::move(builder.scene)};
  }
};

Result<Scene> Scene::load(const std::filesystem::path& file, Band band, const SceneLoading& how) {
  return SceneBuilder::build(loadSceneFile(file, how), band, how);
}

Result<Scene> Scene::parse(std::string_view toml, const std::filesystem::path& name, Band band, const SceneLoading& how) {
  return SceneBuilder::build(parseSceneFile(toml, name), band, how);
}

}  // namespace toftwin::sim
