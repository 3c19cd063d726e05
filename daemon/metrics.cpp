// SPDX-License-Identifier: Apache-2.0
#include "daemon/metrics.h"

#include <unistd.h>

#include <fmt/format.h>

#include <fstream>
#include <iterator>

namespace toftwin::daemon {
namespace {

/// A label's value: backslash, quote and line feed are escaped.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '\\' || c == '"') out += '\\';
    out += c == '\n' ? ' ' : c;
  }
  return out + "\"";
}

/// One family of metrics: its head once, then a line for each sample.
class Family {
 public:
  Family(std::string& out, std::string name, std::string_view type, std::string_view help)
      : out_(out), name_(std::move(name)), is_counter_(type == "counter") {
    fmt::format_to(std::back_inserter(out_), "# TYPE {} {}\n# HELP {} {}\n", name_, type, name_, help);
  }
  template <class Number>
  void sample(Number value, const std::string& labels = {}) {
    fmt::format_to(std::back_inserter(out_), "{}{}{} {}\n", name_, is_counter_ ? "_total" : "",
                   labels.empty() ? "" : "{" + labels + "}", value);
  }

 private:
  std::string& out_;
  const std::string name_;
  const bool is_counter_;
};

std::uint64_t residentBytes() {
  std::ifstream file{"/proc/self/statm"};
  std::uint64_t all = 0, resident = 0;
  file >> all >> resident;
  return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

void addSources(std::string& out, const wire::Health& health, const Hub& hub) {
  const auto ofEach = [&](const char* name, const char* type, const char* help, auto value) {
    Family family{out, name, type, help};
    for (const wire::SourceHealth& one : health.sources) family.sample(value(one), "source=" + quoted(one.name));
  };
  using Of = const wire::SourceHealth&;
  ofEach("toftwin_source_frames", "counter", "Frames that the source made.", [](Of s) { return s.frames; });
  ofEach("toftwin_source_dropped_by_device", "counter", "Frames lost between device and daemon.",
         [](Of s) { return s.dropped_by_device; });
  ofEach("toftwin_source_reconnects", "counter", "How often the device was opened again.",
         [](Of s) { return s.reconnects; });
  ofEach("toftwin_source_streaming", "gauge", "Whether it makes frames now.", [](Of s) { return s.streaming ? 1 : 0; });
  ofEach("toftwin_source_subscribers", "gauge", "Subscriptions and recordings of it.", [](Of s) { return s.subscribers; });
  ofEach("toftwin_source_recording", "gauge", "Whether it is being recorded.",
         [](Of s) { return s.recording_by.empty() ? 0 : 1; });
  ofEach("toftwin_source_faulty", "gauge", "Whether health tells an error of it.",
         [](Of s) { return s.last_error.empty() ? 0 : 1; });
  Family temperature{out, "toftwin_source_temperature_celsius", "gauge", "As the device tells, of its last frame."};
  for (const auto& source : hub.sources()) {
    for (const NamedTemperature& one : source->temperatures()) {
      temperature.sample(one.value.in(celsius),
                         "source=" + quoted(source->name()) + ",where=" + quoted(one.where));
    }
  }
}

void addTraffic(std::string& out, const Traffic& traffic) {
  Family{out, "toftwin_frames_sent", "counter", "Frames sent to clients."}.sample(traffic.frames.load());
  Family{out, "toftwin_frame_bytes_sent", "counter", "Bytes of their planes, in shared memory or not."}.sample(
      traffic.bytes.load());
  Family{out, "toftwin_frames_dropped", "counter", "Frames that clients were too slow for."}.sample(traffic.dropped.load());
  const std::string name = "toftwin_frame_latency_seconds";
  fmt::format_to(std::back_inserter(out),
                 "# TYPE {0} histogram\n# HELP {0} From a frame's hand-out until it has gone into the socket.\n", name);
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < Histogram::kBuckets; ++i) {
    count += traffic.latency.in(i);
    const std::string bound = i < Histogram::kBoundsMs.size() ? fmt::format("{}", Histogram::kBoundsMs[i] / 1000.0) : "+Inf";
    fmt::format_to(std::back_inserter(out), "{}_bucket{{le=\"{}\"}} {}\n", name, bound, count);
  }
  fmt::format_to(std::back_inserter(out), "{0}_sum {1}\n{0}_count {2}\n", name, traffic.latency.sumSeconds(), count);
}

}  // namespace

std::string openMetrics(const Hub& hub, std::uint64_t log_lines_lost) {
  const wire::Health health = hub.health();
  std::string out;
  Family{out, "toftwin_uptime_seconds", "gauge", "Since the daemon began."}.sample(health.uptime.in(second));
  Family{out, "toftwin_sessions", "gauge", "Clients of the native protocol."}.sample(health.sessions);
  addSources(out, health, hub);
  addTraffic(out, hub.traffic());
  {
    Family backlog{out, "toftwin_backlog_bytes", "gauge", "What waits for clients, and of recordings to be written."};
    backlog.sample(hub.budget().used(), "of=\"clients\"");
    backlog.sample(hub.recordingsBudget().used(), "of=\"recordings\"");
  }
  {
    Family limit{out, "toftwin_backlog_limit_bytes", "gauge", "What may wait."};
    limit.sample(hub.budget().limit(), "of=\"clients\"");
    limit.sample(hub.recordingsBudget().limit(), "of=\"recordings\"");
  }
  Family{out, "toftwin_resident_memory_bytes", "gauge", "Of the process."}.sample(residentBytes());
  Family{out, "toftwin_log_lines_lost", "counter", "Lines of the log that nobody took in time."}.sample(log_lines_lost);
  return out + "# EOF\n";
}

}  // namespace toftwin::daemon
