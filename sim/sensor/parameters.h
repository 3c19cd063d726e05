// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <toftwin/fields.h>
#include <toftwin/parameter.h>
#include <toftwin/result.h>
#include <toftwin/units.h>

#include "protocol/settings/describe.h"

namespace toftwin::sim {

/// Visitor that writes every key and value, members of groups included: equal text, equal
/// aggregate. Doubles as shortest text that reads back to the same bits.
class CanonicalText {
 public:
  std::string written;

  template <class D>
  void quantity(const char* name, Quantity<D>& value, Unit<D> unit, Bounds, const char*) {
    line(name, exact(value.in(unit)));
  }
  template <class D>
  void quantities(const char* name, std::vector<Quantity<D>>& values, Unit<D> unit, Bounds,
                  const char*) {
    for (auto& value : values) line(name, exact(value.in(unit)));
  }
  template <class Number>
  requires std::is_arithmetic_v<Number>
  void number(const char* name, Number& value, Bounds, const char*) {
    line(name, exact(static_cast<double>(value)));
  }
  template <class Values>
  void numbers(const char* name, Values& values, Bounds, const char*) {
    for (double value : values) line(name, exact(value));
  }
  template <class Text>
  requires std::is_same_v<Text, std::string>
  void text(const char* name, Text& value, const char*) { line(name, settings::toToml(value)); }
  void texts(const char* name, std::vector<std::string>& values, const char*) {
    for (const std::string& value : values) line(name, settings::toToml(value));
  }
  void flag(const char* name, bool& value, const char*) { line(name, value ? "true" : "false"); }
  template <class Enum>
  void choice(const char* name, Enum& value,
              std::initializer_list<std::pair<const char*, Enum>> options, const char*) {
    for (const auto& [word, meaning] : options) {
      if (meaning == value) line(name, word);
    }
  }
  template <class Aggregate>
  void group(const char* name, Aggregate& value, const char*) {
    line(name, "{");
    value.visit(*this);
    line(name, "}");
  }
  template <class Aggregate>
  void group(const char* name, std::vector<Aggregate>& values, const char* help) {
    for (Aggregate& value : values) group(name, value, help);
  }

 private:
  static std::string exact(double value) {
    std::array<char, 40> digits{};
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
    return {digits.data(), end};
  }
  void line(std::string_view name, std::string_view value) {
    written.append(name).append(" = ").append(value).append("\n");
  }
};

/// Visitor that lists the numbers of a flat aggregate, or sets one by its key.
class NumberSetter {
 public:
  NumberSetter(std::string_view key, double value) : key_(key), value_(value) {}

  std::vector<Parameter> met;  ///< all numbers, with what they were before
  bool is_set = false;
  std::string problem;  ///< why the value does not do, or empty

  template <class D>
  void quantity(const char* name, Quantity<D>& value, Unit<D> unit, Bounds bounds, const char*) {
    if (wants({std::string{name} + "_" + unit.suffix, value.in(unit), bounds}, false))
      value = value_ * unit;
  }
  template <class Number>
  requires std::is_arithmetic_v<Number>
  void number(const char* name, Number& value, Bounds bounds, const char*) {
    if (wants({name, static_cast<double>(value), bounds}, std::is_integral_v<Number>))
      value = static_cast<Number>(value_);
  }
  template <class Values>
  void numbers(const char*, Values&, Bounds, const char*) {}  // a list is no number
  void text(const char*, std::string&, const char*) {}
  void texts(const char*, std::vector<std::string>&, const char*) {}
  template <class Enum>
  void choice(const char*, Enum&, std::initializer_list<std::pair<const char*, Enum>>, const char*) {}

 private:
  bool wants(Parameter parameter, bool integral) {
    const bool is_it = parameter.name == key_;
    const Bounds bounds = parameter.bounds;
    met.push_back(std::move(parameter));
    if (!is_it) return false;
    is_set = true;
    if (std::isnan(value_) || !bounds.contains(value_))
      problem = "must be " + settings::describe(bounds);
    if (integral && value_ != std::floor(value_)) problem = "must be a whole number";
    return problem.empty();
  }
  std::string_view key_;
  double value_;
};

}  // namespace toftwin::sim
