// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/render_images.h"

#include <fmt/format.h>

#include <filesystem>
#include <utility>
#include <vector>

#include "drivers/sim/default_scene.h"
#include "sim/sensor/color.h"
#include "sim/sensor/frame_assembly.h"
#include "tools/cli/export/export.h"
#include "tools/cli/render_bands.h"

namespace toftwin::cli {

namespace {

/// The pictures of one camera, named after one file.
class Pictures {
 public:
  explicit Pictures(std::filesystem::path file) : file_(std::move(file)) {}

  Result<> write(const Frame& frame, PlaneKind kind, const char* name, ExportOptions how) const {
    std::filesystem::path path = file_;
    path.replace_filename(fmt::format("{}-{}.png", file_.stem().string(), name));
    how.planes = {kind};
    const auto note = exportFrame(frame, path, how);
    if (!note) return note.error();
    fmt::print("{}: {}\n", path.string(), *note);
    return {};
  }

 private:
  std::filesystem::path file_;
};

Frame frameWith(const Frame& like, std::vector<Plane> planes) {
  Frame frame = like;
  frame.planes = std::move(planes);
  return frame;
}

Result<> writeColor(const Frame& frame, const sim::SensorModel& model, const sim::LensPair& lenses,
                    const sim::ColorImage& color, const Pictures& pictures) {
  const Plane* range = frame.find(PlaneKind::Range);
  if (range == nullptr) return Error{Error::Code::Internal, "a rendered frame has no range"};
  Image<float> range_m{range->width, range->height};
  std::ranges::copy(range->as<float>(), range_m.pixels().begin());
  const Image<float> depth_in_color = sim::depthInColor(lenses, model.rays(), range_m);
  const sim::ColorImage color_in_depth =
      sim::colorInDepth(lenses, model.rays(), range_m, depth_in_color, color);
  const Frame beside =
      frameWith(frame, {sim::planeOf(color), toPlane(PlaneKind::Depth, depth_in_color)});
  if (auto done = pictures.write(beside, PlaneKind::Color, "color", {}); !done) return done;
  if (auto done = pictures.write(beside, PlaneKind::Depth, "depth-in-color", {.color = true});
      !done)
    return done;
  return pictures.write(frameWith(frame, {sim::planeOf(color_in_depth)}), PlaneKind::Color,
                        "color-in-depth", {});
}

}  // namespace

Result<Exit> renderImages(const Frame& frame, const sim::SensorModel& model,
                          const std::string& scene, const std::string& file,
                          const drivers::simulator::Keys& keys) {
  const Pictures pictures{file};
  if (auto done = pictures.write(frame, PlaneKind::Amplitude, "infrared", {.grey = true}); !done)
    return done.error();
  if (auto done = pictures.write(frame, PlaneKind::Depth, "depth", {.color = true}); !done)
    return done.error();
  const auto lenses = model.colorLens();
  if (!lenses) return Exit::Ok;
  const auto visible = scene.empty()
                           ? sim::parseVisible(drivers::simulator::kDefaultScene, "default scene")
                           : sim::loadVisible(scene, {.stop = {}, .may_convert = true});
  if (!visible) return visible.error();
  const auto color = sim::renderColor(*visible,
                                      {.lenses = *lenses,
                                       .world_from_camera = *frame.moment.world_from_camera,
                                       .samples_per_pixel = keys.samples_per_pixel,
                                       .max_surfaces = keys.max_surfaces,
                                       .seed = keys.seed},
                                      traceInBands);
  if (!color) return color.error();
  if (auto done = writeColor(frame, model, *lenses, *color, pictures); !done) return done.error();
  return Exit::Ok;
}

}  // namespace toftwin::cli
