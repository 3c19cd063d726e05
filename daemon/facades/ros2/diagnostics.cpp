// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/ros2/diagnostics.h"

#include <fmt/format.h>

#include <ros2_messages.h>

namespace toftwin::daemon::ros2 {
namespace {

using KeyValue = diagnostic_msgs_msg_dds__KeyValue_;
using Status = diagnostic_msgs_msg_dds__DiagnosticStatus_;
using Statuses = diagnostic_msgs_msg_dds__DiagnosticArray_;

/// DDS' C structures know no const; what is written is only read.
char* writable(const std::string& text) { return const_cast<char*>(text.c_str()); }

}  // namespace

Diagnosis diagnosisOf(const SourceNow& now, std::uint64_t lost_before) {
  using Level = Diagnosis::Level;
  Diagnosis diagnosis{.level = Level::Ok,
                      .message = now.is_streaming ? "frames come" : "nobody wants frames"};
  if (now.lost > lost_before) {
    diagnosis.level = Level::Warn;
    diagnosis.message = fmt::format("the device lost {} frames", now.lost - lost_before);
  }
  if (!now.is_present) {
    diagnosis.level = Level::Error;
    diagnosis.message = now.problem.empty() ? "the source is not there" : now.problem;
  }
  diagnosis.values = {{"frames", std::to_string(now.frames)},
                      {"lost by the device", std::to_string(now.lost)},
                      {"reconnects", std::to_string(now.reconnects)}};
  return diagnosis;
}

Result<Diagnostics> Diagnostics::open(Participant& participant) {
  const auto writer = participant.write("/diagnostics", diagnostic_msgs_msg_dds__DiagnosticArray__desc,
                                        {.is_reliable = true, .keep_last = 10});
  if (!writer) return writer.error();
  Diagnostics diagnostics;
  diagnostics.writer_ = *writer;
  return diagnostics;
}

Result<> Diagnostics::tell(const std::string& name, const std::string& hardware, const Diagnosis& diagnosis,
                           HostTime now) const {
  if (!writer_.hasReaders()) return {};
  std::vector<KeyValue> values;
  for (const auto& [key, value] : diagnosis.values) values.push_back({writable(key), writable(value)});
  Status status{};
  status.level = static_cast<std::uint8_t>(diagnosis.level);
  status.name = writable(name);
  status.message = writable(diagnosis.message);
  status.hardware_id = writable(hardware);
  const auto count = static_cast<std::uint32_t>(values.size());
  status.values = {count, count, values.data(), false};
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  const std::string no_frame;
  Statuses message{};
  message.header.stamp = {static_cast<std::int32_t>(now.ns / kSecond_ns),
                          static_cast<std::uint32_t>(now.ns % kSecond_ns)};
  message.header.frame_id = writable(no_frame);
  message.status = {1, 1, &status, false};
  return writer_.write(&message);
}

}  // namespace toftwin::daemon::ros2
