// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

#include "calib/compare/json.h"
#include "protocol/settings/describe.h"
#include "protocol/types/counted.h"
#include "sim/pictures/png.h"
#include "sim/tracer/lens.h"
#include "sim/tracer/objects.h"
#include "sim/tracer/scene_summary.h"
#include "sim/tracer/trace.h"
#include "tools/cli/command.h"
#include "tools/cli/export/atomic_file.h"
#include "tools/cli/pose.h"

namespace toftwin::cli {
namespace scene_command {

using compare::Json;

struct Options {
  std::string action, file, picture;
  bool json = false;
};

/// The word that a scene file has for a choice.
template <class Spec>
std::string wordOf(const Spec& spec, std::string_view key) {
  for (const settings::Key& one : settings::keysOf(spec)) {
    if (one.name == key) return one.value.substr(1, one.value.size() - 2);  // without its quotes
  }
  return {};
}

std::string shapeOf(sim::Shape shape) {
  sim::ObjectSpec spec;
  spec.shape = shape;
  return wordOf(spec, "shape");
}

std::string sizeOf(Vec3d lower, Vec3d upper) {
  const Vec3d size = upper - lower;
  return fmt::format("{:.4g} x {:.4g} x {:.4g} m", size.x, size.y, size.z);
}

/// A camera outside of the scene that sees all of it, from above and in front.
struct View {
  CameraInfo camera;
  Transform<World, Camera> pose;
};

Result<View> viewOf(const sim::SceneSummary& scene) {
  constexpr int kWidth = 640, kHeight = 480;
  constexpr double kHalfAngle = 0.4;  // of the narrower side, rad
  const double focal = kHeight / 2.0 / std::tan(kHalfAngle);
  const CameraInfo camera{.width = kWidth,
                          .height = kHeight,
                          .fx = focal,
                          .fy = focal,
                          .cx = (kWidth - 1) / 2.0,
                          .cy = (kHeight - 1) / 2.0,
                          .distortion = {},
                          .calibration_id = {}};
  const Vec3d lower = scene.lower(), upper = scene.upper(), middle = (lower + upper) / 2.0, up = scene.up;
  const Vec3d axis = normalised(scene.ahead - up * 0.6 + cross(scene.ahead, up) * 0.4);  // where it looks
  const double radius = std::max(norm(upper - lower) / 2.0, 1e-6);
  const Vec3d from = middle - axis * (radius / std::sin(kHalfAngle));
  auto pose = lookFrom({from.x, from.y, from.z}, {middle.x, middle.y, middle.z}, {up.x, up.y, up.z});
  if (!pose) return pose.error();
  return View{camera, *pose};
}

/// Each object in a colour of its own, darker where its surface is seen at an angle.
cv::Mat pictureOf(const sim::Scene& scene, const View& view) {
  sim::TraceRequest request;
  request.camera = view.camera;
  request.world_from_camera = view.pose;
  request.samples_per_pixel = 1;
  request.max_surfaces = 1;
  request.pixel_extent = 0.0;
  const sim::Light light = sim::trace(scene, request);
  const auto objects = sim::objectsSeen(scene, view.camera, view.pose);
  cv::Mat picture(view.camera.height, view.camera.width, CV_8UC3, cv::Scalar::all(255));
  for (int v = 0; v < picture.rows; ++v) {
    for (int u = 0; u < picture.cols; ++u) {
      if (objects(u, v) < 0) continue;
      const auto normal = light.truth.normal(u, v);
      const Vec3d n{static_cast<double>(normal.x), static_cast<double>(normal.y), static_cast<double>(normal.z)};
      const double facing = std::abs(dot(n, rayThroughPixel(view.camera, u, v).v)), hue = objects(u, v) * std::numbers::phi;
      for (int c = 0; c < 3; ++c) {
        const double part = 0.65 + 0.35 * std::cos(2.0 * std::numbers::pi * (hue + c / 3.0));
        picture.at<cv::Vec3b>(v, u)[c] = static_cast<std::uint8_t>(255.0 * part * (0.25 + 0.75 * (std::isfinite(facing) ? facing : 1.0)));
      }
    }
  }
  return picture;
}

Result<> draw(const Options& options, const sim::SceneSummary& summary, const sim::SceneLoading& how) {
  const auto scene = sim::Scene::load(options.file, sim::Band::Infrared, how);
  if (!scene) return scene.error();
  const auto view = viewOf(summary);
  if (!view) return view.error();
  if (auto written = writeWhole(options.picture, pictures::encodePng(pictureOf(*scene, *view))); !written) return written;
  if (!options.json) fmt::print("{}: a colour for each object, seen from outside\n", options.picture);
  return {};
}

void printText(const Options& options, const sim::SceneSummary& scene) {
  const Vec3d lower = scene.lower(), upper = scene.upper();
  fmt::print("{}: {}, {}, {}\nx {:.4g} to {:.4g} m, y {:.4g} to {:.4g} m, z {:.4g} to {:.4g} m\n\n", options.file,
             counted(scene.objects.size(), "object"), counted(scene.triangles(), "triangle"), sizeOf(lower, upper), lower.x, upper.x,
             lower.y, upper.y, lower.z, upper.z);
  std::size_t widest = 8;
  for (const auto& object : scene.objects) widest = std::max(widest, std::min<std::size_t>(object.name.size(), 48));
  for (const auto& object : scene.objects) {
    fmt::print("{:<{}}  {:<9}  {:>32}  {:>9}  {}{}\n", object.name.empty() ? "(no name)" : object.name, widest, shapeOf(object.shape),
               sizeOf(object.lower_m, object.upper_m), object.triangles == 0 ? "exact" : std::to_string(object.triangles), object.material,
               object.moves ? ", moves" : "");
  }
  fmt::print("\n");
  for (const auto& material : scene.materials)
    fmt::print("material {}: {}, albedo {:.3g}{}\n", material.name, wordOf(material, "model"), material.albedo,
               material.texture.empty() ? "" : ", picture " + material.texture);
}

void printJson(const Options& options, const sim::SceneSummary& scene) {
  const auto numbers = [](Vec3d v) { return Json::arrayOf(std::vector<double>{v.x, v.y, v.z}); };
  std::vector<Json> objects, materials;
  for (const auto& object : scene.objects) {
    objects.push_back(Json::object()
                          .set("name", object.name)
                          .set("shape", shapeOf(object.shape))
                          .set("material", object.material)
                          .set("triangles", static_cast<std::uint64_t>(object.triangles))
                          .set("lower_m", numbers(object.lower_m))
                          .set("upper_m", numbers(object.upper_m))
                          .set("moves", object.moves));
  }
  for (const auto& material : scene.materials)
    materials.push_back(Json::object().set("name", material.name).set("model", wordOf(material, "model")).set("albedo", material.albedo));
  fmt::print("{}", Json::object()
                       .set("file", options.file)
                       .set("objects", Json::arrayOf(objects))
                       .set("materials", Json::arrayOf(materials))
                       .set("notes", Json::arrayOf(scene.notes))
                       .text());
}

Result<Exit> run(const Options& options) {
  const sim::SceneLoading how{.stop = {}, .may_convert = true};
  const auto scene = sim::summarise(options.file, how);
  if (!scene) return scene.error();
  options.json ? printJson(options, *scene) : printText(options, *scene);
  for (const std::string& note : scene->notes) fmt::print(stderr, "toftwin: {}: warning: {}\n", options.file, note);
  if (options.picture.empty()) return Exit::Ok;
  if (auto drawn = draw(options, *scene, how); !drawn) return drawn.error();
  return Exit::Ok;
}

}  // namespace scene_command

Command sceneCommand() {
  using namespace scene_command;
  return {"scene", "what is in a scene file or in a world that others made (SDF, URDF, glTF)",
          "  toftwin scene check warehouse.sdf\n"
          "  toftwin scene check robot.urdf -o robot.png\n"
          "  toftwin scene check room.toml --json\n",
          [](Arguments& args) -> Run {
            const auto options = std::make_shared<Options>();
            args.option("ACTION", options->action, "check: lists objects, sizes, materials and triangles").required().oneOf({"check"});
            args.option("FILE", options->file, "scene (.toml) or world (.sdf, .world, .urdf, .gltf, .glb)").required();
            args.option("-o,--output", options->picture, "also a picture of it (.png), each object in a colour of its own");
            args.flag("--json", options->json, "as JSON");
            return [options] { return run(*options); };
          }};
}

}  // namespace toftwin::cli
