// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <sdf/Box.hh>
#include <sdf/Console.hh>
#include <sdf/Cylinder.hh>
#include <sdf/Geometry.hh>
#include <sdf/Link.hh>
#include <sdf/Material.hh>
#include <sdf/Mesh.hh>
#include <sdf/Model.hh>
#include <sdf/ParserConfig.hh>
#include <sdf/Pbr.hh>
#include <sdf/Plane.hh>
#include <sdf/Root.hh>
#include <sdf/Sphere.hh>
#include <sdf/Visual.hh>
#include <sdf/World.hh>

#include <algorithm>

#include "sim/worlds/world.h"

namespace toftwin::sim::worlds {
namespace {

using Pose = ignition::math::Pose3d;

constexpr const char* kModel = "model://";

Transform<World, Object> transformOf(const Pose& pose) {
  const auto& q = pose.Rot();
  const auto& p = pose.Pos();
  return {{q.W(), q.X(), q.Y(), q.Z()}, {p.X(), p.Y(), p.Z()}};
}

/// What libsdformat found, a line each.
std::string textOf(const sdf::Errors& errors) {
  std::string text;
  for (const sdf::Error& error : errors) text += (text.empty() ? "" : "\n") + error.Message();
  return text.substr(0, 2'000);
}

class SdfReader {
 public:
  SdfReader(const std::filesystem::path& file, const WorldOptions& options)
      : file_(std::filesystem::absolute(file)),
        search_(searchFolders(options.search,
                              {"GZ_SIM_RESOURCE_PATH", "IGN_GAZEBO_RESOURCE_PATH", "SDF_PATH", "GAZEBO_MODEL_PATH"}, file)) {}

  Result<WorldFile> read() {
    sdf::Console::Instance()->SetQuiet(true);  // its errors are returned
    sdf::ParserConfig config;
    config.SetFindCallback([this](const std::string& uri) { return fileOf(uri, kModel, file_.parent_path(), search_).string(); });
    sdf::Root root;
    const sdf::Errors errors = root.Load(file_.string(), config);
    if (!errors.empty()) return wrong(textOf(errors));
    for (std::uint64_t w = 0; w < root.WorldCount(); ++w) {
      const sdf::World& world = *root.WorldByIndex(w);
      for (std::uint64_t m = 0; m < world.ModelCount(); ++m) addModel(*world.ModelByIndex(m), {}, "");
      if (world.LightCount() > 0) found_.notes.emplace_back("its lights are left out: [ambient] in the file beside it gives light");
    }
    if (root.Model() != nullptr) addModel(*root.Model(), {}, "");
    if (!missing_.empty()) return wrong(missing_);
    if (found_.things.empty()) return wrong("it has no visual that can be shown");
    return std::move(found_);
  }

 private:
  template <class Part>
  Pose poseOf(const Part& part) {
    Pose pose = part.RawPose();
    const sdf::Errors errors = part.SemanticPose().Resolve(pose);
    if (!errors.empty()) missing_ += textOf(errors) + "\n";
    return pose;
  }

  void addModel(const sdf::Model& model, const Pose& world_from_parent, const std::string& above) {
    const Pose world_from_model = world_from_parent * poseOf(model);
    const std::string name = above + model.Name() + "::";
    for (std::uint64_t l = 0; l < model.LinkCount(); ++l) {
      const sdf::Link& link = *model.LinkByIndex(l);
      const Pose world_from_link = world_from_model * poseOf(link);
      for (std::uint64_t v = 0; v < link.VisualCount(); ++v) {
        const sdf::Visual& visual = *link.VisualByIndex(v);
        addVisual(visual, world_from_link * poseOf(visual), name + link.Name() + "::" + visual.Name());
      }
    }
    for (std::uint64_t m = 0; m < model.ModelCount(); ++m) addModel(*model.ModelByIndex(m), world_from_model, name);
  }

  void addVisual(const sdf::Visual& visual, const Pose& pose, const std::string& name) {
    Thing thing;
    thing.name = name;
    thing.world_from_thing = transformOf(pose);
    if (visual.Transparency() >= 1.0 || visual.Geom() == nullptr) return;
    if (!setShape(*visual.Geom(), thing)) return;
    if (visual.Material() != nullptr) setSurface(*visual.Material(), thing);
    found_.things.push_back(std::move(thing));
  }

  /// False after a note for shapes that are not built.
  bool setShape(const sdf::Geometry& geometry, Thing& thing) {
    const auto vec = [](const ignition::math::Vector3d& v) { return Vec3d{v.X(), v.Y(), v.Z()}; };
    if (const sdf::Box* box = geometry.BoxShape()) {
      thing.shape = Shape::Box;
      thing.size_m = vec(box->Size());
    } else if (const sdf::Sphere* sphere = geometry.SphereShape()) {
      thing.shape = Shape::Sphere;
      thing.radius_m = sphere->Radius();
    } else if (const sdf::Cylinder* cylinder = geometry.CylinderShape()) {
      thing.shape = Shape::Cylinder;
      thing.radius_m = cylinder->Radius();
      thing.height_m = cylinder->Length();
    } else if (const sdf::Plane* plane = geometry.PlaneShape()) {
      thing.shape = Shape::Plane;
      thing.size_m = {plane->Size().X(), plane->Size().Y(), 0.0};
      turnToNormal(vec(plane->Normal()), thing);
    } else if (const sdf::Mesh* mesh = geometry.MeshShape()) {
      thing.shape = Shape::Mesh;
      thing.mesh_scale = vec(mesh->Scale());
      const std::filesystem::path folder = std::filesystem::path{mesh->FilePath()}.parent_path();
      thing.mesh = fileOf(mesh->Uri(), kModel, folder.empty() ? file_.parent_path() : folder, search_);
      if (thing.mesh.empty())
        missing_ += fmt::format("{}: mesh \"{}\" is not there; model_path in {}.toml names folders of models\n", thing.name, mesh->Uri(),
                                file_.filename().string());
      if (!mesh->Submesh().empty())
        found_.notes.push_back(fmt::format("{}: all of its mesh is shown, not submesh \"{}\" alone", thing.name, mesh->Submesh()));
    } else {
      found_.notes.push_back(fmt::format("{}: its shape is neither box, sphere, cylinder, plane nor mesh, and is left out", thing.name));
      return false;
    }
    return true;
  }

  /// A plane's own frame has its normal along z; a rectangle of ours, too.
  static void turnToNormal(Vec3d normal, Thing& thing) {
    const Vec3d z{0, 0, 1}, axis = cross(z, normal);
    if (norm(axis) < 1e-9) return;
    const double angle = std::atan2(norm(axis), dot(z, normal));
    thing.world_from_thing = thing.world_from_thing * rotation<Object, Object>(normalised(axis), angle);
  }

  void setSurface(const sdf::Material& material, Thing& thing) {
    thing.has_surface = true;
    meshes::Surface& surface = thing.surface;
    surface.name = thing.name;
    const auto& diffuse = material.Diffuse();
    const auto share = [](float value) { return std::clamp(static_cast<double>(value), 0.0, 1.0); };
    surface.base_color = {share(diffuse.R()), share(diffuse.G()), share(diffuse.B())};
    const sdf::Pbr* pbr = material.PbrMaterial();
    const sdf::PbrWorkflow* metal = pbr == nullptr ? nullptr : pbr->Workflow(sdf::PbrWorkflowType::METAL);
    if (metal == nullptr) return;
    surface.metallic = metal->MetalnessMap().empty() ? metal->Metalness() : 0.0;
    surface.roughness = metal->RoughnessMap().empty() ? metal->Roughness() : 0.5;
    if (metal->AlbedoMap().empty()) return;
    const std::filesystem::path folder = std::filesystem::path{material.FilePath()}.parent_path();
    surface.picture.file = fileOf(metal->AlbedoMap(), kModel, folder.empty() ? file_.parent_path() : folder, search_);
    if (surface.picture.file.empty() || thing.shape != Shape::Mesh) {
      found_.notes.push_back(fmt::format("{}: its picture \"{}\" is left out", thing.name, metal->AlbedoMap()));
      surface.picture = {};
    }
  }

  Error wrong(std::string_view what) const {
    return {Error::Code::InvalidArgument, fmt::format("{}: {}", file_.string(), what)};
  }

  const std::filesystem::path file_;
  const std::vector<std::filesystem::path> search_;
  WorldFile found_;
  std::string missing_;  ///< a line for each thing that is
};

}  // namespace

Result<WorldFile> readSdf(const std::filesystem::path& file, const WorldOptions& options) {
  std::error_code fault;
  if (!std::filesystem::is_regular_file(file, fault))
    return Error{Error::Code::NotFound, fmt::format("{}: there is no such file", file.string())};
  try {
    return SdfReader{file, options}.read();
  } catch (const std::exception& thrown) {
    return Error{Error::Code::Malformed, fmt::format("{}: libsdformat gave up: {}", file.string(), thrown.what())};
  }
}

}  // namespace toftwin::sim::worlds
