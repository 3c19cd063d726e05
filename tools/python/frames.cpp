// SPDX-License-Identifier: Apache-2.0
// Frames and cameras in Python.
#include <fmt/format.h>
#include <pybind11/stl.h>

#include <cmath>
#include <map>
#include <optional>

#include <toftwin/names.h>

#include "tools/python/arrays.h"
#include "tools/python/docs.h"
#include "tools/python/errors.h"
#include "tools/python/parts.h"
#include "tools/python/planes.h"

namespace toftwin::python {

std::vector<PlaneKind> planesNamed(const std::vector<std::string>& names) {
  std::vector<PlaneKind> kinds;
  for (const std::string& name : names) {
    const auto kind = planeKindNamed(name);
    if (!kind) {
      std::string known;
      for (int i = 0; i <= static_cast<int>(kLastPlaneKind); ++i)
        known += (i > 0 ? ", " : "") + std::string{nameOf(static_cast<PlaneKind>(i))};
      throw py::value_error{fmt::format("there is no plane \"{}\"{}; there are {}", name, otherWordFor(name), known)};
    }
    kinds.push_back(*kind);
  }
  return kinds;
}

namespace {

/// Unit rays of all pixels, row by row, as three floats each. Those of the camera asked for last are kept: frame after frame
/// it is the same, and the distortion takes long to invert. Python's lock guards them.
const std::vector<float>& raysOf(const CameraInfo& camera) {
  static CameraInfo known;
  static std::vector<float> rays;
  if (known == camera && !rays.empty()) return rays;
  rays.clear();
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Vec3d v = rayThroughPixel(camera, x, y).v;
      for (const double one : {v.x, v.y, v.z}) rays.push_back(static_cast<float>(one));
    }
  }
  known = camera;
  return rays;
}

std::vector<py::ssize_t> shapeOfPoints(const CameraInfo& camera) { return {camera.height, camera.width, 3}; }

py::array raysArray(const CameraInfo& camera) { return py::array_t<float>(shapeOfPoints(camera), raysOf(camera).data()); }

/// Points in the camera's or the world's frame, from the range, or from the depth where there is no range.
py::array pointsOf(const Frame& frame, bool is_in_world) {
  const Plane* range = frame.find(PlaneKind::Range);
  const Plane* plane = range != nullptr ? range : frame.find(PlaneKind::Depth);
  if (plane == nullptr || plane->type != ElementType::F32)
    throw Thrown{{Error::Code::NotFound, "points: the frame has neither a plane range nor depth of metres"}};
  if (is_in_world && !frame.moment.world_from_camera)
    throw Thrown{{Error::Code::NotFound, "points: the frame does not say where its camera was; leave world=True out"}};
  const std::vector<float>& rays = raysOf(frame.camera);
  const auto along = plane->as<float>();
  if (along.size() * 3 != rays.size()) throw Thrown{{Error::Code::Malformed, "points: plane and camera have not the same size"}};
  py::array_t<float> points{shapeOfPoints(frame.camera)};
  float* to = points.mutable_data();
  for (std::size_t i = 0; i < along.size(); ++i) {
    const float* ray = &rays[3 * i];
    const float length = range != nullptr ? along[i] : along[i] / ray[2];
    Vec3d point{double{ray[0]} * double{length}, double{ray[1]} * double{length}, double{ray[2]} * double{length}};
    if (is_in_world) point = (*frame.moment.world_from_camera * Point<Camera>{point}).m;
    *to++ = static_cast<float>(point.x), *to++ = static_cast<float>(point.y), *to++ = static_cast<float>(point.z);
  }
  return points;
}

py::object poseOrNone(const std::optional<Transform<World, Camera>>& pose) {
  return pose ? py::object{matrixOf(*pose)} : py::object{py::none{}};
}

py::list namesIn(const Frame& frame) {
  py::list names;
  for (const Plane& plane : frame.planes) names.append(std::string{nameOf(plane.kind)});
  return names;
}

py::array planeIn(const Frame& frame, const std::string& name) {
  const auto kind = planeKindNamed(name);
  const Plane* plane = kind ? frame.find(*kind) : nullptr;
  if (plane != nullptr) return arrayOf(*plane);
  std::string names;
  for (const Plane& one : frame.planes) names += (names.empty() ? "" : ", ") + std::string{nameOf(one.kind)};
  throw py::key_error{fmt::format("{}: the frame has {}{}", name, names, otherWordFor(name))};
}

py::list exposuresOf(const Frame& frame) {
  py::list all;
  for (const Exposure& one : frame.moment.exposures) {
    all.append(py::dict(py::arg("start_ns") = one.start.ns, py::arg("duration_s") = one.duration.in(second),
                        py::arg("modulation_hz") = one.modulation.in(hertz)));
  }
  return all;
}

py::dict provenanceOf(const Frame& frame) {
  const Provenance& from = frame.provenance;
  return py::dict(py::arg("kind") = std::string{nameOf(from.kind)}, py::arg("calibration_id") = from.calibration_id,
                  py::arg("scene_id") = from.scene_id, py::arg("model_id") = from.model_id, py::arg("seed") = from.seed,
                  py::arg("effects") = from.effects);
}

std::map<std::string, double> temperaturesOf(const Frame& frame) {
  std::map<std::string, double> all;
  for (const NamedTemperature& one : frame.moment.temperatures) all[one.where] = one.value.in(celsius);
  return all;
}

using Matrix = py::array_t<double, py::array::c_style | py::array::forcecast>;

Frame madeOf(std::string source, const std::map<std::string, py::array>& planes, const CameraInfo& camera, std::uint64_t sequence,
             std::int64_t received_ns, const std::optional<Matrix>& world_from_camera) {
  Frame frame;
  frame.source = std::move(source);
  frame.sequence = sequence;
  frame.camera = camera;
  frame.moment.received.ns = received_ns;
  if (world_from_camera) frame.moment.world_from_camera = poseOf(*world_from_camera);
  for (const auto& [name, array] : planes) {
    Plane plane = planeOf(planesNamed({name}).front(), array);
    if (plane.width != camera.width || plane.height != camera.height) {
      throw py::value_error{fmt::format("{}: {} x {} pixels, but the camera has {} x {}", name, plane.width, plane.height, camera.width,
                                        camera.height)};
    }
    frame.planes.push_back(std::move(plane));
  }
  return frame;
}

void defineCamera(py::module_& module) {
  py::class_<CameraInfo>(module, "CameraInfo", doc("CameraInfo"))
      .def(py::init([](int width, int height, double fx, double fy, double cx, double cy, std::array<double, 5> distortion) {
             return CameraInfo{width, height, fx, fy, cx, cy, distortion, ""};
           }),
           py::arg("width"), py::arg("height"), py::arg("fx"), py::arg("fy"), py::arg("cx"), py::arg("cy"),
           py::arg("distortion") = std::array<double, 5>{}, doc("CameraInfo.__init__"))
      .def_readonly("width", &CameraInfo::width, doc("CameraInfo.width"))
      .def_readonly("height", &CameraInfo::height, doc("CameraInfo.height"))
      .def_readonly("fx", &CameraInfo::fx, doc("CameraInfo.fx"))
      .def_readonly("fy", &CameraInfo::fy, doc("CameraInfo.fy"))
      .def_readonly("cx", &CameraInfo::cx, doc("CameraInfo.cx"))
      .def_readonly("cy", &CameraInfo::cy, doc("CameraInfo.cy"))
      .def_readonly("distortion", &CameraInfo::distortion, doc("CameraInfo.distortion"))
      .def_readonly("calibration_id", &CameraInfo::calibration_id, doc("CameraInfo.calibration_id"))
      .def("rays", &raysArray, doc("CameraInfo.rays"))
      .def("__eq__", [](const CameraInfo& a, const CameraInfo& b) { return a == b; })
      .def("__repr__", [](const CameraInfo& c) {
        return fmt::format("CameraInfo({} x {}, fx={:.6g}, fy={:.6g}, cx={:.6g}, cy={:.6g})", c.width, c.height, c.fx, c.fy, c.cx, c.cy);
      });
}

}  // namespace

void defineFrames(py::module_& module) {
  defineCamera(module);
  py::class_<Frame>(module, "Frame", doc("Frame"))
      .def(py::init(&madeOf), py::arg("source"), py::arg("planes"), py::arg("camera"), py::kw_only(), py::arg("sequence") = 0,
           py::arg("received_ns") = 0, py::arg("world_from_camera") = std::nullopt, doc("Frame.__init__"))
      .def_readonly("source", &Frame::source, doc("Frame.source"))
      .def_readonly("sequence", &Frame::sequence, doc("Frame.sequence"))
      .def_readonly("dropped_before", &Frame::dropped_before, doc("Frame.dropped_before"))
      .def_readonly("dropped_by_device", &Frame::dropped_by_device, doc("Frame.dropped_by_device"))
      .def_readonly("camera", &Frame::camera, doc("Frame.camera"))
      .def_property_readonly("received_ns", [](const Frame& f) { return f.moment.received.ns; }, doc("Frame.received_ns"))
      .def_property_readonly("world_from_camera", [](const Frame& f) { return poseOrNone(f.moment.world_from_camera); }, doc("Frame.world_from_camera"))
      .def_property_readonly("exposures", &exposuresOf, doc("Frame.exposures"))
      .def_property_readonly("temperatures_c", &temperaturesOf, doc("Frame.temperatures_c"))
      .def_property_readonly("provenance", &provenanceOf, doc("Frame.provenance"))
      .def_property_readonly("planes", &namesIn, doc("Frame.planes"))
      .def("points", &pointsOf, py::kw_only(), py::arg("world") = false, doc("Frame.points"))
      .def("keys", &namesIn, doc("Frame.keys"))
      .def("__getitem__", &planeIn, py::arg("plane"))
      .def("__contains__", [](const Frame& f, const std::string& name) {
        const auto kind = planeKindNamed(name);
        return kind && f.find(*kind) != nullptr;
      })
      .def("__len__", [](const Frame& f) { return f.planes.size(); })
      .def("__repr__", [](const Frame& f) {
        return fmt::format("<toftwin.Frame {} of {}: {} x {}, {} planes>", f.sequence, f.source, f.camera.width, f.camera.height, f.planes.size());
      });
}

}  // namespace toftwin::python
