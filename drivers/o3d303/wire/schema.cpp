// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/wire/schema.h"

#include <fmt/format.h>

#include <array>
#include <boost/property_tree/json_parser.hpp>
#include <sstream>
#include <utility>

#include "drivers/o3d303/wire/frame_content.h"

namespace toftwin::o3d303 {
namespace {

using Kind = SchemaElement::Kind;

constexpr std::size_t kLongest = 65'536;
constexpr int kDeepestBracket = 16;  // the JSON reader recurses: deeper texts would end on the stack

struct TypeName {
  std::string_view name;
  Kind kind;
  NumberType type = NumberType::UInt32;
};
constexpr std::array kTypes{TypeName{"string", Kind::Text},
                            TypeName{"blob", Kind::Blob},
                            TypeName{"records", Kind::Records},
                            TypeName{"uint8", Kind::Number, NumberType::UInt8},
                            TypeName{"int8", Kind::Number, NumberType::Int8},
                            TypeName{"uint16", Kind::Number, NumberType::UInt16},
                            TypeName{"int16", Kind::Number, NumberType::Int16},
                            TypeName{"uint32", Kind::Number, NumberType::UInt32},
                            TypeName{"int32", Kind::Number, NumberType::Int32},
                            TypeName{"float32", Kind::Number, NumberType::Float32}};

std::string_view nameOf(const SchemaElement& element) {
  for (const TypeName& one : kTypes) {
    if (one.kind == element.kind && (one.kind != Kind::Number || one.type == element.type)) return one.name;
  }
  return {};
}

bool isTooDeep(std::string_view json) {
  int depth = 0;
  for (const char c : json) {
    if ((c == '{' || c == '[') && ++depth > kDeepestBracket) return true;
    if (c == '}' || c == ']') --depth;
  }
  return false;
}

using Tree = boost::property_tree::ptree;

/// The format of an element, whose own property goes before the schema's.
Result<NumberFormat> formatOf(const Tree& element, const NumberFormat& otherwise) {
  const auto property = element.get_child_optional("format");
  return property ? formatWith(otherwise, *property) : Result<NumberFormat>{otherwise};
}

Result<Schema> readElements(const Tree& tree, const NumberFormat& common) {
  const auto elements = tree.get_child_optional("elements");
  if (!elements) return Error{Error::Code::Malformed, "PCIC schema: it has no \"elements\""};
  Schema schema;
  for (const auto& [key, element] : *elements) {
    const auto name = element.get<std::string>("type", "");
    const auto* type = std::ranges::find(kTypes, name, &TypeName::name);
    if (type == kTypes.end()) {
      return Error{Error::Code::Unsupported,
                   fmt::format("PCIC schema: elements of type \"{}\" are not known", name)};
    }
    auto format = formatOf(element, common);
    if (!format) return format.error();
    if (type->kind == Kind::Records) {
      if (auto records = readElements(element, *format); !records) return records.error();
    }
    schema.push_back({.kind = type->kind,
                      .id = element.get<std::string>("id", ""),
                      .value = element.get<std::string>("value", ""),
                      .type = type->type,
                      .format = *format});
  }
  return schema;
}

/// As the camera's own clients ask for numbers.
SchemaElement binaryNumber(std::string id, NumberType type) {
  return {.kind = Kind::Number,
          .id = std::move(id),
          .type = type,
          .format = {.encoding = NumberFormat::Encoding::Binary}};
}

}  // namespace

SchemaElement SchemaElement::text(std::string id, std::string value) {
  return {.kind = Kind::Text, .id = std::move(id), .value = std::move(value)};
}

SchemaElement SchemaElement::blob(std::string_view id) { return {.kind = Kind::Blob, .id = std::string{id}}; }

Schema schemaOf(const std::vector<std::string_view>& blobs) {
  Schema schema{SchemaElement::text("start_string", std::string{kFrameBegin})};
  for (const std::string_view blob : blobs) schema.push_back(SchemaElement::blob(blob));
  // The temperature before the exposures: the other way round the vendor's own client misses it.
  schema.push_back(SchemaElement::text("temp_illu_marker", std::string{kIlluminationMarker}));
  schema.push_back(binaryNumber("temp_illu", NumberType::Float32));
  schema.push_back(SchemaElement::text("exposure_times", std::string{kExposuresMarker}));
  for (int i = 1; i <= 3; ++i)
    schema.push_back(binaryNumber(fmt::format("exposure_time_{}", i), NumberType::UInt32));
  schema.push_back(SchemaElement::text("end_string", std::string{kFrameEnd}));
  return schema;
}

std::string toJson(const Schema& schema) {
  std::string elements;
  for (const SchemaElement& element : schema) {
    elements += fmt::format("{}{{\"type\":\"{}\",\"id\":\"{}\"", elements.empty() ? "" : ",",
                            nameOf(element), element.id);
    if (element.kind == Kind::Text) elements += fmt::format(",\"value\":\"{}\"", element.value);
    if (element.kind == Kind::Number) elements += R"(,"format":{"dataencoding":"binary","order":"little"})";
    elements += '}';
  }
  return R"({"layouter":"flexible","format":{"dataencoding":"ascii"},"elements":[)" + elements +
         "]}";
}

Result<Schema> readSchema(std::string_view json) {
  if (json.size() > kLongest || isTooDeep(json)) {
    return Error{Error::Code::TooLarge, "PCIC schema: too long or nested too deeply"};
  }
  Tree tree;
  std::istringstream text{std::string{json}};
  try {
    boost::property_tree::read_json(text, tree);
  } catch (const boost::property_tree::ptree_error& e) {
    return Error{Error::Code::Malformed, fmt::format("PCIC schema: {}", e.what())};
  }
  const auto layouter = tree.get<std::string>("layouter", "flexible");
  if (layouter != "flexible") {
    return Error{Error::Code::Unsupported,
                 fmt::format("PCIC schema: the layouter \"{}\" is not known; ask for \"flexible\"", layouter)};
  }
  const auto common = formatOf(tree, {});
  if (!common) return common.error();
  return readElements(tree, *common);
}

}  // namespace toftwin::o3d303
