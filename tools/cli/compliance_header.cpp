// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/compliance_header.h"

#include <link.h>
#include <sys/utsname.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <string_view>

#include <toftwin/names.h>

#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace {

using Clock = std::chrono::steady_clock;

/// The files of the camera libraries in this process, whose names end in their versions.
std::vector<std::string> librariesOfCameras() {
  std::vector<std::string> paths;
  const auto note = [](dl_phdr_info* library, std::size_t, void* to) {
    if (library->dlpi_name != nullptr) static_cast<std::vector<std::string>*>(to)->emplace_back(library->dlpi_name);
    return 0;
  };
  dl_iterate_phdr(note, &paths);
  std::vector<std::string> names;
  for (const std::string& path : paths) {
    constexpr std::array<std::string_view, 4> kOfCameras{"libaravis", "libOpenNI2", "libusb-1.0", "libmodbus"};
    std::error_code none;
    const std::string name = std::filesystem::weakly_canonical(path, none).filename().string();
    if (std::ranges::any_of(kOfCameras, [&](std::string_view of) { return name.starts_with(of); }))
      names.push_back(name);
  }
  return names;
}

/// Frames per second, of up to two seconds. Nothing for a camera that waits to be triggered, or that gives too few.
std::optional<double> rateOf(drivers::Source& source, std::chrono::milliseconds frame_timeout) {
  constexpr std::chrono::seconds kLongest{2};
  if (source.info().can_trigger || !source.start()) return std::nullopt;
  const auto began = Clock::now();
  std::optional<Clock::time_point> first;
  Clock::time_point last;
  int intervals = 0;
  while (!interrupted() && Clock::now() < (first ? *first + kLongest : began + frame_timeout)) {
    const auto frame = source.next({}, false);
    if (!frame && frame.error().code != Error::Code::Timeout && frame.error().code != Error::Code::Malformed) break;
    if (!frame) continue;
    last = Clock::now();
    intervals += first ? 1 : 0;
    first = first.value_or(last);
  }
  source.stop();
  if (intervals == 0) return std::nullopt;
  return intervals / std::chrono::duration<double>(last - *first).count();
}

}  // namespace

ReportHeader headerOfMachine(const std::string& camera, const std::string& keys) {
  utsname system{};
  ::uname(&system);
  return {{"toftwin", TOFTWIN_VERSION},
          {"kernel", fmt::format("{} {} {}", system.sysname, system.release, system.machine)},
          {"libraries", compare::Json::arrayOf(librariesOfCameras())},
          {"camera", camera},
          {"keys", keys}};
}

ReportHeader headerOfCamera(drivers::Source& source, std::chrono::milliseconds frame_timeout) {
  const drivers::SourceInfo info = source.info();
  compare::Json planes = compare::Json::array();
  for (const PlaneKind kind : info.planes) planes.push(std::string{nameOf(kind)});
  const auto interval = info.frame_interval;
  const auto rate = rateOf(source, frame_timeout);
  return {{"driver", info.driver},
          {"model", info.model},
          {"serial", info.serial},
          {"width", info.camera.width},
          {"height", info.camera.height},
          {"planes", std::move(planes)},
          {"nominal_rate_hz", interval ? compare::Json{1.0 / interval->in(second)} : compare::Json{}},
          {"measured_rate_hz", rate ? compare::Json{*rate} : compare::Json{}}};
}

}  // namespace toftwin::cli
