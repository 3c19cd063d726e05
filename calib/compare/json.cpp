// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/json.h"

#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace toftwin::compare {
namespace {

void writeText(std::string& out, const std::string& text) {
  out += '"';
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (code < 0x20) {
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(code));
    } else {
      out += c;
    }
  }
  out += '"';
}

void newLine(std::string& out, std::size_t level) {
  out += '\n';
  out.append(2 * level, ' ');
}

}  // namespace

Json Json::object() {
  Json json;
  json.value_ = Object{};
  return json;
}

Json Json::array() {
  Json json;
  json.value_ = Array{};
  return json;
}

Json& Json::set(std::string key, Json value) {
  if (!std::holds_alternative<Object>(value_)) value_ = Object{};
  auto& members = std::get<Object>(value_);
  for (auto& [known, old] : members) {
    if (known == key) {
      old = std::move(value);
      return *this;
    }
  }
  members.emplace_back(std::move(key), std::move(value));
  return *this;
}

Json& Json::push(Json value) {
  if (!std::holds_alternative<Array>(value_)) value_ = Array{};
  std::get<Array>(value_).push_back(std::move(value));
  return *this;
}

const Json* Json::find(std::string_view key) const {
  const auto* members = std::get_if<Object>(&value_);
  if (members == nullptr) return nullptr;
  for (const auto& [known, value] : *members) {
    if (known == key) return &value;
  }
  return nullptr;
}

std::size_t Json::size() const {
  const auto* list = std::get_if<Array>(&value_);
  return list == nullptr ? 0 : list->size();
}

const Json& Json::at(std::size_t element) const { return std::get<Array>(value_).at(element); }

double Json::number() const {
  if (const auto* whole = std::get_if<long long>(&value_)) return static_cast<double>(*whole);
  const auto* real = std::get_if<double>(&value_);
  return real == nullptr ? std::numeric_limits<double>::quiet_NaN() : *real;
}

bool Json::isText() const { return std::holds_alternative<std::string>(value_); }

std::string Json::words() const { return isText() ? std::get<std::string>(value_) : std::string{}; }

std::string Json::text() const {
  std::string out;
  write(out, 0, true);
  out += '\n';
  return out;
}

std::string Json::line() const {
  std::string out;
  write(out, 0, false);
  return out;
}

void Json::write(std::string& out, std::size_t level, bool indented) const {
  if (const auto* flag = std::get_if<bool>(&value_)) {
    out += *flag ? "true" : "false";
  } else if (const auto* whole = std::get_if<long long>(&value_)) {
    out += fmt::format("{}", *whole);
  } else if (const auto* number = std::get_if<double>(&value_)) {
    out += std::isfinite(*number) ? fmt::format("{}", *number) : "null";
  } else if (const auto* words = std::get_if<std::string>(&value_)) {
    writeText(out, *words);
  } else if (const auto* list = std::get_if<Array>(&value_)) {
    out += '[';
    for (std::size_t i = 0; i < list->size(); ++i) {
      if (i > 0) out += ", ";
      (*list)[i].write(out, level + 1, indented);
    }
    out += ']';
  } else if (const auto* members = std::get_if<Object>(&value_)) {
    out += '{';
    for (std::size_t i = 0; i < members->size(); ++i) {
      if (i > 0) out += ',';
      if (indented) newLine(out, level + 1);
      writeText(out, (*members)[i].first);
      out += ": ";
      (*members)[i].second.write(out, level + 1, indented);
    }
    if (indented && !members->empty()) newLine(out, level);
    out += '}';
  } else {
    out += "null";
  }
}

}  // namespace toftwin::compare
