// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/file_kind.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <span>
#include <string_view>

#include "protocol/record/recording.h"
#include "sim/pictures/size.h"
#include "tools/cli/import/bag/bag.h"

namespace toftwin::cli {
namespace {

using Reader = FileKind::Reader;

constexpr std::size_t kHead = 1u << 16;

struct Start {
  std::string_view bytes;
  FileKind kind;
};

/// Formats that begin in one way, whatever their name.
const std::array kStarts{
    Start{{"\x89MCAP", 5}, {Reader::Recording, "MCAP file"}},
    Start{{"SQLite format 3\0", 16}, {Reader::Bag, "SQLite database"}},
    Start{{"#ROSBAG V2.0", 12}, {Reader::Bag, "ROS 1 bag"}},
    Start{{"\x89HDF\r\n\x1a\n", 8}, {Reader::None, "HDF5 file; h5dump shows what is in it"}},
    Start{{"\x93NUMPY", 6}, {Reader::None, "array of NumPy; toftwin import makes a recording of it"}},
    Start{{"PK\3\4", 4}, {Reader::None, "ZIP archive; an archive of NumPy (.npz) is one, of which toftwin import makes a recording"}},
    Start{{"ply", 3}, {Reader::None, "PLY file: mesh or point cloud; a scene names it by mesh = …, toftwin import takes organised clouds"}},
    Start{{"\x76\x2f\x31\x01", 4}, {Reader::None, "OpenEXR picture"}},
    Start{{"glTF", 4}, {Reader::None, "glTF scene (GLB); toftwin scene check lists what is in it"}},
    Start{{"# .PCD", 6}, {Reader::None, "point cloud of PCL (PCD); toftwin import makes a recording of organised ones"}},
    Start{{"\x1f\x8b", 2}, {Reader::None, "gzip archive; unpack it first"}},
    Start{{"\x28\xb5\x2f\xfd", 4}, {Reader::None, "zstd archive; unpack it first"}},
    Start{{"solid ", 6}, {Reader::None, "STL mesh; a scene names it by mesh = …"}},
};

/// Formats of which a word near the beginning tells.
std::optional<FileKind> kindOfText(std::string_view text) {
  const auto has = [&](std::string_view word) { return text.find(word) != text.npos; };
  if (has("<sdf")) return FileKind{Reader::None, "SDF world or model (Gazebo); toftwin scene check lists what is in it"};
  if (has("<robot")) return FileKind{Reader::None, "URDF robot (ROS); toftwin scene check lists what is in it"};
  if (has("<COLLADA")) return FileKind{Reader::None, "COLLADA mesh (DAE); a scene names it by mesh = …"};
  if (has("\"asset\"") && has("\"version\"")) return FileKind{Reader::None, "glTF scene; toftwin scene check lists what is in it"};
  if (has("VERSION") && has("FIELDS") && has("POINTS")) return FileKind{Reader::None, "point cloud of PCL (PCD); toftwin import makes a recording of organised ones"};
  if (has("[[object]]")) return FileKind{Reader::None, "scene of the simulator; toftwin scene check lists what is in it"};
  if (has("[[source]]")) return FileKind{Reader::None, "configuration of the daemon; toftwind FILE runs it"};
  if (has("camera_matrix") || has("camera_name")) return FileKind{Reader::None, "lens of OpenCV or ROS (camera_info); --lens of toftwin import takes it"};
  if (has("\nf ") && (text.starts_with("v ") || has("\nv "))) return FileKind{Reader::None, "OBJ mesh; a scene names it by mesh = …"};
  return std::nullopt;
}

/// 80 bytes, the number of triangles, and 50 bytes for each.
bool isBinaryStl(std::string_view head, std::uint64_t size) {
  if (head.size() < 84) return false;
  std::uint32_t triangles = 0;
  std::memcpy(&triangles, head.data() + 80, sizeof triangles);
  return size == 84 + 50ull * triangles;
}

bool isText(std::string_view bytes) {
  return std::ranges::none_of(bytes, [](unsigned char c) { return c < 9 || (c > 13 && c < 32 && c != 27); });
}

/// Whether an MCAP file is a recording of ours. One without any channel may become one.
bool holdsOurFrames(const std::filesystem::path& file) {
  const auto reader = record::Reader::open(file);
  return reader || reader.error().code != Error::Code::Incompatible;
}

FileKind kindOfFolder(const std::filesystem::path& folder) {
  std::error_code fault;
  if (std::filesystem::exists(folder / "depth.txt", fault))
    return {Reader::None, "folder as of TUM's RGB-D benchmark; toftwin import makes a recording of it"};
  if (isBag(folder)) return {Reader::Bag, "bag"};
  if (std::filesystem::exists(folder / "run.toml", fault) || std::filesystem::exists(folder / "plan.toml", fault))
    return {Reader::None, "run of toftwin measure; toftwin compare looks at it"};
  return {Reader::None, "folder; toftwin import makes a recording of a folder of pictures"};
}

}  // namespace

std::optional<FileKind> kindOf(const std::filesystem::path& path) {
  std::error_code fault;
  if (std::filesystem::is_directory(path, fault)) return kindOfFolder(path);
  if (!std::filesystem::is_regular_file(path, fault)) return std::nullopt;
  std::string head(kHead, '\0');
  std::ifstream in{path, std::ios::binary};
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(std::max<std::streamsize>(in.gcount(), 0)));
  if (head.empty()) return FileKind{Reader::None, "empty, or it cannot be read"};
  for (const Start& start : kStarts) {
    if (!head.starts_with(start.bytes)) continue;
    const bool is_other_bag = start.kind.reader == Reader::Recording && !holdsOurFrames(path);
    if (start.kind.reader == Reader::Bag && !openBag(path)) return FileKind{Reader::None, start.kind.text + ", but no bag that can be read"};
    return is_other_bag ? FileKind{Reader::Bag, "MCAP file of other programs"} : start.kind;
  }
  if (const auto size = pictures::sizeOf(std::as_bytes(std::span{head})); size && size->isWithinBound()) {
    return FileKind{Reader::None, fmt::format("picture, {} x {} pixels; toftwin import makes a recording of a folder of them", size->width, size->height)};
  }
  if (isBinaryStl(head, std::filesystem::file_size(path, fault))) return FileKind{Reader::None, "STL mesh; a scene names it by mesh = …"};
  if (!isText(head)) return FileKind{Reader::None, "bytes of no format that is known here"};
  if (auto kind = kindOfText(head)) return kind;
  if (path.extension() == ".toml") return FileKind{Reader::Table, "TOML file"};
  const std::string_view line = std::string_view{head}.substr(0, head.find('\n'));
  const bool is_table = std::ranges::any_of(std::string_view{",;\t"}, [&](char c) { return std::ranges::count(line, c) > 0; });
  return FileKind{Reader::None, is_table ? "table; toftwin discover looks at tables of measurements" : "text of no format that is known here"};
}

}  // namespace toftwin::cli
