// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace toftwin::compare {

/// A JSON value, to be written or read. Objects keep the order in which keys were set; a number that is not
/// finite is written as null, because JSON has no other word for it.
class Json {
 public:
  Json() = default;
  Json(std::string text) : value_(std::move(text)) {}    // NOLINT(google-explicit-constructor)
  Json(const char* text) : value_(std::string{text}) {}  // NOLINT(google-explicit-constructor)
  Json(std::same_as<bool> auto flag) : value_(flag) {}   // NOLINT(google-explicit-constructor)
  Json(std::floating_point auto number)                  // NOLINT(google-explicit-constructor)
      : value_(static_cast<double>(number)) {}
  template <std::integral Number>
  requires(!std::same_as<Number, bool>) Json(Number number)
      : value_(static_cast<long long>(number)) {}  // NOLINT(google-explicit-constructor)

  static Json object();
  static Json array();
  template <class Values>
  static Json arrayOf(const Values& values) {
    Json list = array();
    for (const auto& value : values) list.push(value);
    return list;
  }

  /// Sets a key of an object (a null value becomes an object) and gives this value back.
  Json& set(std::string key, Json value);
  /// Appends to an array (a null value becomes an array) and gives this value back.
  Json& push(Json value);
  /// Of an object, or null.
  [[nodiscard]] const Json* find(std::string_view key) const;
  /// Elements of an array; 0 for anything else.
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] const Json& at(std::size_t element) const;
  /// NaN for anything but a number.
  [[nodiscard]] double number() const;
  [[nodiscard]] bool isText() const;
  /// Empty for anything but text.
  [[nodiscard]] std::string words() const;
  /// The text, indented by two spaces a level.
  [[nodiscard]] std::string text() const;
  /// The text on one line, for logs of one value a line.
  [[nodiscard]] std::string line() const;

 private:
  using Object = std::vector<std::pair<std::string, Json>>;
  using Array = std::vector<Json>;
  void write(std::string& out, std::size_t level, bool indented) const;
  std::variant<std::monostate, bool, long long, double, std::string, Array, Object> value_;
};

}  // namespace toftwin::compare
