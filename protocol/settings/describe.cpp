// SPDX-License-Identifier: Apache-2.0
#include "protocol/settings/describe.h"

#include <fmt/format.h>

#include <cmath>

namespace toftwin::settings {
namespace {

std::string inTableCell(std::string text) {
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) {
    text.insert(at, "\\");
  }
  return text;
}

}  // namespace

std::string toToml(double value) {
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  // A quantity's value went through its SI unit and back, which costs the last bits: 12 digits
  // give the number that a person wrote.
  std::string text = fmt::format("{:.12g}", value);
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

std::string toToml(const std::string& text) {
  std::string quoted = "\"";
  for (char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

std::string describe(Bounds bounds) {
  if (std::isinf(bounds.min) && std::isinf(bounds.max)) return "";
  if (std::isinf(bounds.max)) return fmt::format("at least {:.12g}", bounds.min);
  if (std::isinf(bounds.min)) return fmt::format("at most {:.12g}", bounds.max);
  return fmt::format("{:.12g} to {:.12g}", bounds.min, bounds.max);
}

std::string markdownTable(const std::vector<Key>& keys) {
  std::string table = "| key | default | bounds | unit | meaning |\n| --- | --- | --- | --- | --- |\n";
  for (const Key& key : keys) {
    table += fmt::format("| `{}` | `{}` | {} | {} | {} |\n", key.name, inTableCell(key.value),
                         key.bounds, key.unit, inTableCell(key.help));
  }
  return table;
}

}  // namespace toftwin::settings
