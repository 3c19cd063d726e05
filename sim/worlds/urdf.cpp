// SPDX-License-Identifier: Apache-2.0
#include <console_bridge/console.h>
#include <fmt/format.h>
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <fstream>
#include <mutex>
#include <sstream>

#include "sim/worlds/world.h"

namespace toftwin::sim::worlds {
namespace {

constexpr const char* kPackage = "package://";

/// What urdfdom logs, which says what is wrong; it returns only that something is.
class Listener final : public console_bridge::OutputHandler {
 public:
  Listener() : before_(console_bridge::getOutputHandler()) { console_bridge::useOutputHandler(this); }
  ~Listener() override { console_bridge::useOutputHandler(before_); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR && text_.size() < 2'000) text_ += (text_.empty() ? "" : "; ") + text;
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  console_bridge::OutputHandler* before_;
  std::string text_;
};

Vec3d vecOf(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

template <class To, class From>
Transform<To, From> transformOf(const urdf::Pose& pose) {
  const urdf::Rotation& q = pose.rotation;
  return {{q.w, q.x, q.y, q.z}, vecOf(pose.position)};
}

class UrdfReader {
 public:
  UrdfReader(const urdf::ModelInterface& model, const std::filesystem::path& file, const WorldOptions& options)
      : model_(model),
        file_(std::filesystem::absolute(file)),
        joints_(options.joints),
        search_(searchFolders(options.search, {"ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"}, file)) {}

  Result<WorldFile> read() {
    for (const auto& [name, position] : joints_) {
      if (!model_.joints_.contains(name)) wrong_ += fmt::format("there is no joint \"{}\"; there are: {}\n", name, namesOfJoints());
    }
    addLink(*model_.getRoot(), {});
    if (wrong_.empty() && found_.things.empty()) wrong_ = "no link has a visual";
    if (!wrong_.empty()) return Error{Error::Code::InvalidArgument, fmt::format("{}: {}", file_.string(), wrong_)};
    return std::move(found_);
  }

 private:
  /// urdfdom has checked that links are a tree.
  void addLink(const urdf::Link& link, const Transform<World, World>& world_from_link) {
    for (std::size_t v = 0; v < link.visual_array.size(); ++v) addVisual(link, *link.visual_array[v], v, world_from_link);
    for (const auto& joint : link.child_joints) {
      const auto child = model_.getLink(joint->child_link_name);
      if (!child) continue;
      addLink(*child, world_from_link * transformOf<World, World>(joint->parent_to_joint_origin_transform) * motionOf(*joint));
    }
  }

  /// What the joint's position does to its child; a mimic follows another joint.
  Transform<World, World> motionOf(const urdf::Joint& joint) {
    const double position = positionOf(joint, 0);
    const Vec3d axis = vecOf(joint.axis);
    Transform<World, World> motion;
    if (joint.type == urdf::Joint::PRISMATIC) motion.translation_m = axis * position;
    if ((joint.type == urdf::Joint::REVOLUTE || joint.type == urdf::Joint::CONTINUOUS) && norm(axis) > 0.0)
      motion = rotation<World, World>(normalised(axis), position);
    return motion;
  }

  double positionOf(const urdf::Joint& joint, int depth) {
    if (joint.mimic && depth < 32) {
      const auto of = model_.getJoint(joint.mimic->joint_name);
      return of ? joint.mimic->multiplier * positionOf(*of, depth + 1) + joint.mimic->offset : 0.0;
    }
    const auto set = joints_.find(joint.name);
    if (set == joints_.end()) return 0.0;
    const bool has_limits = joint.limits && joint.type != urdf::Joint::CONTINUOUS && joint.limits->lower < joint.limits->upper;
    if (joint.type == urdf::Joint::FIXED) wrong_ += fmt::format("joint \"{}\" is fixed and cannot be set\n", joint.name);
    if (has_limits && (set->second < joint.limits->lower || set->second > joint.limits->upper))
      wrong_ += fmt::format("joint \"{}\" = {} is beyond its limits, {} to {}\n", joint.name, set->second, joint.limits->lower,
                            joint.limits->upper);
    return set->second;
  }

  void addVisual(const urdf::Link& link, const urdf::Visual& visual, std::size_t number, const Transform<World, World>& world_from_link) {
    if (!visual.geometry) return;
    Thing thing;
    thing.name = link.name + "::" + (visual.name.empty() ? fmt::format("visual_{}", number) : visual.name);
    thing.world_from_thing = world_from_link * transformOf<World, Object>(visual.origin);
    setShape(*visual.geometry, thing);
    if (visual.material) {
      const urdf::Color& color = visual.material->color;
      const auto share = [](float value) { return std::clamp(static_cast<double>(value), 0.0, 1.0); };
      thing.has_surface = true;
      thing.surface.name = visual.material->name.empty() ? thing.name : visual.material->name;
      thing.surface.base_color = {share(color.r), share(color.g), share(color.b)};
      if (!visual.material->texture_filename.empty())
        found_.notes.push_back(fmt::format("{}: its picture \"{}\" is left out", thing.name, visual.material->texture_filename));
    }
    found_.things.push_back(std::move(thing));
  }

  void setShape(const urdf::Geometry& geometry, Thing& thing) {
    switch (geometry.type) {
      case urdf::Geometry::SPHERE:
        thing.shape = Shape::Sphere;
        thing.radius_m = static_cast<const urdf::Sphere&>(geometry).radius;
        break;
      case urdf::Geometry::BOX:
        thing.shape = Shape::Box;
        thing.size_m = vecOf(static_cast<const urdf::Box&>(geometry).dim);
        break;
      case urdf::Geometry::CYLINDER:
        thing.shape = Shape::Cylinder;
        thing.radius_m = static_cast<const urdf::Cylinder&>(geometry).radius;
        thing.height_m = static_cast<const urdf::Cylinder&>(geometry).length;
        break;
      case urdf::Geometry::MESH: {
        const auto& mesh = static_cast<const urdf::Mesh&>(geometry);
        thing.shape = Shape::Mesh;
        thing.mesh_scale = vecOf(mesh.scale);
        thing.mesh = fileOf(mesh.filename, kPackage, file_.parent_path(), search_);
        if (thing.mesh.empty())
          wrong_ += fmt::format("{}: mesh \"{}\" is not there; package_path in {}.toml names folders of packages\n", thing.name,
                                mesh.filename, file_.filename().string());
      }
    }
  }

  [[nodiscard]] std::string namesOfJoints() const {
    std::string names;
    for (const auto& [name, joint] : model_.joints_) names += (names.empty() ? "" : ", ") + name;
    return names.empty() ? "none" : names;
  }

  const urdf::ModelInterface& model_;
  const std::filesystem::path file_;
  const std::map<std::string, double>& joints_;
  const std::vector<std::filesystem::path> search_;
  WorldFile found_;
  std::string wrong_;  ///< a line for each thing that is
};

}  // namespace

Result<WorldFile> readUrdf(const std::filesystem::path& file, const WorldOptions& options) {
  std::ifstream in{file, std::ios::binary};
  std::ostringstream text;
  if (!in || !(text << in.rdbuf()))
    return Error{Error::Code::NotFound, fmt::format("{}: there is no such file, or it cannot be read", file.string())};
  static std::mutex one_at_a_time;  // urdfdom's log is one for the whole process
  const std::lock_guard lock{one_at_a_time};
  const Listener listener;
  try {
    const auto model = urdf::parseURDF(text.str());
    if (!model || !model->getRoot())
      return Error{Error::Code::Malformed, fmt::format("{}: this is no URDF: {}", file.string(),
                                                       listener.text().empty() ? "it has no root link" : listener.text())};
    return UrdfReader{*model, file, options}.read();
  } catch (const std::exception& thrown) {
    return Error{Error::Code::Malformed, fmt::format("{}: urdfdom gave up: {}", file.string(), thrown.what())};
  }
}

}  // namespace toftwin::sim::worlds
