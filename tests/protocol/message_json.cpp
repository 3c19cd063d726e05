// SPDX-License-Identifier: Apache-2.0
#include "message_json.h"

#include <toftwin/names.h>

#include <array>
#include <charconv>
#include <cmath>
#include <type_traits>

namespace toftwin::wire {
namespace {

/// Writes nested JSON with two blanks of indentation and the fields in the order given.
class Json {
 public:
  template <class Write>
  void object(Write write) {
    open('{', '}', write);
  }
  template <class List, class Write>
  void array(const List& list, Write write) {
    open('[', ']', [&] {
      for (const auto& item : list) {
        separate();
        write(item);
      }
    });
  }
  Json& key(std::string_view name) {
    separate();
    text(name);
    out_ += ": ";
    return *this;
  }
  void text(std::string_view text) {
    out_ += '"';
    for (const char c : text) {
      if (c == '"' || c == '\\') out_ += '\\';
      out_ += c;
    }
    out_ += '"';
  }
  void number(double value) {
    std::array<char, 32> digits{};
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
    out_.append(digits.data(), end);
  }
  void raw(std::string_view json) { out_ += json; }
  [[nodiscard]] std::string finish() const { return out_ + "\n"; }

 private:
  template <class Write>
  void open(char begin, char end, Write write) {
    out_ += begin;
    depth_ += 1;
    first_ = true;
    write();
    depth_ -= 1;
    if (!first_) newLine();
    first_ = false;
    out_ += end;
  }
  void separate() {
    if (!first_) out_ += ',';
    first_ = false;
    newLine();
  }
  void newLine() { out_ += "\n" + std::string(2 * depth_, ' '); }

  std::string out_;
  std::size_t depth_ = 0;
  bool first_ = true;
};

class Renderer {
 public:
  template <class M>
  std::string render(const M& message) {
    json_.object([&] {
      field("message", std::string_view{nameOfMessage(message)});
      if constexpr (requires { message.id; }) field("id", message.id);
      fields(message);
    });
    return json_.finish();
  }

 private:
  static const char* nameOfMessage(const Hello&) { return "Hello"; }
  static const char* nameOfMessage(const ListSources&) { return "ListSources"; }
  static const char* nameOfMessage(const SourceList&) { return "SourceList"; }
  static const char* nameOfMessage(const DescribeSource&) { return "DescribeSource"; }
  static const char* nameOfMessage(const SourceDescription&) { return "SourceDescription"; }
  static const char* nameOfMessage(const Subscribe&) { return "Subscribe"; }
  static const char* nameOfMessage(const Subscribed&) { return "Subscribed"; }
  static const char* nameOfMessage(const Unsubscribe&) { return "Unsubscribe"; }
  static const char* nameOfMessage(const FrameMessage&) { return "Frame"; }
  static const char* nameOfMessage(const Acknowledge&) { return "Acknowledge"; }
  static const char* nameOfMessage(const SubscriptionEnded&) { return "SubscriptionEnded"; }
  static const char* nameOfMessage(const SetPose&) { return "SetPose"; }
  static const char* nameOfMessage(const SetParameter&) { return "SetParameter"; }
  static const char* nameOfMessage(const Trigger&) { return "Trigger"; }
  static const char* nameOfMessage(const Record&) { return "Record"; }
  static const char* nameOfMessage(const Done&) { return "Done"; }
  static const char* nameOfMessage(const AskHealth&) { return "AskHealth"; }
  static const char* nameOfMessage(const KeepAlive&) { return "KeepAlive"; }
  static const char* nameOfMessage(const Health&) { return "Health"; }
  static const char* nameOfMessage(const Failure&) { return "Failure"; }

  // Values. 64-bit integers are text because a JSON number may be read as a double.
  void value(std::string_view v) { json_.text(v); }
  void value(const std::string& v) { json_.text(v); }
  void value(double v) { json_.number(v); }
  void value(bool v) { json_.raw(v ? "true" : "false"); }
  void value(std::uint32_t v) { json_.raw(std::to_string(v)); }
  void value(int v) { json_.raw(std::to_string(v)); }
  void value(std::uint64_t v) { json_.text(std::to_string(v)); }
  void value(std::int64_t v) { json_.text(std::to_string(v)); }
  void value(PlaneKind v) { json_.text(nameOf(v)); }
  void value(FrameKind v) { json_.text(nameOf(v)); }
  void value(const Buffer& v) {
    constexpr std::string_view digits = "0123456789abcdef";
    std::string hex;
    for (const std::byte b : v.bytes()) {
      hex += digits[static_cast<std::size_t>(b) >> 4];
      hex += digits[static_cast<std::size_t>(b) & 15u];
    }
    json_.text(hex);
  }
  template <class T>
  void value(const std::vector<T>& v) {
    json_.array(v, [&](const T& item) { value(item); });
  }
  template <class T>
  requires std::is_class_v<T>
  void value(const T& v) {
    json_.object([&] { fields(v); });
  }
  template <class T>
  void field(std::string_view name, const T& v) {
    json_.key(name);
    value(v);
  }

  // Parts.
  void fields(const SourceSummary& m) {
    field("name", m.name);
    field("model", m.model);
    field("serial", m.serial);
    field("kind", m.kind);
    field("streaming", m.streaming);
    field("problem", m.problem);
  }
  void fields(const Parameter& m) {
    field("name", m.name);
    if (m.value) field("value", *m.value);
    if (std::isfinite(m.bounds.min)) field("lowest", m.bounds.min);
    if (std::isfinite(m.bounds.max)) field("highest", m.bounds.max);
    if (m.text) field("text", *m.text);
    field("choices", m.choices);
  }
  void fields(const CameraInfo& m) {
    const auto& [k1, k2, p1, p2, k3] = m.distortion;
    field("width", m.width);
    field("height", m.height);
    field("fx_px", m.fx);
    field("fy_px", m.fy);
    field("cx_px", m.cx);
    field("cy_px", m.cy);
    field("k1", k1);
    field("k2", k2);
    field("p1", p1);
    field("p2", p2);
    field("k3", k3);
    field("calibration_id", m.calibration_id);
  }
  void fields(const Transform<World, Camera>& m) {
    const auto& [w, x, y, z] = m.rotation_wxyz;
    field("rotation_w", w);
    field("rotation_x", x);
    field("rotation_y", y);
    field("rotation_z", z);
    field("x_m", m.translation_m.x);
    field("y_m", m.translation_m.y);
    field("z_m", m.translation_m.z);
  }
  void fields(const Exposure& m) {
    field("start_device_ns", m.start.ns);
    field("duration_s", m.duration.in(second));
    field("modulation_hz", m.modulation.in(hertz));
  }
  void fields(const NamedTemperature& m) {
    field("where", m.where);
    field("value_c", m.value.in(celsius));
  }
  void fields(const Moment& m) {
    field("exposures", m.exposures);
    field("received_host_ns", m.received.ns);
    field("host_minus_device_ns", m.clock.host_minus_device_ns);
    field("clock_uncertainty_ns", m.clock.uncertainty_ns);
    if (m.since_power_on) field("since_power_on_s", m.since_power_on->in(second));
    field("temperatures", m.temperatures);
    if (m.ambient) field("ambient_klx", m.ambient->in(kilolux));
    if (m.world_from_camera) field("world_from_camera", *m.world_from_camera);
  }
  void fields(const Provenance& m) {
    field("kind", m.kind);
    field("calibration_id", m.calibration_id);
    field("scene_id", m.scene_id);
    field("model_id", m.model_id);
    field("seed", m.seed);
    field("effects", m.effects);
  }
  void fields(const Plane& m) {
    constexpr std::array<std::string_view, 3> types{"u8", "u16", "f32"};
    field("kind", m.kind);
    field("type", types[static_cast<std::size_t>(m.type)]);
    field("width", m.width);
    field("height", m.height);
    field("channels", m.channels);
    field("data", m.data);
  }
  void fields(const Region& m) {
    field("x", m.x);
    field("y", m.y);
    field("width", m.width);
    field("height", m.height);
  }
  void fields(const Error& m) {
    field("code", static_cast<int>(m.code));
    field("message", m.message);
  }
  void fields(const SourceHealth& m) {
    field("name", m.name);
    field("streaming", m.streaming);
    field("frames", m.frames);
    field("dropped_by_device", m.dropped_by_device);
    field("subscribers", m.subscribers);
    field("reconnects", m.reconnects);
    field("last_error", m.last_error);
    field("lockstep_by", m.lockstep_by);
    field("recording_by", m.recording_by);
  }
  void fields(const FacadeHealth& m) {
    field("kind", m.kind);
    field("source", m.source);
    field("place", m.place);
    field("state", static_cast<int>(m.state));
    if (m.clients) field("clients", *m.clients);
    field("problem", m.problem);
  }

  // Messages.
  void fields(const Hello& m) {
    field("software", m.software);
    field("features", m.features);
    field("token", m.token);
    if (m.idle) field("idle_s", m.idle->in(second));
  }
  void fields(const ListSources&) {}
  void fields(const SourceList& m) { field("sources", m.sources); }
  void fields(const DescribeSource& m) { field("source", m.source); }
  void fields(const SourceDescription& m) {
    field("summary", m.summary);
    field("driver", m.driver);
    field("camera", m.camera);
    field("planes", m.planes);
    if (m.frame_interval) field("frame_interval_s", m.frame_interval->in(second));
    field("can_set_pose", m.can_set_pose);
    field("can_trigger", m.can_trigger);
    field("can_lockstep", m.can_lockstep);
    field("parameters", m.parameters);
    if (m.world_from_camera) field("world_from_camera", *m.world_from_camera);
  }
  void fields(const Subscribe& m) {
    field("source", m.source);
    field("planes", m.planes);
    field("region", m.region);
    field("decimation", m.decimation);
    field("max_rate_hz", m.max_rate_hz);
    field("policy", static_cast<int>(m.policy));
    field("queue", m.queue);
    field("window", m.window);
  }
  void fields(const Subscribed& m) { field("subscription", m.subscription); }
  void fields(const Unsubscribe& m) { field("subscription", m.subscription); }
  void fields(const FrameMessage& m) {
    field("subscription", m.subscription);
    field("source", m.frame.source);
    field("sequence", m.frame.sequence);
    field("dropped_before", m.frame.dropped_before);
    field("dropped_by_device", m.frame.dropped_by_device);
    field("dropped_because", m.frame.dropped_because);
    field("moment", m.frame.moment);
    field("provenance", m.frame.provenance);
    field("camera", m.frame.camera);
    field("planes", m.frame.planes);
  }
  void fields(const Acknowledge& m) {
    field("subscription", m.subscription);
    field("sequence", m.sequence);
  }
  void fields(const SubscriptionEnded& m) {
    field("subscription", m.subscription);
    field("reason", m.reason);
  }
  void fields(const SetPose& m) {
    field("source", m.source);
    field("world_from_camera", m.world_from_camera);
  }
  void fields(const SetParameter& m) {
    field("source", m.source);
    field("name", m.name);
    field("value", m.value);
    if (m.text) field("text", *m.text);
  }
  void fields(const Trigger& m) { field("source", m.source); }
  void fields(const Record& m) {
    field("source", m.source);
    field("file", m.file);
  }
  void fields(const Done& m) { field("detail", m.detail); }
  void fields(const AskHealth&) {}
  void fields(const Health& m) {
    field("uptime_s", m.uptime.in(second));
    field("sessions", m.sessions);
    field("sources", m.sources);
    field("facades", m.facades);
  }
  void fields(const Failure& m) { field("error", m.error); }
  void fields(const KeepAlive&) {}

  Json json_;
};

}  // namespace

std::string toJson(const Message& message) {
  return std::visit([](const auto& m) { return Renderer{}.render(m); }, message);
}

std::string toJson(Error::Code code) {
  return "{\n  \"error\": " + std::to_string(static_cast<int>(code)) + "\n}\n";
}

}  // namespace toftwin::wire
