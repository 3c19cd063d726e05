// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/export/hdf5_columns.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>
#include <numeric>

#include <toftwin/names.h>

#include "tools/cli/export/export.h"

namespace toftwin::cli {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr std::string_view kPlanes = "/planes/";
constexpr const char* kCameraAxes = "camera: x right, y down, z along the optical axis";

template <class T>
std::vector<std::byte> bytesOf(const std::vector<T>& values) {
  const auto bytes = std::as_bytes(std::span{values});
  return {bytes.begin(), bytes.end()};
}

/// One thing that is said about every frame: its column, but for the shape of lists, and its numbers.
template <class T>
struct Said {
  const char* path;
  CellType type;
  bool is_list;  ///< as many numbers as the frame has of them
  std::vector<std::pair<std::string, std::string>> attributes;
  std::function<std::vector<T>(const Frame&)> numbers;
};

template <class T>
std::vector<T> ofExposures(const Frame& frame, const std::function<T(const Exposure&)>& number) {
  std::vector<T> numbers;
  for (const Exposure& exposure : frame.moment.exposures) numbers.push_back(number(exposure));
  return numbers;
}

const std::vector<Said<std::uint64_t>>& counts() {
  static const std::vector<Said<std::uint64_t>> kCounts{
      {"/frames/sequence",
       CellType::U64,
       false,
       {{"meaning", "number of the frame; it counts up by one per source"}},
       [](const Frame& frame) { return std::vector{frame.sequence}; }},
      {"/frames/dropped",
       CellType::U64,
       false,
       {{"meaning", "frames that were lost since the one before"}},
       [](const Frame& frame) { return std::vector{frame.dropped_before + frame.dropped_by_device}; }},
  };
  return kCounts;
}

const std::vector<Said<std::int64_t>>& times() {
  static const std::vector<Said<std::int64_t>> kTimes{
      {"/frames/received_ns",
       CellType::I64,
       false,
       {{"unit", "ns"},
        {"meaning",
         "when the whole frame was there, since 1970-01-01 UTC; of a rendered frame: "
         "the end of its last raw exposure, on its own clock"}},
       [](const Frame& frame) { return std::vector{frame.moment.received.ns}; }},
      {"/frames/exposure_start_ns",
       CellType::I64,
       true,
       {{"unit", "ns"},
        {"axes", "frame, raw exposure"},
        {"meaning", "when each raw exposure began, on the camera's own clock"}},
       [](const Frame& frame) {
         return ofExposures<std::int64_t>(frame, [](const Exposure& e) { return e.start.ns; });
       }},
  };
  return kTimes;
}

std::vector<double> positionOf(const Frame& frame) {
  const auto& pose = frame.moment.world_from_camera;
  if (!pose) return {kUnknown, kUnknown, kUnknown};
  return {pose->translation_m.x, pose->translation_m.y, pose->translation_m.z};
}

std::vector<double> rotationOf(const Frame& frame) {
  const auto& pose = frame.moment.world_from_camera;
  if (!pose) return std::vector<double>(4, kUnknown);
  return {pose->rotation_wxyz.begin(), pose->rotation_wxyz.end()};
}

const std::vector<Said<double>>& numbers() {
  static const std::vector<Said<double>> kNumbers{
      {"/frames/exposure_duration_s",
       CellType::F64,
       true,
       {{"unit", "s"}, {"axes", "frame, raw exposure"}},
       [](const Frame& frame) {
         return ofExposures<double>(frame, [](const Exposure& e) { return e.duration.in(second); });
       }},
      {"/frames/exposure_modulation_hz",
       CellType::F64,
       true,
       {{"unit", "Hz"},
        {"axes", "frame, raw exposure"},
        {"meaning", "0: not modulated (gates, or ambient light)"}},
       [](const Frame& frame) {
         return ofExposures<double>(frame, [](const Exposure& e) { return e.modulation.in(hertz); });
       }},
      {"/frames/position_m",
       CellType::F64,
       false,
       {{"unit", "m"},
        {"axes", "frame, xyz"},
        {"frame_of_reference", "world"},
        {"invalid", "NaN: not known"},
        {"meaning", "translation of world_from_camera: where the camera's pinhole is"}},
       positionOf},
      {"/frames/rotation_wxyz",
       CellType::F64,
       false,
       {{"axes", "frame, wxyz"},
        {"frame_of_reference", "world"},
        {"invalid", "NaN: not known"},
        {"meaning",
         "rotation of world_from_camera, a unit quaternion: it takes the camera's axes (x right, y "
         "down, z ahead) to the world's"}},
       rotationOf},
      {"/frames/since_power_on_s",
       CellType::F64,
       false,
       {{"unit", "s"}, {"invalid", "NaN: not known"}},
       [](const Frame& frame) {
         const auto& time = frame.moment.since_power_on;
         return std::vector{time ? time->in(second) : kUnknown};
       }},
      {"/frames/ambient_klx",
       CellType::F64,
       false,
       {{"unit", "klx"}, {"invalid", "NaN: not known"}},
       [](const Frame& frame) {
         const auto& ambient = frame.moment.ambient;
         return std::vector{ambient ? ambient->in(kilolux) : kUnknown};
       }},
      {"/frames/temperature_c",
       CellType::F64,
       true,
       {{"unit", "degC"}, {"axes", "frame, sensor"}},
       [](const Frame& frame) {
         std::vector<double> all;
         for (const NamedTemperature& t : frame.moment.temperatures) all.push_back(t.value.in(celsius));
         return all;
       }},
  };
  return kNumbers;
}

template <class T>
Column columnOf(const Said<T>& said, const Frame& frame) {
  const std::size_t count = said.numbers(frame).size();
  Column column{said.path, said.type, {}, said.attributes};
  if (said.is_list || count > 1) column.shape = {count};
  return column;
}

struct About {
  const char* meaning;
  const char* invalid;
};

About aboutOf(PlaneKind kind) {
  switch (kind) {
    case PlaneKind::Range:
      return {"distance along the pixel's ray, as measured", "NaN"};
    case PlaneKind::Depth:
      return {"distance along the optical axis (z), as measured", "NaN"};
    case PlaneKind::Amplitude:
      return {"of the modulated signal; electrons if simulated, else the device's unit", ""};
    case PlaneKind::Ambient:
      return {"part that is not modulated, in the amplitude's unit", ""};
    case PlaneKind::Flags:
      return {"bits that say why a pixel is not to be trusted", ""};
    case PlaneKind::Samples:
      return {"raw correlation samples or gate charges; channel = frequency * steps + step", "NaN"};
    case PlaneKind::Phasors:
      return {"demodulated; channel 2 f is the real, 2 f + 1 the imaginary part of frequency f", "NaN"};
    case PlaneKind::TruthRange:
      return {"true distance along the pixel's central ray to the first surface", "NaN: none"};
    case PlaneKind::TruthNormal:
      return {"true unit normal of that surface; channels x, y, z", "NaN: none"};
    case PlaneKind::Exposure:
      return {"which of several exposures the pixel is of, counted from 0", ""};
    case PlaneKind::Color:
      return {"sRGB; channels red, green, blue", ""};
    case PlaneKind::LightSigma:
      return {
          "standard deviation that the simulated light's own noise leaves in the range; channel = frequency",
          "NaN"};
  }
  return {"", ""};
}

/// "1 invalid, 2 saturated, …"
std::string flagBits() {
  std::string bits;
  for (unsigned bit = 1; bit < 256; bit <<= 1)
    bits += fmt::format("{}{} {}", bits.empty() ? "" : ", ", bit, nameOf(static_cast<PixelFlag>(bit)));
  return bits;
}

Column columnOf(const Plane& plane) {
  const auto size = [](int n) { return static_cast<std::size_t>(n); };
  const CellType type = plane.type == ElementType::U8    ? CellType::U8
                        : plane.type == ElementType::U16 ? CellType::U16
                                                         : CellType::F32;
  Column column{std::string{kPlanes} + std::string{nameOf(plane.kind)},
                type,
                {size(plane.height), size(plane.width)},
                {}};
  const bool has_channels = plane.channels > 1;
  if (has_channels) column.shape.insert(column.shape.begin(), size(plane.channels));
  const About about = aboutOf(plane.kind);
  column.attributes = {{"meaning", about.meaning},
                       {"axes", has_channels ? "frame, channel, row, column" : "frame, row, column"},
                       {"frame_of_reference", kCameraAxes}};
  if (!unitOf(plane.kind).empty()) column.attributes.emplace_back("unit", unitOf(plane.kind));
  if (*about.invalid != '\0') column.attributes.emplace_back("invalid", about.invalid);
  if (plane.kind == PlaneKind::Flags) column.attributes.emplace_back("bits", flagBits());
  return column;
}

Error doesNotFit(const Frame& frame, const std::string& what) {
  return {
      Error::Code::Incompatible,
      fmt::format("frame {} of {} {}, unlike the first frame in this file; a recording (.mcap) can hold both",
                  frame.sequence, frame.source, what)};
}

template <class T>
Result<std::vector<std::byte>> cellOf(const Said<T>& said, const Frame& frame, const Column& column) {
  std::vector<std::byte> cell = bytesOf(said.numbers(frame));
  if (cell.size() == column.rowSize()) return cell;
  return doesNotFit(frame, fmt::format("has another number of values for {}", column.path));
}

Result<std::vector<std::byte>> cellOf(const Frame& frame, const Column& column) {
  const auto kind = planeKindNamed(std::string_view{column.path}.substr(kPlanes.size()));
  const Plane* plane = kind ? frame.find(*kind) : nullptr;
  if (plane == nullptr)
    return doesNotFit(frame, fmt::format("has no plane {}", column.path.substr(kPlanes.size())));
  if (columnOf(*plane).shape != column.shape || columnOf(*plane).type != column.type ||
      plane->data.size() != column.rowSize()) {
    return doesNotFit(frame, fmt::format("has a plane {} of another size", nameOf(*kind)));
  }
  const auto bytes = plane->data.bytes();
  return std::vector<std::byte>{bytes.begin(), bytes.end()};
}

/// All that is said, in its order, to whoever asks for it.
template <class Take>
void forAllSaid(Take take) {
  for (const auto& said : counts()) take(said);
  for (const auto& said : times()) take(said);
  for (const auto& said : numbers()) take(said);
}

}  // namespace

std::size_t sizeOf(CellType type) {
  switch (type) {
    case CellType::U8:
      return 1;
    case CellType::U16:
      return 2;
    case CellType::U32:
    case CellType::F32:
      return 4;
    default:
      return 8;
  }
}

std::size_t Column::rowSize() const {
  return std::accumulate(shape.begin(), shape.end(), sizeOf(type), std::multiplies<>{});
}

Result<std::vector<Column>> columnsFor(const Frame& frame, const std::vector<PlaneKind>& planes) {
  std::vector<Column> columns;
  for (const Plane& plane : frame.planes) {
    if (plane.width < 1 || plane.height < 1 || plane.channels < 1 || plane.data.size() != plane.byteSize()) {
      return Error{Error::Code::Malformed,
                   fmt::format("plane {} does not hold its pixels", nameOf(plane.kind))};
    }
    const bool is_wanted = planes.empty() || std::ranges::find(planes, plane.kind) != planes.end();
    if (is_wanted && frame.find(plane.kind) == &plane) columns.push_back(columnOf(plane));
  }
  for (const PlaneKind kind : planes) {
    if (const auto chosen = choosePlane(frame, {kind}); !chosen) return chosen.error();
  }
  if (columns.empty())
    return Error{Error::Code::NotFound, fmt::format("frames of {} have no planes to export", frame.source)};
  forAllSaid([&](const auto& said) {
    Column column = columnOf(said, frame);
    if (column.rowSize() == 0) return;
    if (column.path == "/frames/temperature_c") {
      std::string names;
      for (const NamedTemperature& t : frame.moment.temperatures)
        names += (names.empty() ? "" : ", ") + t.where;
      column.attributes.emplace_back("sensors", names);
    }
    columns.push_back(std::move(column));
  });
  return columns;
}

Result<Row> rowOf(const Frame& frame, const std::vector<Column>& columns) {
  Row row;
  for (const Column& column : columns) {
    Result<std::vector<std::byte>> cell{std::vector<std::byte>{}};
    if (column.path.starts_with(kPlanes)) {
      cell = cellOf(frame, column);
    } else {
      forAllSaid([&](const auto& said) {
        if (column.path == said.path) cell = cellOf(said, frame, column);
      });
    }
    if (!cell) return cell.error();
    row.push_back(*std::move(cell));
  }
  return row;
}

std::vector<std::pair<std::string, std::string>> textsOf(const Frame& frame) {
  const Provenance& from = frame.provenance;
  return {{"format", "toftwin frames 1"},
          {"written_by", "toftwin " TOFTWIN_VERSION},
          {"source", frame.source},
          {"kind", std::string{nameOf(from.kind)}},
          {"camera_frame", "x right, y down, z along the optical axis; metres"},
          {"pixels", "pixel (0, 0) is the centre of the top left pixel; x = column, y = row"},
          {"lens",
           "pinhole fx, fy, cx, cy in pixels with the distortion k1 k2 p1 p2 k3 (Brown-Conrady, as OpenCV)"},
          {"calibration_id", frame.camera.calibration_id},
          {"model_id", from.model_id},
          {"scene_id", from.scene_id},
          {"seed", std::to_string(from.seed)},
          {"effects", fmt::format("{}", fmt::join(from.effects, ", "))}};
}

std::vector<std::pair<std::string, std::vector<double>>> numbersOf(const Frame& frame) {
  const CameraInfo& camera = frame.camera;
  return {{"width", {static_cast<double>(camera.width)}},
          {"height", {static_cast<double>(camera.height)}},
          {"fx", {camera.fx}},
          {"fy", {camera.fy}},
          {"cx", {camera.cx}},
          {"cy", {camera.cy}},
          {"distortion", {camera.distortion.begin(), camera.distortion.end()}}};
}

}  // namespace toftwin::cli
