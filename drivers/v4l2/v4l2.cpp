// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/v4l2.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>

#include "drivers/logging.h"
#include "drivers/v4l2/formats.h"
#include "drivers/v4l2/selection.h"
#include "drivers/v4l2/source.h"
#include "protocol/settings/describe.h"

namespace toftwin::drivers::v4l2 {
namespace {

/// "gain = 4"
std::optional<std::pair<std::string, double>> assignmentOf(const std::string& text) {
  const auto trimmed = [](std::string_view part) {
    while (part.starts_with(' ')) part.remove_prefix(1);
    while (part.ends_with(' ')) part.remove_suffix(1);
    return std::string{part};
  };
  const auto equals = text.find('=');
  if (equals == std::string::npos) return std::nullopt;
  const std::string number = trimmed(std::string_view{text}.substr(equals + 1));
  double value = 0.0;
  const char* end = number.data() + number.size();
  const auto read = std::from_chars(number.data(), end, value);
  if (read.ec != std::errc{} || read.ptr != end) return std::nullopt;
  return std::pair{trimmed(std::string_view{text}.substr(0, equals)), value};
}

Result<> checkKeys(const Keys& keys, settings::Table& table) {
  if ((keys.width == 0) != (keys.height == 0)) {
    table.complain("width", "only one of width and height is given; give both, or neither");
  }
  for (const std::string& one : keys.set) {
    if (!assignmentOf(one))
      table.complain("set", fmt::format("has \"{}\"; write \"gain = 4\"", one));
  }
  return table.check();
}

Size sizeOf(const Keys& keys, const DepthKeys& image) {
  return keys.width > 0 ? Size{keys.width, keys.height} : Size{image.width, image.height};
}

Result<Channel> openChannel(System& system, const Node& node, const PixelFormat& format, Size size,
                            const Keys& keys) {
  auto device = Device::open(system, node.path);
  if (!device) return device.error();
  auto layout = setLayout(*device, format, size);
  if (!layout) return layout.error();
  auto interval = setFrameRate(*device, *layout, keys.frame_rate);
  if (!interval) return interval.error();
  return Channel{std::make_unique<Device>(*std::move(device)), *layout, *interval};
}

Result<std::optional<Channel>> openInfrared(System& system, const Choice& choice, Size size,
                                            const Keys& keys) {
  if (!choice.infrared) return std::optional<Channel>{};
  auto channel = openChannel(system, *choice.infrared, *choice.infrared_format, size, keys);
  if (!channel) return channel.error();
  if (Size{channel->layout.width, channel->layout.height} != size) {
    return Error{
        Error::Code::Incompatible,
        fmt::format("v4l2: {} gives infrared of {} x {}, but depth has {} x {}; they must be "
                    "of one size",
                    choice.infrared->path, channel->layout.width, channel->layout.height,
                    size.width, size.height)};
  }
  return std::optional{*std::move(channel)};
}

SourceInfo infoOf(const Node& node, const Description& description, const Channel& depth,
                  const ImageMaker& images, const std::vector<Control>& controls) {
  SourceInfo info;
  info.driver = "v4l2";
  info.model = description.name.empty() ? node.card : description.name;
  info.serial = node.serial.empty() ? node.bus_info : node.serial;
  info.kind = FrameKind::Real;
  info.camera = images.camera();
  info.planes = images.kinds();
  if (depth.interval > 0_s) info.frame_interval = depth.interval;
  for (const Control& control : controls) info.parameters.push_back(control.name);
  return info;
}

/// The rest of what can be wrong before anything streams.
Result<std::unique_ptr<Source>> assemble(System& system, const Keys& keys,
                                         const Description& description, const Choice& choice,
                                         const std::optional<CameraInfo>& calibrated) {
  auto depth = openChannel(system, choice.depth, *choice.depth_format,
                           sizeOf(keys, description.depth), keys);
  if (!depth) return depth.error();
  const Size size{depth->layout.width, depth->layout.height};
  auto infrared = openInfrared(system, choice, size, keys);
  if (!infrared) return infrared.error();
  const auto lens = calibrated ? lensFor(*calibrated, size.width, size.height, About::name)
                               : lensFor(description.lens, size.width, size.height, About::name);
  if (!lens) return lens.error();
  if (!lens->is_known) {
    logging::warn(
        "v4l2: {}: nothing is known of this camera's lens, so it has no {} image; describe "
        "the camera (docs/drivers/v4l2.md)",
        choice.depth.card, description.depth.measures == Measures::Depth ? "range" : "depth");
  }
  const bool has_infrared = infrared->has_value() || choice.depth_format->has_infrared_first;
  ImageMaker images{description.depth, *lens, has_infrared};
  auto controls = controlsOf(*depth->device);
  SourceInfo info = infoOf(choice.depth, description, *depth, images, controls);
  std::unique_ptr<Source> source = makeSource({.info = std::move(info),
                                               .depth = *std::move(depth),
                                               .infrared = *std::move(infrared),
                                               .images = std::move(images),
                                               .controls = std::move(controls),
                                               .keys = keys});
  for (const std::string& one : keys.set) {
    const auto [name, value] = *assignmentOf(one);
    if (auto done = source->setParameter(name, value); !done) return done.error();
  }
  return source;
}

}  // namespace

std::vector<std::string> listOn(System& system) {
  std::vector<std::string> uris;
  for (const std::string& bus_info : depthCameras(system)) uris.push_back("v4l2:" + bus_info);
  return uris;
}

Result<std::unique_ptr<Source>> openOn(System& system, settings::Table& table) {
  Keys keys;
  table.read(keys);
  const auto calibrated = calibrationAt(table, keys.calibration);
  const auto described = describedBy(keys, table);
  if (auto checked = checkKeys(keys, table); !checked) return checked.error();
  const auto camera = findCamera(system, keys.uri, table.place("uri"));
  if (!camera) return camera.error();
  const Description description = described ? *described : descriptionFor(camera->nodes.front());
  const auto choice = choose(*camera, description, keys.infrared);
  if (!choice) return choice.error();
  return assemble(system, keys, description, *choice, calibrated);
}

Driver row() {
  return {.name = About::name,
          .summary = About::summary,
          .list = [] { return listOn(kernel()); },
          .open = [](settings::Table& table) { return openOn(kernel(), table); },
          .document =
              [] {
                return settings::markdownTable(settings::keysOf<Keys>()) +
                       "\nA description has these keys:\n\n" +
                       settings::markdownTable(settings::keysOf<Description>());
              },
          .formats = [](const std::string& uri) { return formatLines(kernel(), uri); }};
}

}  // namespace toftwin::drivers::v4l2
