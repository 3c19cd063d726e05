// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/selection.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

namespace toftwin::drivers::v4l2 {
namespace {

constexpr std::string_view kScheme = "v4l2:";

Error notFound(System& system, const std::string& uri, const std::string& place,
               const std::vector<Node>& nodes, const std::vector<Error>& denied) {
  if (nodes.empty() && !denied.empty()) return denied.front();
  std::string there;
  for (const Node& node : nodes) {
    there += fmt::format("{}{} (\"{}\", {})", there.empty() ? "" : ", ", node.path, node.card,
                         node.bus_info);
  }
  if (there.empty()) {
    there = system.nodes().empty() ? "no video node at all; is it plugged in?"
                                   : "no node that streams pictures";
  }
  return {Error::Code::NotFound,
          fmt::format("{}: there is no camera {}; there is {}", place, uri, there)};
}

bool isNamedBy(const Node& node, const std::string& selector) {
  return selector == node.bus_info || selector == node.card ||
         (!node.serial.empty() && selector == node.serial) ||
         (!node.usb_ids.empty() && selector == "usb:" + node.usb_ids);
}

bool offers(const Node& node, const PixelFormat& format) {
  return std::ranges::find(node.formats, format.fourcc) != node.formats.end();
}

std::string formatsOf(const CameraNodes& camera) {
  std::string all;
  for (const Node& node : camera.nodes) {
    all += (all.empty() ? "" : "; ") + node.path + ":";
    for (const std::uint32_t fourcc : node.formats) all += " " + nameOf(fourcc);
  }
  return all;
}

/// The node that the description means, or the first with the format.
Result<Node> nodeWith(const CameraNodes& camera, int index, const PixelFormat& format) {
  if (index >= 0) {
    const auto at = static_cast<std::size_t>(index);
    if (at < camera.nodes.size()) return camera.nodes[at];
    return Error{
        Error::Code::NotFound,
        fmt::format("v4l2: the description names node {} of the camera \"{}\", counted from "
                    "0, but it has {} at present",
                    index, camera.nodes.front().card, camera.nodes.size())};
  }
  for (const Node& node : camera.nodes) {
    if (offers(node, format)) return node;
  }
  return Error{Error::Code::Incompatible,
               fmt::format("v4l2: the camera \"{}\" has no format {}; it has: {}",
                           camera.nodes.front().card, format.name, formatsOf(camera))};
}

const PixelFormat* firstDepthFormat(const std::vector<Node>& nodes) {
  for (const PixelFormat& format : allPixelFormats()) {
    const bool is_there =
        std::ranges::any_of(nodes, [&](const Node& node) { return offers(node, format); });
    if (format.is_depth && is_there) return &format;
  }
  return nullptr;
}

}  // namespace

Result<CameraNodes> findCamera(System& system, const std::string& uri, const std::string& place) {
  std::string selector = uri.starts_with(kScheme) ? uri.substr(kScheme.size()) : std::string{};
  std::vector<Error> denied;
  const std::vector<Node> nodes = captureNodes(system, &denied);
  CameraNodes camera;
  std::optional<std::string> bus_info;
  if (selector.starts_with('/')) {
    std::error_code error;
    const auto real = std::filesystem::weakly_canonical(selector, error);
    const std::string path = error ? selector : real.string();
    const auto found = std::ranges::find(nodes, path, &Node::path);
    if (found != nodes.end()) {
      camera.named = *found;
      bus_info = found->bus_info;
    }
    const auto names = system.nodes();
    if (!bus_info && std::ranges::find(names, path) != names.end()) {
      const auto device = Device::open(system, path);
      if (!device) return device.error();
    }
  }
  for (const Node& node : nodes) {
    if (camera.named || !isNamedBy(node, selector)) continue;
    if (bus_info && *bus_info != node.bus_info) {
      return Error{
          Error::Code::Incompatible,
          fmt::format("{}: there are several cameras {}: one at {}, one at {}; name one of "
                      "these instead",
                      place, uri, *bus_info, node.bus_info)};
    }
    bus_info = node.bus_info;
  }
  if (!bus_info) return notFound(system, uri, place, nodes, denied);
  std::ranges::copy_if(nodes, std::back_inserter(camera.nodes),
                       [&](const Node& node) { return node.bus_info == *bus_info; });
  return camera;
}

std::optional<Description> describedBy(const Keys& keys, settings::Table& table) {
  if (keys.camera.empty()) return std::nullopt;
  std::string known;
  const auto file = table.resolve(keys.camera);
  Result<Description> description = Error{Error::Code::NotFound, {}};
  for (const Preset& preset : presets()) {
    if (preset.name == keys.camera) description = parseDescription(preset.text, keys.camera + ".toml");
    known += (known.empty() ? "" : ", ") + std::string{preset.name};
  }
  if (!description && std::filesystem::exists(file)) description = loadDescription(file);
  if (description) return *std::move(description);
  table.complain("camera", fmt::format("= \"{}\": {}", keys.camera,
                                       !description.error().message.empty()
                                           ? description.error().message
                                           : fmt::format("there is neither a file {}, nor a description of that "
                                                         "name that comes with toftwin ({})",
                                                         file.string(), known)));
  return std::nullopt;
}

Description descriptionFor(const Node& node) {
  for (const Preset& preset : presets()) {
    auto description = parseDescription(preset.text, std::string{preset.name} + ".toml");
    if (description && matches(*description, node.usb_ids, node.card)) return *std::move(description);
  }
  return {};
}

Result<Choice> choose(const CameraNodes& camera, const Description& description, bool infrared) {
  Choice choice;
  const std::vector<Node> candidates =
      camera.named ? std::vector<Node>{*camera.named} : camera.nodes;
  choice.depth_format = description.depth.format.empty()
                            ? firstDepthFormat(candidates)
                            : pixelFormatNamed(description.depth.format);
  if (choice.depth_format == nullptr) {
    return Error{
        Error::Code::Incompatible,
        fmt::format("v4l2: the camera \"{}\" has no format that is depth by itself ({}); say "
                    "in a description which one is: camera = \"my_camera.toml\", "
                    "docs/drivers/v4l2.md",
                    camera.nodes.front().card, formatsOf(camera))};
  }
  const int index = camera.named ? -1 : description.depth.node;
  auto depth =
      nodeWith(camera.named ? CameraNodes{candidates, {}} : camera, index, *choice.depth_format);
  if (!depth) return depth.error();
  choice.depth = *std::move(depth);
  if (!infrared || description.infrared.format.empty()) return choice;
  choice.infrared_format = pixelFormatNamed(description.infrared.format);
  auto node = nodeWith(camera, description.infrared.node, *choice.infrared_format);
  if (!node) return node.error();
  if (node->path == choice.depth.path) {
    return Error{
        Error::Code::Incompatible,
        fmt::format("v4l2: the description takes depth and infrared from the same node, {}, "
                    "which gives one image at a time",
                    node->path)};
  }
  choice.infrared = *std::move(node);
  return choice;
}

std::vector<std::string> depthCameras(System& system) {
  std::vector<Description> known;
  for (const Preset& preset : presets()) {
    if (auto one = parseDescription(preset.text, std::string{preset.name})) known.push_back(*one);
  }
  std::vector<std::string> cameras;
  for (const Node& node : captureNodes(system)) {
    const bool is_described = std::ranges::any_of(
        known, [&](const Description& one) { return matches(one, node.usb_ids, node.card); });
    if (!node.offersDepth() && !is_described) continue;
    if (std::ranges::find(cameras, node.bus_info) == cameras.end())
      cameras.push_back(node.bus_info);
  }
  return cameras;
}

}  // namespace toftwin::drivers::v4l2
