// SPDX-License-Identifier: Apache-2.0
#include "sim/meshes/gltf_model.h"

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <array>

#include "sim/meshes/faces.h"
#include "sim/meshes/file_bytes.h"
#include "sim/meshes/gltf_json.h"
#include "sim/meshes/text.h"

namespace toftwin::sim::meshes {
namespace {

/// A first line that is short enough for people.
std::string firstLine(std::string_view text) {
  const std::string_view line = text.substr(0, text.find('\n'));
  return line.empty() ? "nothing more is known" : std::string{line.substr(0, 200)};
}

/// All files that a glTF names share what one file may have.
struct Allowance {
  std::uint64_t bytes = kMostFileBytes;
};

bool isThere(const std::string& path, void*) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored);
}

bool readWhole(std::vector<unsigned char>* out, std::string* why_not, const std::string& path, void* allowance) {
  std::uint64_t& left = static_cast<Allowance*>(allowance)->bytes;
  const auto bytes = bytesOf(path, left);
  if (!bytes) {
    if (why_not != nullptr) *why_not += bytes.error().message;
    return false;
  }
  left -= bytes->size();
  out->assign(bytes->begin(), bytes->end());
  return true;
}

/// Pictures stay encoded. Those that a buffer holds are cut out later, once their place is checked.
bool keepEncoded(tinygltf::Image* image, int, std::string*, std::string*, int, int, const unsigned char* bytes, int size,
                 void*) {
  if (image->bufferView < 0 && image->uri.empty()) image->image.assign(bytes, bytes + size);
  return true;
}

/// Those that change no shape, or that are read.
bool isKnown(std::string_view extension) {
  return extension == "KHR_mesh_quantization" || extension == "KHR_texture_transform" ||
         extension == "KHR_lights_punctual" || extension.starts_with("KHR_materials_") ||
         extension.starts_with("KHR_animation") || extension.starts_with("KHR_xmp");
}

Result<> checkExtensions(const tinygltf::Model& model, const std::filesystem::path& file) {
  for (const std::string& name : model.extensionsRequired) {
    if (!isKnown(name))
      return Error{Error::Code::Unsupported,
                   fmt::format("mesh {}: it needs the extension {}, which is not read; export it without (compression)",
                               file.string(), name.substr(0, 60))};
  }
  return {};
}

/// The bytes of a picture in a buffer.
Result<std::vector<std::byte>> cutOut(const tinygltf::Model& model, int view_index, const std::filesystem::path& file) {
  const auto at = static_cast<std::size_t>(view_index);
  if (at < model.bufferViews.size()) {
    const tinygltf::BufferView& view = model.bufferViews[at];
    const auto number = static_cast<std::size_t>(view.buffer);
    if (number < model.buffers.size()) {
      const auto& data = model.buffers[number].data;
      if (view.byteOffset <= data.size() && view.byteLength <= data.size() - view.byteOffset) {
        const auto* first = reinterpret_cast<const std::byte*>(data.data()) + view.byteOffset;
        return std::vector<std::byte>(first, first + view.byteLength);
      }
    }
  }
  return damaged(file, fmt::format("a picture lies in buffer view {}, which is not there or too short", view_index));
}

Result<Picture> pictureOf(const tinygltf::Model& model, int texture, const std::filesystem::path& file) {
  const auto number = static_cast<std::size_t>(texture);
  if (number >= model.textures.size()) return damaged(file, fmt::format("there is no texture {}", texture));
  const auto source = static_cast<std::size_t>(model.textures[number].source);
  if (source >= model.images.size()) return damaged(file, fmt::format("texture {} has no picture that is read", texture));
  const tinygltf::Image& image = model.images[source];
  Picture picture;
  if (image.bufferView >= 0) {
    auto bytes = cutOut(model, image.bufferView, file);
    if (!bytes) return bytes.error();
    picture.bytes = *std::move(bytes);
  } else if (!image.image.empty()) {
    const auto* first = reinterpret_cast<const std::byte*>(image.image.data());
    picture.bytes.assign(first, first + image.image.size());
  } else {
    picture.file = std::filesystem::absolute(file).parent_path() / withoutPercents(image.uri);
  }
  return picture;
}

double clamped(double value) { return value >= 0.0 ? std::min(value, 1.0) : 0.0; }

}  // namespace

GltfModel::GltfModel(std::unique_ptr<tinygltf::Model> model) : model_(std::move(model)) {}
GltfModel::GltfModel(GltfModel&&) noexcept = default;
GltfModel& GltfModel::operator=(GltfModel&&) noexcept = default;
GltfModel::~GltfModel() = default;

Result<GltfModel> GltfModel::parse(std::string_view bytes, const std::filesystem::path& file) {
  if (const auto why_not = whyNotToParse(bytes)) return damaged(file, *why_not);
  Allowance allowance;
  tinygltf::TinyGLTF parser;
  parser.SetImageLoader(&keepEncoded, nullptr);
  parser.SetFsCallbacks({&isThere, [](const std::string& path, void*) { return path; }, &readWhole, nullptr, &allowance});
  auto model = std::make_unique<tinygltf::Model>();
  std::string error, warning;
  const std::string folder = std::filesystem::absolute(file).parent_path().string();
  bool is_read = false;
  try {
    const auto size = static_cast<unsigned>(bytes.size());
    is_read = bytes.starts_with("glTF")
                  ? parser.LoadBinaryFromMemory(model.get(), &error, &warning,
                                                reinterpret_cast<const unsigned char*>(bytes.data()), size, folder)
                  : parser.LoadASCIIFromString(model.get(), &error, &warning, bytes.data(), size, folder);
  } catch (const std::exception& thrown) {  // by its JSON, for values of another type than it expects
    error = thrown.what();
  }
  if (!is_read) return damaged(file, fmt::format("it cannot be read as glTF 2.0: {}", firstLine(error)));
  if (auto known = checkExtensions(*model, file); !known) return known.error();
  return GltfModel{std::move(model)};
}

Result<std::vector<Surface>> GltfModel::surfaces(const std::filesystem::path& file, std::vector<std::string>& notes) const {
  std::vector<Surface> all;
  for (std::size_t i = 0; i < model_->materials.size(); ++i) {
    const tinygltf::Material& material = model_->materials[i];
    const tinygltf::PbrMetallicRoughness& pbr = material.pbrMetallicRoughness;
    Surface& surface = all.emplace_back();
    surface.name = material.name.empty() ? fmt::format("material {}", i) : material.name;
    for (std::size_t c = 0; c < 3 && pbr.baseColorFactor.size() >= 3; ++c)
      surface.base_color[c] = clamped(pbr.baseColorFactor[c]);
    surface.metallic = clamped(pbr.metallicFactor);
    surface.roughness = clamped(pbr.roughnessFactor);
    const auto ior = material.extensions.find("KHR_materials_ior");
    if (ior != material.extensions.end() && ior->second.IsObject()) {
      const auto& value = ior->second.Get("ior");
      if (value.IsNumber() && value.GetNumberAsDouble() >= 1.0) surface.index = std::min(value.GetNumberAsDouble(), 4.0);
    }
    if (material.extensions.contains("KHR_materials_transmission"))
      notes.push_back(fmt::format("material \"{}\" lets light through, which is left out; give the object a material of the "
                                  "scene file, such as thin-glass", surface.name));
    if (pbr.metallicRoughnessTexture.index >= 0)
      notes.push_back(fmt::format("material \"{}\": the picture of its roughness is left out", surface.name));
    if (pbr.baseColorTexture.index < 0) continue;
    if (pbr.baseColorTexture.extensions.contains("KHR_texture_transform"))
      notes.push_back(fmt::format("material \"{}\": how its picture is shifted and scaled is left out", surface.name));
    auto picture = pictureOf(*model_, pbr.baseColorTexture.index, file);
    if (!picture) return picture.error();
    surface.picture = *std::move(picture);
  }
  return all;
}

}  // namespace toftwin::sim::meshes
