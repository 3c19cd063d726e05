// SPDX-License-Identifier: Apache-2.0
// A daemon's client in Python.
#include <fmt/format.h>
#include <pybind11/stl.h>

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <variant>

#include <toftwin/client.h>
#include <toftwin/names.h>

#include "tools/python/arrays.h"
#include "tools/python/docs.h"
#include "tools/python/errors.h"
#include "tools/python/parts.h"
#include "tools/python/planes.h"

namespace toftwin::python {
namespace {

using namespace std::chrono_literals;
using Milliseconds = std::chrono::milliseconds;

Milliseconds millisecondsOf(double seconds) {
  constexpr double kMost = 1e9;
  if (!(seconds >= 0.0)) throw py::value_error{"a timeout is a number of seconds, not negative"};
  return Milliseconds{static_cast<std::int64_t>(std::min(seconds, kMost) * 1000.0)};
}

/// A subscription with the connection that it needs.
struct Stream {
  std::shared_ptr<Client> client;  // shared with the Client in Python and with other streams
  std::string source;
  std::optional<Subscription> frames;
  Milliseconds timeout;

  Frame next(Milliseconds wait);
};

/// Waits without Python's lock, and looks now and then whether Ctrl-C was pressed.
Frame Stream::next(Milliseconds wait) {
  if (!frames) throw Thrown{{Error::Code::Stopped, "the stream of " + source + " was closed"}};
  const auto until = std::chrono::steady_clock::now() + wait;
  while (true) {
    const auto left = std::chrono::duration_cast<Milliseconds>(until - std::chrono::steady_clock::now());
    auto frame = withoutLock([&] { return frames->next(std::clamp(left, Milliseconds{0}, Milliseconds{100})); });
    if (frame) return *std::move(frame);
    if (frame.error().code != Error::Code::Timeout || left <= 100ms) throw Thrown{frame.error()};
    if (PyErr_CheckSignals() != 0) throw py::error_already_set{};
  }
}

Frame nextOrStop(Stream& stream) {
  try {
    return stream.next(stream.timeout);
  } catch (const Thrown& thrown) {
    if (thrown.error.code == Error::Code::EndOfStream) throw py::stop_iteration{};
    throw;
  }
}

/// A client that can be closed before Python lets it go.
struct Connected {
  std::shared_ptr<Client> client;  // shared with its streams

  Client& open() {
    if (!client) throw Thrown{{Error::Code::Stopped, "the client was closed"}};
    return *client;
  }
  /// Asks the daemon without holding Python up.
  template <class Question>
  auto ask(Question question) {
    Client& asked = open();
    auto answer = withoutLock([&] { return question(asked); });
    return orThrow(std::move(answer));
  }
};

Connected connectTo(const std::string& address, std::string token, std::string authorities, std::string certificate, std::string key,
                    double timeout) {
  ClientOptions options;
  options.timeout = millisecondsOf(timeout);
  options.token = std::move(token);
  options.authorities = std::move(authorities);
  options.certificate = std::move(certificate);
  options.key = std::move(key);
  return {std::make_shared<Client>(orThrow(withoutLock([&] { return Client::connect(address, options); })))};
}

SubscribeOptions::Policy policyNamed(const std::string& name) {
  const std::map<std::string, SubscribeOptions::Policy> kPolicies{{"latest", SubscribeOptions::Policy::Latest},
                                                                  {"queue", SubscribeOptions::Policy::Queue},
                                                                  {"lossless", SubscribeOptions::Policy::Lossless},
                                                                  {"lockstep", SubscribeOptions::Policy::Lockstep}};
  const auto found = kPolicies.find(name);
  if (found == kPolicies.end()) throw py::value_error{"policy: latest, queue, lossless or lockstep, not \"" + name + "\""};
  return found->second;
}

using Region = std::array<std::uint32_t, 4>;

std::unique_ptr<Stream> streamOf(Connected& client, const std::string& source, const std::vector<std::string>& planes,
                                 const std::optional<Region>& region, std::uint32_t decimation, double max_rate_hz,
                                 const std::string& policy, std::uint32_t queue, double timeout) {
  SubscribeOptions options;
  options.planes = planesNamed(planes);
  if (region) options.x = (*region)[0], options.y = (*region)[1], options.width = (*region)[2], options.height = (*region)[3];
  options.decimation = decimation;
  options.max_rate_hz = max_rate_hz;
  options.policy = policyNamed(policy);
  options.queue = queue;
  const Milliseconds wait = millisecondsOf(timeout);
  auto frames = client.ask([&](Client& asked) { return asked.subscribe(source, options); });
  return std::make_unique<Stream>(Stream{client.client, source, std::move(frames), wait});
}

py::dict dictOf(const SourceEntry& entry) {
  return py::dict(py::arg("name") = entry.name, py::arg("model") = entry.model, py::arg("serial") = entry.serial,
                  py::arg("kind") = std::string{nameOf(entry.kind)}, py::arg("streaming") = entry.streaming,
                  py::arg("problem") = entry.problem);
}

py::dict dictOf(const Parameter& one) {
  return py::dict(py::arg("value") = one.value, py::arg("least") = one.bounds.min, py::arg("most") = one.bounds.max,
                  py::arg("text") = one.text, py::arg("choices") = one.choices);
}

py::list sourcesOf(Connected& client) {
  py::list all;
  for (const SourceEntry& entry : client.ask([](Client& asked) { return asked.sources(); })) all.append(dictOf(entry));
  return all;
}

py::dict describe(Connected& client, const std::string& source) {
  const SourceDetails about = client.ask([&](Client& asked) { return asked.describe(source); });
  py::dict all = dictOf(about.entry);
  all["driver"] = about.driver;
  all["camera"] = about.camera;
  py::list planes;
  for (const PlaneKind kind : about.planes) planes.append(std::string{nameOf(kind)});
  all["planes"] = planes;
  all["frame_interval_s"] = about.frame_interval ? py::object{py::float_{about.frame_interval->in(second)}} : py::object{py::none{}};
  all["can_set_pose"] = about.can_set_pose;
  all["can_trigger"] = about.can_trigger;
  all["can_lockstep"] = about.can_lockstep;
  all["world_from_camera"] = about.world_from_camera ? py::object{matrixOf(*about.world_from_camera)} : py::object{py::none{}};
  py::dict parameters;
  for (const Parameter& one : about.parameters) parameters[py::str{one.name}] = dictOf(one);
  all["parameters"] = parameters;
  return all;
}

py::dict healthOf(Connected& client) {
  const DaemonHealth health = client.ask([](Client& asked) { return asked.health(); });
  py::list sources;
  for (const SourceHealthEntry& one : health.sources) {
    sources.append(py::dict(py::arg("name") = one.name, py::arg("streaming") = one.streaming, py::arg("frames") = one.frames,
                            py::arg("dropped_by_device") = one.dropped_by_device, py::arg("subscribers") = one.subscribers,
                            py::arg("reconnects") = one.reconnects, py::arg("last_error") = one.last_error,
                            py::arg("lockstep_by") = one.lockstep_by, py::arg("recording_by") = one.recording_by));
  }
  return py::dict(py::arg("software") = health.software, py::arg("uptime_s") = health.uptime.in(second),
                  py::arg("sessions") = health.sessions, py::arg("sources") = sources);
}

using Matrix = py::array_t<double, py::array::c_style | py::array::forcecast>;

void setPose(Connected& client, const std::string& source, const Matrix& world_from_camera) {
  const auto pose = poseOf(world_from_camera);
  Client& asked = client.open();
  orThrow(withoutLock([&] { return asked.setPose(source, pose); }));
}

void setParameter(Connected& client, const std::string& source, const std::string& name, const std::variant<double, std::string>& value) {
  Client& asked = client.open();
  orThrow(withoutLock([&] {
    const auto* text = std::get_if<std::string>(&value);
    return text != nullptr ? asked.setParameter(source, name, std::string_view{*text})
                           : asked.setParameter(source, name, std::get<double>(value));
  }));
}

void defineStream(py::module_& module) {
  py::class_<Stream>(module, "Stream", doc("Stream"))
      .def_readonly("source", &Stream::source, doc("Stream.source"))
      .def("next",
           [](Stream& stream, std::optional<double> timeout) { return stream.next(timeout ? millisecondsOf(*timeout) : stream.timeout); },
           py::arg("timeout") = std::nullopt, doc("Stream.next"))
      .def("close", [](Stream& stream) { withoutLock([&] { stream.frames.reset(); }); }, doc("Stream.close"))
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &nextOrStop)
      .def("__enter__", [](py::object self) { return self; })
      .def("__exit__", [](Stream& stream, const py::args&) { withoutLock([&] { stream.frames.reset(); }); });
}

}  // namespace

void defineClient(py::module_& module) {
  defineStream(module);
  module.def("connect", &connectTo, py::arg("address") = "", py::kw_only(), py::arg("token") = "", py::arg("authorities") = "",
             py::arg("certificate") = "", py::arg("key") = "", py::arg("timeout") = 5.0, doc("connect"));
  const auto close = [](Connected& client) { withoutLock([&] { client.client.reset(); }); };
  py::class_<Connected>(module, "Client", doc("Client"))
      .def("sources", &sourcesOf, doc("Client.sources"))
      .def("describe", &describe, py::arg("source"), doc("Client.describe"))
      .def("stream", &streamOf, py::arg("source"), py::kw_only(), py::arg("planes") = std::vector<std::string>{},
           py::arg("region") = std::nullopt, py::arg("decimation") = 1, py::arg("max_rate_hz") = 0.0, py::arg("policy") = "latest",
           py::arg("queue") = 4, py::arg("timeout") = 10.0, doc("Client.stream"))
      .def("set_pose", &setPose, py::arg("source"), py::arg("world_from_camera"), doc("Client.set_pose"))
      .def("set_parameter", &setParameter, py::arg("source"), py::arg("name"), py::arg("value"), doc("Client.set_parameter"))
      .def("trigger",
           [](Connected& client, const std::string& source) {
             Client& asked = client.open();
             orThrow(withoutLock([&] { return asked.trigger(source); }));
           },
           py::arg("source"), doc("Client.trigger"))
      .def("start_recording",
           [](Connected& client, const std::string& source, const std::string& file) {
             return client.ask([&](Client& asked) { return asked.startRecording(source, file); });
           },
           py::arg("source"), py::arg("file"), doc("Client.start_recording"))
      .def("stop_recording",
           [](Connected& client, const std::string& source) {
             return client.ask([&](Client& asked) { return asked.stopRecording(source); });
           },
           py::arg("source"), doc("Client.stop_recording"))
      .def("health", &healthOf, doc("Client.health"))
      .def("close", close, doc("Client.close"))
      .def("__enter__", [](py::object self) { return self; })
      .def("__exit__", [close](Connected& client, const py::args&) { close(client); });
}

}  // namespace toftwin::python
