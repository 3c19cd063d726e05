// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/configuration.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "drivers/logging.h"

namespace toftwin::drivers::aravis {
namespace {

constexpr double kLargestSide = 16'384.0;
constexpr const char* kHeartbeat = "GevHeartbeatTimeout";
/// Of the bootstrap registers, where the camera does not list it among its features.
constexpr std::uint32_t kHeartbeatRegister = 0x0938;

Error incompatible(std::string what) {
  return {Error::Code::Incompatible, "aravis: " + std::move(what)};
}

/// The first of these features that the camera has.
std::optional<std::string> firstOf(const Features& features,
                                   std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (features.has(name)) return name;
  }
  return std::nullopt;
}

Result<> setTrigger(const Connection& connection, const Features& features, const Keys& keys) {
  Failure failure;
  if (keys.trigger == Trigger::AsSet) return {};
  if (keys.trigger == Trigger::FreeRun) {
    if (features.has("TriggerMode")) arv_camera_clear_triggers(connection.camera(), failure.slot());
  } else {
    const std::string source = keys.trigger == Trigger::Software ? "Software" : keys.trigger_source;
    const auto there = features.entries("TriggerSource");
    if (std::ranges::find(there, source) == there.end()) {
      return Error{
          Error::Code::Incompatible,
          fmt::format("aravis: the camera cannot be triggered by \"{}\"; it has: {}", source,
                      there.empty() ? "none" : fmt::format("{}", fmt::join(there, ", ")))};
    }
    arv_camera_set_trigger(connection.camera(), source.c_str(), failure.slot());
  }
  if (failure) return failure.toError("the trigger cannot be set");
  return {};
}

/// Which images it sends. Several in one frame need multipart, which the library reads from GigE cameras
/// alone.
Result<> setComponents(const Connection& connection, const Features& features, const Keys& keys) {
  const auto there = features.entries("ComponentSelector");
  for (const std::string& one : keys.components) {
    if (std::ranges::find(there, one) != there.end()) continue;
    return Error{Error::Code::Incompatible,
                 fmt::format("aravis: the camera has no component \"{}\"; it has: {}", one,
                             there.empty() ? "none" : fmt::format("{}", fmt::join(there, ", ")))};
  }
  int enabled = 0;
  for (const std::string& one : there) {
    if (auto set = features.setText("ComponentSelector", one); !set) return set;
    const bool is_wanted = std::ranges::find(keys.components, one) != keys.components.end();
    if (!keys.components.empty() && features.isWritable("ComponentEnable")) {
      if (auto set = features.setNumber("ComponentEnable", is_wanted ? 1.0 : 0.0); !set) return set;
    }
    enabled += features.number("ComponentEnable").value_or(0.0) != 0.0 ? 1 : 0;
  }
  Failure failure;
  ArvCamera* camera = connection.camera();
  if (enabled < 2) return {};
  const bool is_gige = arv_camera_is_gv_device(camera) != FALSE;
  if (!is_gige || arv_camera_gv_is_multipart_supported(camera, failure.slot()) == FALSE || failure) {
    return Error{
        Error::Code::Incompatible,
        fmt::format("aravis: the camera sends several images, but {} (multipart); "
                    "choose one by components = [\"Range\"]",
                    is_gige ? "not in one frame" : "libaravis reads only one of a USB camera's frame")};
  }
  arv_camera_gv_set_multipart(camera, TRUE, failure.slot());
  if (failure) return failure.toError("multipart cannot be switched on");
  return {};
}

Result<> setPixelFormat(const Features& features, const Keys& keys) {
  if (keys.pixel_format.empty()) return {};
  const auto components = features.entries("ComponentSelector");
  if (std::ranges::find(components, "Range") != components.end()) {
    if (auto set = features.setText("ComponentSelector", "Range"); !set) return set;
  }
  return features.setText("PixelFormat", keys.pixel_format);
}

Result<> setRate(const Connection& connection, const Keys& keys) {
  if (keys.frame_rate <= 0_Hz) return {};
  Failure failure;
  arv_camera_set_frame_rate(connection.camera(), keys.frame_rate.in(hertz), failure.slot());
  if (failure) return failure.toError("the frame rate cannot be set");
  return {};
}

Result<> setChunksAndClock(const Connection& connection, const Features& features,
                           const Keys& keys) {
  if (keys.ptp) {
    const auto name = firstOf(features, {"PtpEnable", "GevIEEE1588"});
    if (!name) {
      return Error{Error::Code::Incompatible,
                   "aravis: the camera's clock cannot follow the network's; leave out ptp"};
    }
    if (auto set = features.setNumber(*name, 1.0); !set) return set;
  }
  if (!keys.chunks) return {};
  Failure failure;
  arv_camera_set_chunks(connection.camera(), "ExposureTime", failure.slot());
  if (failure) return failure.toError("chunk data cannot be switched on; leave out chunks");
  return {};
}

Result<> setFeatures(const Features& features, const Keys& keys) {
  for (const std::string& one : keys.set) {
    const auto [name, value] = *assignmentOf(one);
    if (auto set = features.setText(name, value); !set) {
      return Error{set.error().code, fmt::format("aravis: set: {}", set.error().message)};
    }
  }
  return {};
}

Result<> setTransport(const Connection& connection, const Features& features, const Keys& keys) {
  ArvCamera* camera = connection.camera();
  if (arv_camera_is_gv_device(camera) == FALSE) return {};
  Failure failure;
  if (keys.heartbeat > 0_ms) {
    const double ms = std::round(keys.heartbeat.in(millisecond));
    if (features.isWritable(kHeartbeat)) {
      const Bounds bounds = features.parameter(kHeartbeat).bounds;
      if (auto set = features.setNumber(kHeartbeat, std::clamp(ms, bounds.min, bounds.max)); !set)
        return set;
    } else {
      arv_device_write_register(connection.device(), kHeartbeatRegister,
                                static_cast<std::uint32_t>(ms), failure.slot());
      if (failure) logging::warn("aravis: the camera keeps its heartbeat timeout");
    }
  }
  if (keys.packet_size > 0) {
    arv_camera_gv_set_packet_size(camera, keys.packet_size, failure.slot());
    if (failure) return failure.toError("packet_size cannot be set");
  } else {
    arv_camera_gv_auto_packet_size(camera, failure.slot());
    if (failure) return failure.toError("the packet size cannot be found out; set packet_size");
  }
  arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
  // Packets from the network card's ring would pass by the packet filter.
  arv_camera_gv_set_stream_options(camera, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  return {};
}

// ---- what came of it ---------------------------------------------------------------------------

/// The pixel format that is set for the component that is selected, if it can be read.
Result<const PixelFormat*> pixelFormat(const Features& features) {
  const auto name = features.text("PixelFormat");
  if (!name) return incompatible("the camera does not say its pixel format");
  const PixelFormat* format = pixelFormatNamed(*name);
  if (format != nullptr) return format;
  return incompatible(fmt::format(
      "pixel format {} cannot be read; choose one of {} by pixel_format, or of {} by set", *name,
      pixelFormatNames(Role::Range), pixelFormatNames(Role::Intensity)));
}

void note(Layout& layout, const PixelFormat& format, bool is_range_component) {
  const bool is_range = is_range_component || format.role == Role::Range;
  if (is_range) {
    layout.has_range = true;
    layout.has_points = format.channels == 3;
  } else if (format.role == Role::Confidence) {
    layout.has_confidence = true;
  } else {
    layout.has_intensity = true;
  }
}

Result<Layout> layoutOf(const Features& features, const Keys& keys) {
  Layout layout{.least_confidence = keys.least_confidence};
  bool is_any_enabled = false;
  for (const std::string& one : features.entries("ComponentSelector")) {
    if (!features.setText("ComponentSelector", one)) continue;
    if (features.number("ComponentEnable").value_or(0.0) == 0.0) continue;
    is_any_enabled = true;
    const auto format = pixelFormat(features);
    if (!format) return format.error();
    note(layout, **format, one == "Range");
  }
  if (!is_any_enabled) {
    const auto format = pixelFormat(features);
    if (!format) return format.error();
    note(layout, **format, false);
  }
  if (!layout.has_range && !layout.has_intensity)
    return incompatible("the camera sends neither range nor intensity");
  return layout;
}

/// Metres of one unit of the camera's coordinates.
Result<double> unitOf(const Features& features, const Keys& keys) {
  if (keys.unit > 0_mm) return keys.unit.in(metre);
  const auto said = features.text("Scan3dDistanceUnit");
  if (!said || *said == "Millimeter") return 1e-3;
  if (*said == "Inch") return 0.0254;
  if (*said == "Meter") return 1.0;
  return incompatible(fmt::format(
      "the camera's coordinates are in units of \"{}\"; say how long one is, by unit_mm", *said));
}

Scan3d::Axis axisOf(const Features& features) {
  Scan3d::Axis axis;
  axis.scale = features.number("Scan3dCoordinateScale").value_or(1.0);
  axis.offset = features.number("Scan3dCoordinateOffset").value_or(0.0);
  // Without the flag, a camera with the value means it (Basler's blaze has the value alone).
  if (features.number("Scan3dInvalidDataFlag").value_or(1.0) != 0.0)
    axis.invalid = features.number("Scan3dInvalidDataValue");
  return axis;
}

Result<Scan3d> scanOf(const Features& features, const Keys& keys, const Layout& layout) {
  Scan3d scan;
  if (!layout.has_range) return scan;
  const auto unit_m = unitOf(features, keys);
  if (!unit_m) return unit_m.error();
  scan.unit_m = *unit_m;
  const std::string system = features.text("Scan3dCoordinateSystem").value_or("Cartesian");
  if (layout.has_points && system != "Cartesian") {
    return incompatible(fmt::format(
        "the camera's points are {}; only Cartesian ones can be read (set it, or send C alone)",
        system));
  }
  scan.c_is_range =
      keys.measures == Measures::AsSaid ? system == "Spherical" : keys.measures == Measures::Range;
  const bool has_selector = features.has("Scan3dCoordinateSelector");
  for (std::size_t i = 0; i < 3; ++i) {
    constexpr std::array kNames{"CoordinateA", "CoordinateB", "CoordinateC"};
    if (has_selector && !features.setText("Scan3dCoordinateSelector", kNames[i])) continue;
    scan.axes[i] = axisOf(features);
  }
  if (scan.axes[2].scale == 0.0 || !std::isfinite(scan.axes[2].scale))
    return incompatible("the camera says that its coordinates have no scale");
  return scan;
}

int pixelsOf(const Features& features, const char* name, double otherwise = 0.0) {
  return static_cast<int>(std::clamp(features.number(name).value_or(otherwise), 0.0, kLargestSide));
}

Region regionOf(const Features& features, int width, int height) {
  Region region{.x = pixelsOf(features, "OffsetX"),
                .y = pixelsOf(features, "OffsetY"),
                .width = width,
                .height = height};
  const auto whole = [&](const std::string& side, const std::string& direction, int offset, int sent) {
    const int binning = std::max(1, pixelsOf(features, ("Binning" + direction).c_str(), 1.0));
    const int decimation = std::max(1, pixelsOf(features, ("Decimation" + direction).c_str(), 1.0));
    region.skips_pixels = region.skips_pixels || decimation > 1;
    return wholeSide(pixelsOf(features, ("Sensor" + side).c_str()) / binning / decimation,
                     pixelsOf(features, (side + "Max").c_str()), offset, sent);
  };
  region.whole_width = whole("Width", "Horizontal", region.x, width);
  region.whole_height = whole("Height", "Vertical", region.y, height);
  return region;
}

std::optional<LensKeys> lensOf(const Features& features) {
  const auto focal = features.number("Scan3dFocalLength");
  const auto u = features.number("Scan3dPrincipalPointU"),
             v = features.number("Scan3dPrincipalPointV");
  if (!focal || !u || !v || !(*focal > 0.0)) return std::nullopt;
  LensKeys lens{.fx = *focal, .cx = *u, .cy = *v};
  const double aspect = features.number("Scan3dAspectRatio").value_or(1.0);
  if (aspect > 0.0) lens.fy = *focal * aspect;
  return lens;
}

void readTiming(const Features& features, Setup& setup) {
  // A selector chooses among triggers; that of frames is the one that starts them.
  if (features.has("TriggerSelector"))
    static_cast<void>(features.setText("TriggerSelector", "FrameStart"));
  setup.is_triggered = isTriggered(features);
  setup.can_trigger =
      setup.is_triggered && features.text("TriggerSource").value_or("") == "Software";
  if (!setup.is_triggered) setup.frame_interval = frameIntervalOf(features);
}

Result<std::vector<std::string>> parametersOf(const Features& features, const Keys& keys) {
  std::vector<std::string> names;
  for (const std::string& one : keys.parameters) {
    const Parameter now = features.parameter(one);
    if (!features.isWritable(one) || (!now.value && !now.text)) {
      return Error{
          Error::Code::NotFound,
          fmt::format("aravis: parameters: the camera has no feature \"{}\" that is a number, a switch, a "
                      "choice or a text and can be set now; arv-tool-0.8 features lists what it has",
                      one)};
    }
    names.push_back(one);
  }
  if (!keys.parameters.empty()) return names;
  for (const char* one : {"ExposureAuto", "ExposureTime", "ExposureTimeAbs", "ExposureTimeRaw",
                          "GainAuto", "Gain", "GainRaw"}) {
    if (features.isWritable(one) && features.number(one)) names.emplace_back(one);
  }
  return names;
}

}  // namespace

bool isTriggered(const Features& features) { return features.text("TriggerMode").value_or("Off") == "On"; }

std::optional<Duration> frameIntervalOf(const Features& features) {
  for (const char* name : {"ResultingFrameRate", "AcquisitionResultingFrameRate", "AcquisitionFrameRate",
                           "AcquisitionFrameRateAbs"}) {
    const auto rate_hz = features.number(name);
    if (rate_hz && *rate_hz > 0.0) return (1.0 / *rate_hz) * second;
  }
  return std::nullopt;
}

std::optional<std::pair<std::string, std::string>> assignmentOf(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos) return std::nullopt;
  const auto trimmed = [](std::string_view part) {
    while (part.starts_with(' ')) part.remove_prefix(1);
    while (part.ends_with(' ')) part.remove_suffix(1);
    return std::string{part};
  };
  const std::string_view all{text};
  std::pair assignment{trimmed(all.substr(0, equals)), trimmed(all.substr(equals + 1))};
  if (assignment.first.empty() || assignment.second.empty()) return std::nullopt;
  return assignment;
}

Result<Setup> configure(const Connection& connection, const Keys& keys) {
  const Features features{connection.device()};
  Failure ignored;
  // Whoever had it before may have left it streaming.
  arv_camera_stop_acquisition(connection.camera(), ignored.slot());
  Result<> done = setComponents(connection, features, keys);
  if (done) done = setPixelFormat(features, keys);
  if (done) done = setTrigger(connection, features, keys);
  if (done) done = setRate(connection, keys);
  if (done) done = setChunksAndClock(connection, features, keys);
  if (done) done = setFeatures(features, keys);
  if (done) done = setTransport(connection, features, keys);
  if (!done) return done.error();
  Setup setup;
  const auto layout = layoutOf(features, keys);
  if (!layout) return layout.error();
  setup.layout = *layout;
  const double width = features.number("Width").value_or(0.0),
               height = features.number("Height").value_or(0.0);
  if (!(width >= 1.0 && width <= kLargestSide && height >= 1.0 && height <= kLargestSide)) {
    return incompatible(fmt::format("the camera says that its image is {} x {}", width, height));
  }
  setup.width = static_cast<int>(width);
  setup.height = static_cast<int>(height);
  setup.region = regionOf(features, setup.width, setup.height);
  auto scan = scanOf(features, keys, *layout);
  if (!scan) return scan.error();
  setup.scan = *scan;
  setup.lens = lensOf(features);
  readTiming(features, setup);
  auto parameters = parametersOf(features, keys);
  if (!parameters) return parameters.error();
  setup.parameters = *std::move(parameters);
  return setup;
}

}  // namespace toftwin::drivers::aravis
