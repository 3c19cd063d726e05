// SPDX-License-Identifier: Apache-2.0
// The simulator in Python, without a daemon.
#include <pybind11/stl.h>

#include <optional>
#include <string>
#include <vector>

#include "sim/sensor/sensor_model.h"
#include "tools/cli/render_campaign.h"
#include "tools/python/arrays.h"
#include "tools/python/docs.h"
#include "tools/python/errors.h"
#include "tools/python/parts.h"
#include "tools/python/planes.h"

namespace toftwin::python {
namespace {

using Matrices = py::array_t<double, py::array::c_style | py::array::forcecast>;

cli::Trajectory trajectoryOf(const Matrices& poses, const std::vector<double>& times_s) {
  const auto all = posesOf(poses);
  if (!times_s.empty() && times_s.size() != all.size()) throw py::value_error{"times_s: as many as poses, or none"};
  cli::Trajectory trajectory;
  trajectory.has_times = !times_s.empty();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i > 0 && trajectory.has_times && !(times_s[i] > times_s[i - 1])) throw py::value_error{"times_s: each later than the one before"};
    trajectory.poses.push_back({trajectory.has_times ? times_s[i] : 0.0, all[i].rotation_wxyz, all[i].translation_m});
  }
  return trajectory;
}

/// What makes frames one after the other.
class Renderer {
 public:
  explicit Renderer(cli::FrameMaker maker) : maker_(std::move(maker)) {}
  [[nodiscard]] std::uint64_t size() const { return maker_.schedule().frames; }
  [[nodiscard]] const sim::SensorModel& model() const { return maker_.model(); }
  void rewind() { next_ = 0; }

  Frame next() {
    if (next_ >= size()) throw py::stop_iteration{};
    bool is_interrupted = false;
    auto frame = withoutLock([&] {
      return maker_.make(next_, [&](double) {
        const py::gil_scoped_acquire held;
        is_interrupted = PyErr_CheckSignals() != 0;
        return !is_interrupted;
      });
    });
    if (is_interrupted) throw py::error_already_set{};
    ++next_;
    return orThrow(std::move(frame));
  }

 private:
  cli::FrameMaker maker_;
  std::uint64_t next_ = 0;
};

Renderer rendererOf(const std::string& camera, const std::string& scene, const std::optional<Matrices>& poses,
                    const std::vector<double>& times_s, std::uint64_t frames, double frame_interval_s,
                    const std::vector<std::string>& planes, int samples, int max_surfaces, double pixel_extent, std::uint64_t seed,
                    double ambient_klx, double room_temperature_c, double since_power_on_s) {
  cli::RenderOptions options;
  options.camera = camera;
  options.scene = scene;
  options.frames = frames;
  options.frame_interval_ms = 1000.0 * frame_interval_s;
  if (poses) options.poses = trajectoryOf(*poses, times_s);
  options.output.file = "frames.mcap";  // whose frames have the planes that are asked for, and no others
  options.output.how.planes = planesNamed(planes);
  options.settings.keys.samples_per_pixel = samples;
  options.settings.keys.max_surfaces = max_surfaces;
  options.settings.keys.pixel_extent = pixel_extent;
  options.settings.keys.seed = seed;
  options.settings.ambient_klx = ambient_klx;
  options.settings.room_temperature_c = room_temperature_c;
  options.settings.since_power_on_s = since_power_on_s;
  std::vector<std::string> said;
  options.tell = [&said](const std::string& text) { said.push_back(text); };
  auto maker = withoutLock([&] { return cli::makerOf(options); });
  for (const std::string& text : said) {
    if (PyErr_WarnEx(PyExc_UserWarning, text.c_str(), 1) != 0) throw py::error_already_set{};
  }
  return Renderer{orThrow(std::move(maker))};
}

}  // namespace

void defineRendering(py::module_& module) {
  const cli::RenderOptions usual;
  py::class_<Renderer>(module, "Renderer", doc("Renderer"))
      .def(py::init(&rendererOf), py::arg("camera"), py::arg("scene") = "", py::arg("poses") = std::nullopt, py::kw_only(),
           py::arg("times_s") = std::vector<double>{}, py::arg("frames") = 0, py::arg("frame_interval_s") = 0.0,
           py::arg("planes") = std::vector<std::string>{}, py::arg("samples") = usual.settings.keys.samples_per_pixel,
           py::arg("max_surfaces") = usual.settings.keys.max_surfaces, py::arg("pixel_extent") = usual.settings.keys.pixel_extent,
           py::arg("seed") = usual.settings.keys.seed, py::arg("ambient_klx") = usual.settings.ambient_klx,
           py::arg("room_temperature_c") = usual.settings.room_temperature_c,
           py::arg("since_power_on_s") = usual.settings.since_power_on_s, doc("Renderer.__init__"))
      .def_property_readonly("camera", [](const Renderer& r) { return r.model().camera(); }, doc("Renderer.camera"))
      .def_property_readonly("model", [](const Renderer& r) { return std::string{r.model().model()}; }, doc("Renderer.model"))
      .def("__len__", &Renderer::size)
      .def("__iter__",
           [](py::object self) {
             self.cast<Renderer&>().rewind();
             return self;
           })
      .def("__next__", &Renderer::next);
  module.def("cameras", [] { return sim::SensorModel::presetNames(); }, doc("cameras"));
}

}  // namespace toftwin::python
