// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/export/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include <toftwin/names.h>

#include "tools/cli/export/atomic_file.h"
#include "tools/cli/export/folders.h"
#include "tools/cli/export/frame_sink.h"

namespace toftwin::cli {
namespace {

/// `make`: a file of one frame; `open`: one of many, whose frames are added one after the other.
struct FormatRow {
  std::string_view name, extension;
  Format format;
  Result<Exported> (*make)(const Frame&, const ExportOptions&);
  OpenSink open;
  std::string_view what;  ///< for people, of formats whose extension is not theirs alone
};

constexpr std::array kFormats{
    FormatRow{"png", ".png", Format::Png, &toPng, nullptr, ""},
    FormatRow{"ply", ".ply", Format::Ply, &toPly, nullptr, ""},
    FormatRow{"npy", ".npy", Format::Npy, &toNpy, nullptr, ""},
    FormatRow{"csv", ".csv", Format::Csv, &toCsv, nullptr, ""},
    FormatRow{"pcd", ".pcd", Format::Pcd, &toPcd, nullptr, ""},
    FormatRow{"tiff", ".tif", Format::Tiff, &toTiff, nullptr, ""},
    FormatRow{"exr", ".exr", Format::Exr, &toExr, nullptr, ""},
    FormatRow{"h5", ".h5", Format::Hdf5, nullptr, &openHdf5, ""},
    FormatRow{"ros2", ".mcap", Format::Ros2, nullptr, &openRos2, "a bag of ROS 2"},
    FormatRow{"foxglove", ".mcap", Format::Foxglove, nullptr, &openFoxglove, "Foxglove's messages"},
    FormatRow{"toftwin", ".mcap", Format::Recording, nullptr, &openRecording, "a recording as toftwin's are"},
    FormatRow{"tum", "", Format::Tum, nullptr, &openTumFolder, "a folder as of TUM's RGB-D benchmark"},
    FormatRow{"colmap", "", Format::Colmap, nullptr, &openColmapFolder, "a folder as COLMAP's"},
};

const FormatRow& rowOf(Format format) { return *std::ranges::find(kFormats, format, &FormatRow::format); }

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

std::string formatNames() {
  std::string names;
  for (const FormatRow& row : kFormats) names += (names.empty() ? "" : ", ") + std::string{row.name};
  return names;
}

Result<Format> formatOf(const std::filesystem::path& file, std::string_view name) {
  std::string known, choice;
  std::vector<Format> found;
  for (const FormatRow& row : kFormats) {
    if (!name.empty() && row.name == name) return row.format;
    if (file.extension() == row.extension) {
      found.push_back(row.format);
      choice += fmt::format("{}--format {} for {}", choice.empty() ? "" : ", ", row.name, row.what);
    }
    if (!row.extension.empty() && known.find(row.extension) == known.npos) known += (known.empty() ? "" : ", ") + std::string{row.extension};
  }
  if (!name.empty()) return Error{Error::Code::InvalidArgument, fmt::format("there is no format \"{}\"; the formats are: {}", name, formatNames())};
  if (found.size() == 1) return found.front();
  if (found.size() > 1) return Error{Error::Code::InvalidArgument, fmt::format("{}: its extension can be of several formats: {}", file.string(), choice)};
  return Error{Error::Code::InvalidArgument,
               fmt::format("{}: the extension says the format, and must be one of: {}; or --format says it",
                           file.string(), known)};
}

std::string_view extensionOf(Format format) { return rowOf(format).extension; }
bool holdsManyFrames(Format format) { return rowOf(format).open != nullptr; }

Result<std::unique_ptr<FrameSink>> openSink(const std::filesystem::path& file, const ExportOptions& how, const SinkOptions& options) {
  const auto format = formatOf(file, how.format);
  if (!format) return format.error();
  if (const OpenSink open = rowOf(*format).open) return open(file, how, options);
  return Error{Error::Code::InvalidArgument, fmt::format("{}: a file of {} holds one frame", file.string(), rowOf(*format).name)};
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
  const auto format = formatOf(file, options.format);
  if (!format) return format.error();
  if (const auto make = rowOf(*format).make) return make(frame, options);
  return Error{Error::Code::Unsupported, fmt::format("{} is written into files only", rowOf(*format).name)};
}

Result<std::string> exportFrame(const Frame& frame, const std::filesystem::path& file,
                                const ExportOptions& options) {
  if (const auto format = formatOf(file, options.format); format && holdsManyFrames(*format)) {
    const auto sink = openSink(file, options, {});
    if (!sink) return sink.error();
    if (auto wrote = (*sink)->add(frame); !wrote) return wrote.error();
    if (auto finished = (*sink)->finish(); !finished) return finished.error();
    return (*sink)->note();
  }
  auto exported = exportBytes(frame, file, options);
  if (!exported) return exported.error();
  if (auto wrote = writeWhole(file, exported->bytes); !wrote) return wrote.error();
  return std::move(exported->note);
}

}  // namespace toftwin::cli
