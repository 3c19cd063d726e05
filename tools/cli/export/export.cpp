// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/export/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include <toftwin/names.h>

#include "tools/cli/export/atomic_file.h"
#include "tools/cli/export/hdf5.h"

namespace toftwin::cli {
namespace {

struct FormatRow {
  std::string_view extension;
  Format format;
  Result<Exported> (*make)(const Frame&, const ExportOptions&);
};
Result<Exported> noBytes(const Frame&, const ExportOptions&) {
  return Error{Error::Code::Unsupported, "HDF5 is written into files only"};
}

constexpr std::array kFormats{
    FormatRow{".png", Format::Png, &toPng},
    FormatRow{".ply", Format::Ply, &toPly},
    FormatRow{".npy", Format::Npy, &toNpy},
    FormatRow{".csv", Format::Csv, &toCsv},
    FormatRow{".h5", Format::Hdf5, &noBytes},
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
  const bool is_metres = kind == PlaneKind::Range || kind == PlaneKind::Depth ||
                         kind == PlaneKind::TruthRange || kind == PlaneKind::LightSigma;
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

Result<Exported> exportBytes(const Frame& frame, const std::filesystem::path& file,
                             const ExportOptions& options) {
  const auto format = formatOf(file);
  if (!format) return format.error();
  return std::ranges::find(kFormats, *format, &FormatRow::format)->make(frame, options);
}

Result<std::string> exportFrame(const Frame& frame, const std::filesystem::path& file,
                                const ExportOptions& options) {
  if (const auto format = formatOf(file); format && *format == Format::Hdf5) {
    auto hdf5 = Hdf5File::create(file, frame, {.planes = options.planes, .about = {}});
    if (!hdf5) return hdf5.error();
    if (auto wrote = hdf5->append(frame); !wrote) return wrote.error();
    if (auto closed = hdf5->close(); !closed) return closed.error();
    if (auto published = hdf5->publish(); !published) return published.error();
    return hdf5->note();
  }
  auto exported = exportBytes(frame, file, options);
  if (!exported) return exported.error();
  if (auto wrote = writeWhole(file, exported->bytes); !wrote) return wrote.error();
  return std::move(exported->note);
}

}  // namespace toftwin::cli
