// SPDX-License-Identifier: Apache-2.0
// Recordings in Python.
#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "protocol/record/recording.h"
#include "tools/python/docs.h"
#include "tools/python/errors.h"
#include "tools/python/parts.h"

namespace toftwin::python {
namespace {

struct Opened {
  std::filesystem::path path;
  record::Reader reader;
  std::string source;  ///< of which frames come; empty: of all
};

Opened open(const std::filesystem::path& path, const std::string& source) {
  auto reader = orThrow(withoutLock([&] { return record::Reader::open(path); }));
  if (!source.empty() && !reader.summary().frames_per_source.contains(source)) {
    std::string names;
    for (const auto& [name, count] : reader.summary().frames_per_source) names += (names.empty() ? "" : ", ") + name;
    throw Thrown{{Error::Code::NotFound, fmt::format("{}: has no source {}; it has {}", path.string(), source, names)}};
  }
  return {path, std::move(reader), source};
}

Frame nextOf(Opened& recording) {
  auto frame = withoutLock([&] { return recording.reader.next(recording.source); });
  if (!frame && frame.error().code == Error::Code::EndOfStream) throw py::stop_iteration{};
  return orThrow(std::move(frame));
}

std::uint64_t framesOf(const Opened& recording) {
  std::uint64_t all = 0;
  for (const auto& [name, count] : recording.reader.summary().frames_per_source) {
    if (recording.source.empty() || recording.source == name) all += count;
  }
  return all;
}

void close(record::Writer& writer) {
  orThrow(withoutLock([&] { return writer.close(); }));
}

record::Writer create(const std::filesystem::path& path, bool overwrite) {
  return orThrow(record::Writer::create(path, {.overwrite = overwrite}));
}

}  // namespace

void defineRecordings(py::module_& module) {
  module.def("open", &open, py::arg("path"), py::kw_only(), py::arg("source") = "", doc("open"));
  py::class_<Opened>(module, "Recording", doc("Recording"))
      .def_readonly("path", &Opened::path, doc("Recording.path"))
      .def_property_readonly("sources", [](const Opened& r) { return r.reader.summary().frames_per_source; }, doc("Recording.sources"))
      .def_property_readonly("first_ns", [](const Opened& r) { return r.reader.summary().first_ns; }, doc("Recording.first_ns"))
      .def_property_readonly("last_ns", [](const Opened& r) { return r.reader.summary().last_ns; }, doc("Recording.last_ns"))
      .def_property_readonly("damage", [](const Opened& r) { return r.reader.summary().damage; }, doc("Recording.damage"))
      .def("seek", [](Opened& r, std::int64_t time_ns) { orThrow(r.reader.seek(time_ns)); }, py::arg("received_ns"), doc("Recording.seek"))
      .def("__len__", &framesOf)
      .def("__iter__",
           [](py::object self) {
             self.cast<Opened&>().reader.rewind();
             return self;
           })
      .def("__next__", &nextOf);
  py::class_<record::Writer>(module, "Writer", doc("Writer"))
      .def(py::init(&create), py::arg("path"), py::kw_only(), py::arg("overwrite") = false, doc("Writer.__init__"))
      .def("write",
           [](record::Writer& writer, const Frame& frame) { orThrow(withoutLock([&] { return writer.write(frame); })); },
           py::arg("frame"), doc("Writer.write"))
      .def_property_readonly("frames", &record::Writer::frames, doc("Writer.frames"))
      .def("close", &close, doc("Writer.close"))
      .def("__enter__", [](py::object self) { return self; })
      .def("__exit__", [](record::Writer& writer, const py::args&) { close(writer); });
}

}  // namespace toftwin::python
