// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/wire/xmlrpc.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <optional>
#include <pugixml.hpp>

namespace toftwin::o3d303 {
namespace {

constexpr int kDeepestValue = 16;  // arrays within arrays; the camera has two

template <class... Fs>
struct Overloaded : Fs... {
  using Fs::operator()...;
};
template <class... Fs>
Overloaded(Fs...) -> Overloaded<Fs...>;

// ---- writing -----------------------------------------------------------------------------------

void write(pugi::xml_node parent, const XmlRpcValue& value) {
  pugi::xml_node node = parent.append_child("value");
  std::visit(
      Overloaded{
          [&](const std::string& s) { node.append_child("string").text() = s.c_str(); },
          [&](int i) { node.append_child("int").text() = i; },
          [&](bool b) { node.append_child("boolean").text() = b ? "1" : "0"; },
          [&](double d) { node.append_child("double").text() = fmt::format("{}", d).c_str(); },
          [&](const Base64& b) { node.append_child("base64").text() = b.text.c_str(); },
          [&](const XmlRpcValue::Array& array) {
            pugi::xml_node data = node.append_child("array").append_child("data");
            for (const XmlRpcValue& one : array) write(data, one);
          },
          [&](const XmlRpcValue::Struct& members) {
            pugi::xml_node all = node.append_child("struct");
            for (const auto& [name, one] : members) {
              pugi::xml_node member = all.append_child("member");
              member.append_child("name").text() = name.c_str();
              write(member, one);
            }
          }},
      value.value);
}

std::string toText(const pugi::xml_document& document) {
  struct Writer final : pugi::xml_writer {
    std::string text;
    void write(const void* data, std::size_t size) override {
      text.append(static_cast<const char*>(data), size);
    }
  } writer;
  document.save(writer, "", pugi::format_raw);
  return std::move(writer.text);
}

// ---- reading -----------------------------------------------------------------------------------

Error malformedXml(std::string what) { return {Error::Code::Malformed, "XML-RPC: " + std::move(what)}; }

Result<pugi::xml_node> rootOf(pugi::xml_document& document, std::string_view xml,
                              const char* name) {
  // Text of white space alone is a value, too; entities of the document's own are never resolved.
  const auto parsed = document.load_buffer(xml.data(), xml.size(),
                                           pugi::parse_default | pugi::parse_ws_pcdata_single);
  if (!parsed) return malformedXml(parsed.description());
  const pugi::xml_node root = document.child(name);
  if (!root) return malformedXml(fmt::format("there is no <{}>", name));
  return root;
}

template <class Number>
Result<XmlRpcValue> readNumber(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  if (text.starts_with('+')) text.remove_prefix(1);
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{}) return malformedXml(fmt::format("\"{}\" is not a number", text));
  return XmlRpcValue{number};
}

Result<XmlRpcValue> readValue(const pugi::xml_node& value, int depth);

Result<XmlRpcValue> readArray(const pugi::xml_node& typed, int depth) {
  XmlRpcValue::Array array;
  for (const pugi::xml_node& one : typed.child("data").children("value")) {
    auto read = readValue(one, depth + 1);
    if (!read) return read;
    array.push_back(*std::move(read));
  }
  return XmlRpcValue{std::move(array)};
}

Result<XmlRpcValue> readStruct(const pugi::xml_node& typed, int depth) {
  XmlRpcValue::Struct members;
  for (const pugi::xml_node& member : typed.children("member")) {
    auto read = readValue(member.child("value"), depth + 1);
    if (!read) return read;
    members.emplace_back(member.child("name").text().get(), *std::move(read));
  }
  return XmlRpcValue{std::move(members)};
}

Result<XmlRpcValue> readValue(const pugi::xml_node& value, int depth) {
  if (!value) return malformedXml("a <value> is missing");
  if (depth > kDeepestValue) return malformedXml("values nested too deeply");
  pugi::xml_node typed;
  for (const pugi::xml_node& child : value.children()) {
    if (child.type() == pugi::node_element) typed = child;
  }
  if (!typed) return XmlRpcValue{std::string{value.text().get()}};  // no type: a string
  const std::string_view type = typed.name();
  const char* text = typed.text().get();
  if (type == "int" || type == "i4") return readNumber<int>(text);
  if (type == "double") return readNumber<double>(text);
  if (type == "boolean") return XmlRpcValue{std::string_view{text} == "1"};
  if (type == "array") return readArray(typed, depth);
  if (type == "struct") return readStruct(typed, depth);
  if (type == "base64") return XmlRpcValue{Base64{text}};
  return XmlRpcValue{std::string{text}};  // string, dateTime.iso8601, nil
}

}  // namespace

std::string XmlRpcValue::text() const {
  return std::visit(
      Overloaded{[](const std::string& s) { return s; }, [](int i) { return std::to_string(i); },
                 [](bool b) { return std::string{b ? "true" : "false"}; },
                 [](double d) { return fmt::format("{}", d); },
                 [](const Base64& b) { return b.text; }, [](const auto&) { return std::string{}; }},
      value);
}

std::string XmlRpcValue::textAt(std::string_view member) const {
  if (const auto* members = std::get_if<Struct>(&value)) {
    for (const auto& [name, one] : *members) {
      if (name == member) return one.text();
    }
  }
  return {};
}

std::string encodeXmlRpc(const XmlRpcCall& call) {
  pugi::xml_document document;
  pugi::xml_node root = document.append_child("methodCall");
  root.append_child("methodName").text() = call.method.c_str();
  pugi::xml_node params = root.append_child("params");
  for (const XmlRpcValue& param : call.params) write(params.append_child("param"), param);
  return toText(document);
}

std::string encodeXmlRpc(const XmlRpcAnswer& answer) {
  pugi::xml_document document;
  pugi::xml_node root = document.append_child("methodResponse");
  if (const auto* fault = std::get_if<XmlRpcFault>(&answer)) {
    write(root.append_child("fault"),
          XmlRpcValue::Struct{{"faultCode", fault->code}, {"faultString", fault->text}});
  } else {
    write(root.append_child("params").append_child("param"), std::get<XmlRpcValue>(answer));
  }
  return toText(document);
}

Result<XmlRpcCall> readXmlRpcCall(std::string_view xml) {
  pugi::xml_document document;
  const auto root = rootOf(document, xml, "methodCall");
  if (!root) return root.error();
  XmlRpcCall call{root->child("methodName").text().get(), {}};
  if (call.method.empty()) return malformedXml("the call names no method");
  for (const pugi::xml_node& param : root->child("params").children("param")) {
    auto value = readValue(param.child("value"), 0);
    if (!value) return value.error();
    call.params.push_back(*std::move(value));
  }
  return call;
}

Result<XmlRpcAnswer> readXmlRpcAnswer(std::string_view xml) {
  pugi::xml_document document;
  const auto root = rootOf(document, xml, "methodResponse");
  if (!root) return root.error();
  const pugi::xml_node fault = root->child("fault");
  auto value = readValue(
      fault ? fault.child("value") : root->child("params").child("param").child("value"), 0);
  if (!value) return value.error();
  if (!fault) return XmlRpcAnswer{*std::move(value)};
  const auto code = readNumber<int>(value->textAt("faultCode"));
  if (!code) return malformedXml("a fault without a code");
  return XmlRpcAnswer{XmlRpcFault{std::get<int>(code->value), value->textAt("faultString")}};
}

}  // namespace toftwin::o3d303
