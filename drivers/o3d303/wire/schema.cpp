// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/wire/schema.h"

#include <fmt/format.h>

#include <array>
#include <boost/property_tree/json_parser.hpp>
#include <optional>
#include <sstream>
#include <utility>

#include "drivers/o3d303/wire/frame_content.h"

namespace toftwin::o3d303 {
namespace {

using Type = SchemaElement::Type;

constexpr std::size_t kLongest = 65'536;
constexpr int kDeepestBracket = 8;  // the JSON reader recurses: deeper texts would end on the stack
constexpr std::array<std::pair<Type, std::string_view>, 4> kTypes{{{Type::Text, "string"},
                                                                   {Type::Blob, "blob"},
                                                                   {Type::UInt32, "uint32"},
                                                                   {Type::Float32, "float32"}}};

std::string_view nameOf(Type type) {
  for (const auto& [known, name] : kTypes) {
    if (known == type) return name;
  }
  return {};
}

std::optional<Type> typeNamed(std::string_view name) {
  for (const auto& [type, known] : kTypes) {
    if (known == name) return type;
  }
  return std::nullopt;
}

bool isTooDeep(std::string_view json) {
  int depth = 0;
  for (const char c : json) {
    if ((c == '{' || c == '[') && ++depth > kDeepestBracket) return true;
    if (c == '}' || c == ']') --depth;
  }
  return false;
}

Result<Schema> readElements(const boost::property_tree::ptree& tree) {
  const auto elements = tree.get_child_optional("elements");
  if (!elements) return Error{Error::Code::Malformed, "PCIC schema: it has no \"elements\""};
  Schema schema;
  for (const auto& [key, element] : *elements) {
    const auto name = element.get<std::string>("type", "");
    const auto type = typeNamed(name);
    if (!type) {
      return Error{Error::Code::Unsupported,
                   fmt::format("PCIC schema: elements of type \"{}\" are not known", name)};
    }
    schema.push_back({.type = *type,
                      .id = element.get<std::string>("id", ""),
                      .value = element.get<std::string>("value", "")});
  }
  return schema;
}

}  // namespace

Schema schemaOf(const std::vector<std::string_view>& blobs) {
  Schema schema{{Type::Text, "start_string", std::string{kFrameBegin}}};
  for (const std::string_view blob : blobs) schema.push_back({Type::Blob, std::string{blob}, {}});
  // The temperature before the exposures: the other way round the vendor's own client misses it.
  schema.push_back({Type::Text, "temp_illu_marker", std::string{kIlluminationMarker}});
  schema.push_back({Type::Float32, "temp_illu", {}});
  schema.push_back({Type::Text, "exposure_times", std::string{kExposuresMarker}});
  for (int i = 1; i <= 3; ++i)
    schema.push_back({Type::UInt32, fmt::format("exposure_time_{}", i), {}});
  schema.push_back({Type::Text, "end_string", std::string{kFrameEnd}});
  return schema;
}

std::string toJson(const Schema& schema) {
  std::string elements;
  for (const SchemaElement& element : schema) {
    elements += fmt::format("{}{{\"type\":\"{}\",\"id\":\"{}\"", elements.empty() ? "" : ",",
                            nameOf(element.type), element.id);
    if (element.type == Type::Text) elements += fmt::format(",\"value\":\"{}\"", element.value);
    if (element.type == Type::UInt32 || element.type == Type::Float32) {
      elements += R"(,"format":{"dataencoding":"binary","order":"little"})";
    }
    elements += '}';
  }
  return R"({"layouter":"flexible","format":{"dataencoding":"ascii"},"elements":[)" + elements +
         "]}";
}

Result<Schema> readSchema(std::string_view json) {
  if (json.size() > kLongest || isTooDeep(json)) {
    return Error{Error::Code::TooLarge, "PCIC schema: too long or nested too deeply"};
  }
  boost::property_tree::ptree tree;
  std::istringstream text{std::string{json}};
  try {
    boost::property_tree::read_json(text, tree);
  } catch (const boost::property_tree::ptree_error& e) {
    return Error{Error::Code::Malformed, fmt::format("PCIC schema: {}", e.what())};
  }
  return readElements(tree);
}

}  // namespace toftwin::o3d303
