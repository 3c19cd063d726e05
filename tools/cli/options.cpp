// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>

#include <toftwin/names.h>

#include "protocol/transport/address.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {

std::string planeNames() {
  std::string names;
  for (int i = 0; i <= static_cast<int>(kLastPlaneKind); ++i) {
    names += (i == 0 ? "" : ", ") + std::string{nameOf(static_cast<PlaneKind>(i))};
  }
  return names;
}

std::string isAddress(const std::string& text) {
  if (text.empty()) return {};  // an empty variable of the environment, as one that is not set
  const auto parsed = transport::parseAddress(text, kDefaultPort);
  return parsed ? std::string{} : parsed.error().message;
}

void DaemonOptions::add(Arguments& args) {
  args.option("-a,--address", address,
              "where the daemon is: HOST:PORT, tls:HOST:PORT or unix:/PATH; default: its socket on this machine, "
              "then port 47800 of it")
      .valid(isAddress)
      .environment("TOFTWIN_ADDRESS");
  args.option("--timeout", timeout_s, "seconds to wait for the daemon or for a frame")
      .within(0.001, 86'400.0)
      .showsDefault();
}

ClientOptions DaemonOptions::clientOptions() const {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nobody sets it
    return std::string{value == nullptr ? "" : value};
  };
  ClientOptions options{.timeout = timeout()};
  options.token = variable("TOFTWIN_TOKEN");
  options.authorities = variable("TOFTWIN_AUTHORITIES");
  options.certificate = variable("TOFTWIN_CERTIFICATE");
  options.key = variable("TOFTWIN_KEY");
  return options;
}

Result<Client> DaemonOptions::connect() const {
  auto client = Client::connect(address, clientOptions());
  if (client) return client;
  return Error{
      Error::Code::Disconnected,
      fmt::format("{}\nIs a daemon running there? `toftwin doctor` finds out, `toftwind --help` "
                  "says how to start one.",
                  client.error().message)};
}

void OutputOptions::add(Arguments& args, bool required) {
  args.option(
          "-o,--output", file,
          "file to write; its extension says the format: .png .tif .exr .ply .pcd .npy .csv .h5 .mcap. Written "
          "whole or not at all")
      .required(required);
  args.option("-p,--plane", plane_names,
              "plane to write: " + planeNames() +
                  "; default: range, or depth where there is no range; "
                  "CSV, HDF5 and MCAP take several (-p range,flags), and all by default")
      .separatedBy(',')
      .oneAtATime();
  args.option("--channel", how.channel, "of a plane with several (PNG, TIFF, EXR, CSV)").showsDefault();
  args.option("--scale", how.mm_per_count, "PNG: millimetres per count")
      .within(1e-3, 1e3)
      .showsDefault();
  args.flag("--color", how.color, "PNG: a picture in colours instead of counts");
  args.option("--min", how.min,
              "--color: value of the first colour; default: 1 % of the pixels lie below");
  args.option("--max", how.max,
              "--color: value of the last colour; default: 1 % of the pixels lie above");
  args.option("--row", how.row, "CSV: only this row of pixels");
  args.flag("--world", how.world, "PLY, PCD: in world coordinates, if the camera knows its pose");
  args.flag("--organised", how.organised, "PLY, PCD: a point for each pixel, row by row, NaN where invalid");
}

void OutputOptions::addFormat(Arguments& args) {
  args.option("--format", how.format, "where the extension does not say it (.mcap, folders, -): " + formatNames());
  args.option("--depth-format", depth_format, "ROS 2 and Foxglove: depth in metres, or in millimetres as integers; default: 32FC1")
      .oneOf({"32FC1", "16UC1"});
}

namespace {

/// What was given although it means nothing for this kind of file.
Result<> fits(const std::vector<Format>& formats, const ExportOptions& how) {
  struct Rule {
    const char* option;
    bool is_given;
    bool has_meaning;
    const char* meant_for;
  };
  const ExportOptions none;
  const auto among = [&](Format format) { return std::ranges::find(formats, format) != formats.end(); };
  const bool is_png = among(Format::Png), is_csv = among(Format::Csv), is_picture = among(Format::Tiff) || among(Format::Exr);
  const bool is_cloud = among(Format::Ply) || among(Format::Pcd);
  const std::array rules{
      Rule{"--row", how.row.has_value(), is_csv, ".csv"},
      Rule{"--world", how.world, is_cloud, ".ply and .pcd"},
      Rule{"--organised", how.organised, is_cloud, ".ply and .pcd"},
      Rule{"--color", how.color, is_png, ".png"},
      Rule{"--scale", how.mm_per_count != none.mm_per_count, is_png && !how.color,
           ".png without --color"},
      Rule{"--channel", how.channel != none.channel, is_png || is_csv || is_picture, ".png, .tif, .exr and .csv"},
      Rule{"--depth-format", how.depth_format != none.depth_format, among(Format::Ros2) || among(Format::Foxglove), "--format ros2 and foxglove"},
      Rule{"--min", how.min.has_value(), is_png && how.color, ".png with --color"},
      Rule{"--max", how.max.has_value(), is_png && how.color, ".png with --color"},
  };
  for (const Rule& rule : rules) {
    if (rule.is_given && !rule.has_meaning) {
      return Error{Error::Code::InvalidArgument,
                   fmt::format("{} has a meaning for {} only", rule.option, rule.meant_for)};
    }
  }
  if (how.min && how.max && !(*how.min < *how.max)) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("--min {} must be less than --max {}", *how.min, *how.max)};
  }
  return {};
}

}  // namespace

Result<> OutputOptions::check() {
  std::vector<Format> formats;
  if (file == kPipe && how.format.empty()) how.format = "npy";
  if (!file.empty()) {
    const auto format = formatOf(file, how.format);
    if (!format) return format.error();
    formats.push_back(*format);
    if (file == kPipe && holdsManyFrames(*format)) return Error{Error::Code::InvalidArgument, "-o -: this format is no stream; name a file"};
  }
  if (auto checked = check(formats); !checked) return checked;
  const bool takes_several =
      file.empty() || formats.front() == Format::Csv || holdsManyFrames(formats.front());
  if (takes_several || how.planes.size() <= 1) return {};
  return Error{Error::Code::InvalidArgument,
               fmt::format("-o {} takes one plane, not {}: name one with -p, or write .csv, .h5 or .mcap, which "
                           "take several",
                           file, how.planes.size())};
}

Result<> OutputOptions::check(const std::vector<Format>& formats) {
  how.depth_format = depth_format == "16UC1" ? ros::DepthFormat::Millimetres : ros::DepthFormat::Metres;
  if (!file.empty()) {
    if (auto fitting = fits(formats, how); !fitting) return fitting;
  }
  how.planes.clear();
  for (const std::string& name : plane_names) {
    const auto kind = planeKindNamed(name);
    if (!kind) {
      return Error{Error::Code::InvalidArgument,
                   fmt::format("there is no plane \"{}\"; the planes are: {}{}", name, planeNames(),
                               otherWordFor(name))};
    }
    how.planes.push_back(*kind);
  }
  return {};
}

Result<Frame> waitForFrame(Subscription& frames, std::chrono::milliseconds timeout) {
  constexpr std::chrono::milliseconds kPatience{200};  // until Ctrl-C is looked for again
  const auto end = std::chrono::steady_clock::now() + timeout;
  while (true) {
    if (interrupted()) return Error{Error::Code::Stopped, "interrupted"};
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    auto frame = frames.next(std::clamp(left, std::chrono::milliseconds{0}, kPatience));
    if (frame || frame.error().code != Error::Code::Timeout || left <= kPatience) return frame;
  }
}

std::string numbered(const std::string& file, std::uint64_t number, bool several) {
  if (!several) return file;
  const std::filesystem::path path{file};
  return (path.parent_path() /
          fmt::format("{}-{:04}{}", path.stem().string(), number, path.extension().string()))
      .string();
}

}  // namespace toftwin::cli
