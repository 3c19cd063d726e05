// SPDX-License-Identifier: Apache-2.0
// NPY: one plane as it is, all its channels. CSV: a line per pixel, a column per plane.
#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include <toftwin/names.h>

#include "tools/cli/export/export.h"

namespace toftwin::cli {
namespace {

std::vector<std::byte> bytesOf(std::string_view text) {
  const auto bytes = std::as_bytes(std::span{text});
  return {bytes.begin(), bytes.end()};
}

struct TextColumn {
  std::string name;
  std::vector<float> values;
};

/// The planes that were asked for, or all whose pixels are the image's.
Result<std::vector<TextColumn>> columnsOf(const Frame& frame, const ExportOptions& options) {
  std::vector<const Plane*> planes;
  if (options.planes.empty()) {
    for (const Plane& plane : frame.planes) {
      if (plane.width == frame.camera.width && plane.height == frame.camera.height)
        planes.push_back(&plane);
    }
  }
  for (const PlaneKind kind : options.planes) {
    const auto plane = choosePlane(frame, {kind});
    if (!plane) return plane.error();
    planes.push_back(*plane);
  }
  std::vector<TextColumn> columns;
  for (const Plane* plane : planes) {
    auto picture = pictureOf(*plane, plane->channels > 1 ? options.channel : 0);
    if (!picture) return picture.error();
    const std::string_view unit = unitOf(plane->kind);
    columns.push_back({fmt::format("{}{}{}{}", nameOf(plane->kind),
                                   plane->channels > 1 ? fmt::format("_{}", options.channel) : "",
                                   unit.empty() ? "" : "_", unit),
                       std::move(picture->values)});
    if (columns.back().values.size() != columns.front().values.size()) {
      return Error{Error::Code::InvalidArgument,
                   fmt::format("plane {} has another size than the others; export it alone",
                               nameOf(plane->kind))};
    }
  }
  if (columns.empty()) {
    return Error{Error::Code::NotFound,
                 fmt::format("frames of {} have no planes to export", frame.source)};
  }
  return columns;
}

}  // namespace

std::vector<std::byte> npyHeader(std::string_view type, const std::string& shape) {
  std::string header = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", type, shape);
  // Magic, version and length are 10 bytes; the data begins at a multiple of 64 after a line break.
  header.append(64 - (10 + header.size() + 1) % 64, ' ');
  header += '\n';
  std::string start{"\x93NUMPY\x01\x00", 8};
  start += static_cast<char>(header.size() & 0xff);
  start += static_cast<char>(header.size() >> 8);
  return bytesOf(start + header);
}

Result<Exported> toNpy(const Frame& frame, const ExportOptions& options) {
  const auto plane = choosePlane(frame, options.planes);
  if (!plane) return plane.error();
  const Plane& chosen = **plane;
  if (const auto checked = pictureOf(chosen, 0); !checked) return checked.error();
  const char* type = chosen.type == ElementType::U8    ? "|u1"
                     : chosen.type == ElementType::U16 ? "<u2"
                                                       : "<f4";
  const std::string shape =
      chosen.channels > 1 ? fmt::format("{}, {}, {}", chosen.channels, chosen.height, chosen.width)
                          : fmt::format("{}, {}", chosen.height, chosen.width);
  Exported exported{npyHeader(type, shape), {}};
  const auto data = chosen.data.bytes();
  exported.bytes.insert(exported.bytes.end(), data.begin(), data.end());
  exported.note =
      fmt::format("{}{}{}, shape ({})", nameOf(chosen.kind),
                  unitOf(chosen.kind).empty() ? "" : " in ", unitOf(chosen.kind), shape);
  return exported;
}

Result<Exported> toCsv(const Frame& frame, const ExportOptions& options) {
  const auto columns = columnsOf(frame, options);
  if (!columns) return columns.error();
  const auto plane = options.planes.empty() ? nullptr : frame.find(options.planes.front());
  const int width = plane != nullptr ? plane->width : frame.camera.width;
  const int height = static_cast<int>(columns->front().values.size()) / width;
  if (options.row && (*options.row < 0 || *options.row >= height)) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("the image has the rows 0 to {}, not {}", height - 1, *options.row)};
  }
  std::string text = "x_px,y_px";
  for (const TextColumn& column : *columns) text += "," + column.name;
  text += '\n';
  for (int y = options.row.value_or(0); y < (options.row ? *options.row + 1 : height); ++y) {
    for (int x = 0; x < width; ++x) {
      fmt::format_to(std::back_inserter(text), "{},{}", x, y);
      for (const TextColumn& column : *columns) {
        const float value =
            column.values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                          static_cast<std::size_t>(x)];
        if (std::isnan(value))
          text += ",nan";
        else
          fmt::format_to(std::back_inserter(text), ",{:.9g}", value);
      }
      text += '\n';
    }
  }
  return Exported{bytesOf(text), fmt::format("{} columns, {} rows", columns->size() + 2,
                                             options.row ? width : width * height)};
}

}  // namespace toftwin::cli
