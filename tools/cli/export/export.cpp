// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/export/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include <toftwin/names.h>

#include "tools/cli/export/atomic_file.h"

namespace toftwin::cli {
namespace {

struct FormatRow {
  std::string_view extension;
  Format format;
  Result<Exported> (*make)(const Frame&, const ExportOptions&);
};
constexpr std::array kFormats{
    FormatRow{".png", Format::Png, &toPng},
    FormatRow{".ply", Format::Ply, &toPly},
    FormatRow{".npy", Format::Npy, &toNpy},
    FormatRow{".csv", Format::Csv, &toCsv},
};

std::string namesOf(const std::vector<Plane>& planes) {
  std::string names;
  for (const Plane& plane : planes)
    names += (names.empty() ? "" : ", ") + std::string{nameOf(plane.kind)};
  return names.empty() ? "no planes" : names;
}

template <class Element>
void appendChannel(const Plane& plane, std::size_t channel, std::vector<float>& values) {
  const std::size_t pixels =
      static_cast<std::size_t>(plane.width) * static_cast<std::size_t>(plane.height);
  for (Element element : plane.as<Element>().subspan(channel * pixels, pixels)) {
    values.push_back(static_cast<float>(element));
  }
}

}  // namespace

Result<Format> formatOf(const std::filesystem::path& file) {
  std::string known;
  for (const FormatRow& row : kFormats) {
    if (file.extension() == row.extension) return row.format;
    known += (known.empty() ? "" : ", ") + std::string{row.extension};
  }
  return Error{Error::Code::InvalidArgument,
               fmt::format("{}: the extension says the format, and must be one of: {}",
                           file.string(), known)};
}

std::string_view unitOf(PlaneKind kind) {
  const bool is_metres =
      kind == PlaneKind::Range || kind == PlaneKind::Depth || kind == PlaneKind::TruthRange;
  return is_metres ? "m" : "";
}

Result<const Plane*> choosePlane(const Frame& frame, const std::vector<PlaneKind>& wanted) {
  for (PlaneKind kind : wanted.empty() ? std::vector{PlaneKind::Range, PlaneKind::Depth} : wanted) {
    if (const Plane* plane = frame.find(kind)) return plane;
    if (!wanted.empty()) break;
  }
  return Error{Error::Code::NotFound,
               fmt::format("frames of {} have no plane {}; they have: {}", frame.source,
                           wanted.empty() ? "range or depth" : nameOf(wanted.front()),
                           namesOf(frame.planes))};
}

Result<Picture> pictureOf(const Plane& plane, int channel) {
  if (plane.width < 1 || plane.height < 1 || plane.data.size() != plane.byteSize()) {
    return Error{Error::Code::Malformed,
                 fmt::format("plane {} does not hold its pixels", nameOf(plane.kind))};
  }
  if (channel < 0 || channel >= plane.channels) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("plane {} has the channels 0 to {}, not {}", nameOf(plane.kind),
                             plane.channels - 1, channel)};
  }
  Picture picture{&plane, {}};
  const auto index = static_cast<std::size_t>(channel);
  switch (plane.type) {
    case ElementType::U8:
      appendChannel<std::uint8_t>(plane, index, picture.values);
      break;
    case ElementType::U16:
      appendChannel<std::uint16_t>(plane, index, picture.values);
      break;
    case ElementType::F32:
      appendChannel<float>(plane, index, picture.values);
      break;
  }
  return picture;
}

Result<std::string> exportFrame(const Frame& frame, const std::filesystem::path& file,
                                const ExportOptions& options) {
  const auto format = formatOf(file);
  if (!format) return format.error();
  const auto row = std::ranges::find(kFormats, *format, &FormatRow::format);
  auto exported = row->make(frame, options);
  if (!exported) return exported.error();
  if (auto wrote = writeWhole(file, exported->bytes); !wrote) return wrote.error();
  return std::move(exported->note);
}

}  // namespace toftwin::cli
