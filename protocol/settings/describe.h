// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <initializer_list>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <toftwin/fields.h>
#include <toftwin/units.h>

namespace toftwin::settings {

/// What is known of one key: for documents, and to write an aggregate back as TOML.
struct Key {
  std::string name;     ///< with its groups: "emitter[].position_m"
  std::string value;    ///< of the visited aggregate, as TOML
  std::string bounds;   ///< "1 to 20000", "one of sine, square", or empty
  std::string unit;
  std::string help;
};

/// A number as TOML writes it: the shortest text that reads back to the same double.
std::string toToml(double value);
std::string toToml(const std::string& text);
std::string describe(Bounds bounds);
/// The keys as a Markdown table: key, default, bounds, unit, meaning.
std::string markdownTable(const std::vector<Key>& keys);

/// Visitor that lists an aggregate's keys with their present values.
class Lister {
 public:
  explicit Lister(std::vector<Key>& keys, std::string prefix = {})
      : keys_(keys), prefix_(std::move(prefix)) {}

  template <class D>
  void quantity(const char* name, Quantity<D>& value, Unit<D> unit, Bounds bounds, const char* help) {
    add(std::string{name} + "_" + unit.suffix, toToml(value.in(unit)), describe(bounds), unit.suffix,
        help);
  }
  template <class D>
  void quantities(const char* name, std::vector<Quantity<D>>& values, Unit<D> unit, Bounds bounds,
                  const char* help) {
    std::vector<double> plain;
    for (const auto& value : values) plain.push_back(value.in(unit));
    add(std::string{name} + "_" + unit.suffix, list(plain), describe(bounds), unit.suffix, help);
  }
  template <class Number>
    requires std::is_arithmetic_v<Number>
  void number(const char* name, Number& value, Bounds bounds, const char* help) {
    add(name,
        std::is_integral_v<Number> ? std::to_string(value) : toToml(static_cast<double>(value)),
        describe(bounds), "", help);
  }
  void numbers(const char* name, std::vector<double>& values, Bounds bounds, const char* help) {
    add(name, list(values), describe(bounds), "", help);
  }
  template <std::size_t N>
  void numbers(const char* name, std::array<double, N>& values, Bounds bounds, const char* help) {
    add(name, list(values), describe(bounds), "", help);
  }
  void text(const char* name, std::string& value, const char* help) {
    add(name, toToml(value), "", "", help);
  }
  void texts(const char* name, std::vector<std::string>& values, const char* help) {
    add(name, list(values), "", "", help);
  }
  void flag(const char* name, bool& value, const char* help) {
    add(name, value ? "true" : "false", "", "", help);
  }
  template <class Enum>
  void choice(const char* name, Enum& value,
              std::initializer_list<std::pair<const char*, Enum>> options, const char* help) {
    std::string present, known;
    for (const auto& [word, meaning] : options) {
      if (meaning == value) present = word;
      known += (known.empty() ? "one of " : ", ") + std::string{word};
    }
    add(name, toToml(present), known, "", help);
  }
  template <class Aggregate>
  void group(const char* name, Aggregate& value, const char*) {
    Lister below{keys_, prefix_ + name + "."};
    value.visit(below);
  }
  template <class Aggregate>
  void group(const char* name, std::vector<Aggregate>&, const char*) {
    Aggregate example;
    Lister below{keys_, prefix_ + name + "[]."};
    example.visit(below);
  }

 private:
  template <class Values>
  static std::string list(const Values& values) {
    std::string all = "[";
    for (const auto& value : values) all += (all.size() > 1 ? ", " : "") + toToml(value);
    return all + "]";
  }
  void add(std::string name, std::string value, std::string bounds, std::string unit,
           const char* help) {
    keys_.push_back({prefix_ + std::move(name), std::move(value), std::move(bounds), std::move(unit),
                     help});
  }
  std::vector<Key>& keys_;
  std::string prefix_;
};

/// The keys of an aggregate with their present values. Members of a [[group]] are listed once, with
/// their defaults.
template <class Aggregate>
std::vector<Key> keysOf(Aggregate aggregate = {}) {
  std::vector<Key> keys;
  Lister lister{keys};
  aggregate.visit(lister);
  return keys;
}

}  // namespace toftwin::settings
