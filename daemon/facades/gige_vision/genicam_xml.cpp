// SPDX-License-Identifier: Apache-2.0
// The table of features as the XML that a client reads, and as the documents' tables.
#include <fmt/format.h>

#include <algorithm>

#include "daemon/facades/gige_vision/features.h"

namespace toftwin::daemon::gige_vision {
namespace {

std::string_view textOf(Access access) {
  return access == Access::ReadOnly ? "RO" : access == Access::WriteOnly ? "WO" : "RW";
}

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else {
      out += c;
    }
  }
  return out;
}

std::string element(std::string_view name, std::string_view text) {
  return fmt::format("<{0}>{1}</{0}>", name, escaped(text));
}

std::string registerName(std::string_view feature) { return fmt::format("{}Reg", feature); }
std::string registerName(const Row& row) {
  return row.type == Type::Register ? std::string{row.name} : registerName(row.name);
}
/// Registers that no feature shows, but others refer to.
bool isAsked(const Row& row) {
  return row.category.empty() && row.type == Type::Register && row.address >= kFirstFeature;
}

/// Address, length and so on of a register.
struct Place {
  std::string address;  ///< with the selector's index, if there is one
  std::uint32_t size = 4;
  Access access = Access::ReadOnly;
  bool is_signed = false;
  std::string_view bits{};
};

std::string registerNode(std::string_view node, std::string_view name, const Place& place) {
  std::string text = fmt::format("  <{} Name=\"{}\">{}", node, name, place.address);
  text += fmt::format("<Length>{}</Length><AccessMode>{}</AccessMode><pPort>Device</pPort>", place.size,
                      textOf(place.access));
  text += "<Cachable>NoCache</Cachable>";
  text += place.bits;
  if (node != "FloatReg" && node != "StringReg")
    text += fmt::format("<Sign>{}</Sign>", place.is_signed ? "Signed" : "Unsigned");
  if (node != "StringReg") text += "<Endianess>BigEndian</Endianess>";
  return text + fmt::format("</{}>\n", node);
}

std::string addressOf(std::uint32_t address) { return fmt::format("<Address>0x{:X}</Address>", address); }

std::string addressOf(const Row& row) {
  std::string text = addressOf(row.address);
  if (row.selector) {
    text +=
        fmt::format("<pIndex Offset=\"{}\">{}</pIndex>", row.size, registerName(rowOf(*row.selector).name));
  }
  return text;
}

/// What every feature begins with.
std::string head(std::string_view meaning, std::string_view available, std::string_view locked) {
  std::string text;
  if (!meaning.empty()) text += element("ToolTip", meaning);
  text += "<Visibility>Beginner</Visibility>";
  if (!available.empty()) text += element("pIsAvailable", available);
  if (!locked.empty()) text += element("pIsLocked", locked);
  return text;
}

std::string headOf(const Row& row) {
  const bool is_conditional = (row.beside & Beside::kAvailable) != 0;
  const bool is_lockable = (row.beside & Beside::kLocked) != 0;
  return head(row.meaning, is_conditional ? fmt::format("{}Available", row.name) : "",
              is_lockable                    ? fmt::format("{}Locked", row.name)
              : row.is_fixed_while_streaming ? "TLParamsLocked"
                                             : "");
}

std::string entryNodes(std::span<const Entry> entries) {
  std::string text;
  for (const Entry& one : entries) {
    text += fmt::format("\n    <EnumEntry Name=\"{}\">", one.name);
    if (one.when) text += element("pIsAvailable", rowOf(*one.when).name);
    if (one.of_component)
      text += fmt::format("<pIsAvailable>IsComponent{}</pIsAvailable>", *one.of_component);
    text += fmt::format("<Value>{}</Value></EnumEntry>", one.value);
  }
  return text;
}

std::string selectedBy(Item selector) {
  std::string text;
  for (const Row& row : allRows()) {
    if (row.selector == selector) text += element("pSelected", row.name);
  }
  return text;
}

std::string integerNode(const Row& row) {
  std::string text = headOf(row) + element("pValue", registerName(row.name));
  if (row.bounds) text += fmt::format("<Min>{}</Min>", (*row.bounds)[0]);
  if (row.most) text += element("pMax", registerName(rowOf(*row.most)));
  if (row.bounds && !row.most) text += fmt::format("<Max>{}</Max>", (*row.bounds)[1]);
  if (row.bounds) text += fmt::format("<Inc>{}</Inc>", (*row.bounds)[2]);
  if (!row.unit.empty()) text += element("Unit", row.unit);
  if (row.type == Type::Address) text += element("Representation", "IPV4Address");
  if (row.item == Item::Mac) text += element("Representation", "MACAddress");
  return fmt::format("  <Integer Name=\"{}\">{}</Integer>\n", row.name, text);
}

std::string floatNode(const Row& row) {
  std::string text = headOf(row) + element("pValue", registerName(row.name));
  if ((row.beside & Beside::kBounds) != 0) {
    text += fmt::format("<pMin>{0}Min</pMin><pMax>{0}Max</pMax>", row.name);
  }
  if (!row.unit.empty()) text += element("Unit", row.unit);
  return fmt::format("  <Float Name=\"{}\">{}</Float>\n", row.name, text);
}

std::string besideNodes(const Row& row) {
  std::string text;
  std::uint32_t at = row.address + row.size * row.count();
  if ((row.beside & Beside::kBounds) != 0) {
    text += registerNode("FloatReg", fmt::format("{}Min", row.name), {addressOf(at), row.size});
    text += registerNode("FloatReg", fmt::format("{}Max", row.name), {addressOf(at + row.size), row.size});
    at += 2 * row.size;
  }
  if ((row.beside & Beside::kAvailable) != 0)
    text += registerNode("IntReg", fmt::format("{}Available", row.name), {addressOf(at)});
  if ((row.beside & Beside::kLocked) != 0)
    text += registerNode("IntReg", fmt::format("{}Locked", row.name), {addressOf(at + 4)});
  return text;
}

std::string nodesOf(const Row& row) {
  const Place place{addressOf(row), row.size, row.access, row.item == Item::PtpOffset};
  const std::string value = element("pValue", registerName(row.name));
  const std::string number = registerNode("IntReg", registerName(row.name), place);
  switch (row.type) {
    case Type::String:
      return registerNode("StringReg", row.name, place);
    case Type::Register:
      return registerNode("IntReg", row.name, place);
    case Type::Float:
      return floatNode(row) + registerNode("FloatReg", registerName(row.name), place) + besideNodes(row);
    case Type::Enumeration:
      return fmt::format("  <Enumeration Name=\"{}\">{}{}{}{}</Enumeration>\n", row.name, headOf(row),
                         entryNodes(row.entries), value, selectedBy(row.item)) +
             number + besideNodes(row);
    case Type::Boolean:
      return fmt::format("  <Boolean Name=\"{}\">{}{}</Boolean>\n", row.name, headOf(row), value) + number;
    case Type::Command:
      return fmt::format("  <Command Name=\"{}\">{}{}<CommandValue>1</CommandValue></Command>\n", row.name,
                         headOf(row), value) +
             number;
    case Type::Integer:
    case Type::Address:
      break;
  }
  return integerNode(row) + number;
}

std::string nodesOf(const BitsRow& row) {
  const Row& whole = rowOf(row.of);
  const std::string value = element("pValue", registerName(row.name));
  const std::string bits = fmt::format("<LSB>{}</LSB><MSB>{}</MSB>", row.low, row.high);
  const std::string number = registerNode("MaskedIntReg", registerName(row.name),
                                          {addressOf(whole.address), whole.size, row.access, false, bits});
  const std::string begin = head(row.meaning, "", "");
  switch (row.type) {
    case Type::Boolean:
      return fmt::format("  <Boolean Name=\"{}\">{}{}</Boolean>\n", row.name, begin, value) + number;
    case Type::Command:
      return fmt::format("  <Command Name=\"{}\">{}{}<CommandValue>1</CommandValue></Command>\n", row.name,
                         begin, value) +
             number;
    case Type::Enumeration:
      return fmt::format(
                 "  <Enumeration Name=\"{}\">{}\n    <EnumEntry Name=\"Off\"><Value>0</Value>"
                 "</EnumEntry>\n    <EnumEntry Name=\"On\"><Value>1</Value></EnumEntry>{}"
                 "</Enumeration>\n",
                 row.name, begin, value) +
             number;
    default:
      break;
  }
  std::string text = begin + value;
  if (row.bounds) {
    const auto [least, most, step] = *row.bounds;
    text += fmt::format("<Min>{}</Min><Max>{}</Max><Inc>{}</Inc>", least, most, step);
  }
  if (!row.unit.empty()) text += element("Unit", row.unit);
  return fmt::format("  <Integer Name=\"{}\">{}</Integer>\n", row.name, text) + number;
}

std::string nodesOf(const ChunkRow& row) {
  const bool is_float = row.type == Type::Float;
  std::string text =
      fmt::format("  <Port Name=\"{}Port\"><ChunkID>{:08X}</ChunkID></Port>\n", row.name, row.id);
  text += fmt::format("  <{0} Name=\"{1}\">{2}<pValue>{1}Reg</pValue><Unit>{3}</Unit></{0}>\n",
                      is_float ? "Float" : "Integer", row.name, head(row.meaning, "", ""), row.unit);
  text += fmt::format(
      "  <{0} Name=\"{1}Reg\"><Address>0</Address><Length>8</Length><AccessMode>RO</AccessMode>"
      "<pPort>{1}Port</pPort><Cachable>NoCache</Cachable>{2}<Endianess>BigEndian</Endianess></{0}>\n",
      is_float ? "FloatReg" : "IntReg", row.name, is_float ? "" : "<Sign>Unsigned</Sign>");
  return text;
}

std::vector<std::string_view> categories() {
  std::vector<std::string_view> names;
  for (const Row& row : allRows()) {
    if (!row.category.empty() && std::ranges::count(names, row.category) == 0) names.push_back(row.category);
  }
  return names;
}

constexpr std::string_view kOfChunks = "ChunkDataControl", kLock = "TLParamsLocked",
                           kOfLock = "TransportLayerControl";

std::string categoryNodes() {
  std::string root = "  <Category Name=\"Root\">", text;
  for (const std::string_view category : categories()) {
    root += element("pFeature", category);
    text += fmt::format("  <Category Name=\"{}\">", category);
    for (const Row& row : allRows()) {
      if (row.category == category) text += element("pFeature", row.name);
    }
    for (const BitsRow& row : allBitsRows()) {
      if (row.category == category) text += element("pFeature", row.name);
    }
    for (const ChunkRow& row : allChunks()) {
      if (category == kOfChunks) text += element("pFeature", row.name);
    }
    if (category == kOfLock) text += element("pFeature", kLock);
    text += "</Category>\n";
  }
  return root + "</Category>\n" + text;
}

std::string makeXml() {
  std::string xml =
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
      "<RegisterDescription ModelName=\"ToF3D\" VendorName=\"toftwin\" ToolTip=\"A time-of-flight camera\" "
      "StandardNameSpace=\"GEV\" SchemaMajorVersion=\"1\" SchemaMinorVersion=\"1\" "
      "SchemaSubMinorVersion=\"0\" "
      "MajorVersion=\"1\" MinorVersion=\"0\" SubMinorVersion=\"0\" "
      "ProductGuid=\"7A0C6D62-6B0B-4B0E-9A39-6F8F7B1C2D01\" "
      "VersionGuid=\"7A0C6D62-6B0B-4B0E-9A39-6F8F7B1C2D02\" "
      "xmlns=\"http://www.genicam.org/GenApi/Version_1_1\" "
      "xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" "
      "xsi:schemaLocation=\"http://www.genicam.org/GenApi/Version_1_1 "
      "http://www.genicam.org/GenApi/GenApiSchema_Version_1_1.xsd\">\n";
  xml += categoryNodes();
  xml += "  <Port Name=\"Device\"/>\n";
  for (const Row& row : allRows()) {
    if (!row.category.empty() || isAsked(row)) xml += nodesOf(row);
  }
  for (std::uint32_t i = 0; i < Component::kCount; ++i) {
    xml += fmt::format(
        "  <IntSwissKnife Name=\"IsComponent{}\"><pVariable Name=\"SEL\">ComponentSelectorReg</pVariable>"
        "<Formula>SEL = {}</Formula></IntSwissKnife>\n",
        i, i);
  }
  for (const BitsRow& row : allBitsRows()) xml += nodesOf(row);
  for (const ChunkRow& row : allChunks()) xml += nodesOf(row);
  xml += fmt::format(
      "  <Integer Name=\"{}\"><Visibility>Invisible</Visibility><Value>0</Value><Min>0</Min><Max>1</Max>"
      "</Integer>\n</RegisterDescription>\n",
      kLock);
  return xml;
}

// ---- documents ---------------------------------------------------------------------------------

std::string_view nameOf(Type type) {
  constexpr std::array<std::string_view, 8> kNames{"register", "integer", "float",  "enumeration",
                                                   "boolean",  "command", "string", "integer"};
  return kNames[static_cast<std::size_t>(type)];
}

std::string meaningOf(const Row& row) {
  std::string text{row.meaning};
  std::string entries;
  for (const Entry& one : row.entries) entries += (entries.empty() ? "" : ", ") + std::string{one.name};
  if (!entries.empty()) text += (text.empty() ? "" : "; ") + ("one of " + entries);
  if (row.selector) text += fmt::format("; one for each {}", rowOf(*row.selector).name);
  if (row.is_fixed_while_streaming) text += "; not while frames are sent";
  return text;
}

}  // namespace

const std::string& genicamXml() {
  static const std::string kXml = makeXml();
  return kXml;
}

std::string documentFeatures() {
  std::string text =
      "| feature | kind | access | unit | address | meaning |\n| --- | --- | --- | --- | --- | --- |\n";
  const auto line = [&](std::string_view name, Type type, Access access, std::string_view unit,
                        const std::string& address, std::string_view meaning) {
    text += fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", name, nameOf(type), textOf(access), unit,
                        address, meaning);
  };
  for (const std::string_view category : categories()) {
    text += fmt::format("| **{}** | | | | | |\n", category);
    for (const Row& row : allRows()) {
      if (row.category == category)
        line(row.name, row.type, row.access, row.unit, fmt::format("0x{:04X}", row.address), meaningOf(row));
    }
    for (const BitsRow& row : allBitsRows()) {
      if (row.category != category) continue;
      const std::string bits = row.high == row.low ? fmt::format("bit {}", row.low)
                                                   : fmt::format("bits {} to {}", row.high, row.low);
      line(row.name, row.type, row.access, row.unit, fmt::format("0x{:04X}, {}", rowOf(row.of).address, bits),
           row.meaning);
    }
    for (const ChunkRow& row : allChunks()) {
      if (category == kOfChunks)
        line(row.name, row.type, Access::ReadOnly, row.unit, fmt::format("chunk 0x{:08X}", row.id),
             row.meaning);
    }
  }
  text +=
      "\nOther registers:\n\n| address | bytes | access | register | meaning |\n| --- | --- | --- | --- | "
      "--- |\n";
  for (const Row& row : allRows()) {
    if (row.category.empty())
      text += fmt::format("| 0x{:04X} | {} | {} | {} | {} |\n", row.address, row.size, textOf(row.access),
                          row.name, row.meaning);
  }
  return text;
}

}  // namespace toftwin::daemon::gige_vision
