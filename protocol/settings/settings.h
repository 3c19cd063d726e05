// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <toftwin/fields.h>
#include <toftwin/result.h>
#include <toftwin/units.h>

namespace toftwin::settings {

/// A table of a TOML file whose keys are ticked off as they are read. Errors are gathered, so a
/// user sees all of them at once; `check()` gives them, together with every key nobody read.
/// Copies refer to the same table.
class Table {
 public:
  static Result<Table> load(const std::filesystem::path& file);
  /// From text; `name` stands for the file in errors, and relative paths start at its folder.
  static Result<Table> parse(std::string_view toml, const std::filesystem::path& name);

  /// Reads the aggregate's keys (see <toftwin/fields.h>); keys that are absent keep their value.
  template <class Aggregate>
  void read(Aggregate& aggregate);

  [[nodiscard]] bool has(std::string_view key) const;
  /// Ticks a key off without reading it.
  void accept(std::string_view key);
  /// The same table with no key ticked off and nothing complained about.
  [[nodiscard]] Table anew() const;
  /// Ticks all keys off, for a table that is known to be good.
  void acceptAll();
  /// All keys and values in one form: equal for two tables that say the same, whatever their layout.
  [[nodiscard]] std::string canonicalText() const;
  /// The files that texts of this table, at any depth, name: those that are there.
  [[nodiscard]] std::vector<std::filesystem::path> files() const;
  std::optional<double> number(std::string_view key, Bounds bounds, std::string_view unit,
                               bool integral);
  std::optional<std::vector<double>> numbers(std::string_view key, Bounds bounds,
                                             std::string_view unit,
                                             std::optional<std::size_t> count);
  std::optional<std::string> text(std::string_view key);
  std::optional<std::vector<std::string>> texts(std::string_view key);
  std::optional<bool> flag(std::string_view key);
  std::optional<Table> table(std::string_view key);
  /// An array of tables ([[key]]), or one table as an array of one.
  std::vector<Table> tables(std::string_view key);

  /// Adds an error about a key (or about the table itself, with an empty key) with its place.
  void complain(std::string_view key, std::string_view what);
  /// All errors of this table and those below it, unknown keys among them, or success.
  [[nodiscard]] Result<> check() const;

  /// `path` as the user meant it: relative to the folder of this file.
  [[nodiscard]] std::filesystem::path resolve(const std::filesystem::path& path) const;
  /// "file.toml:12", the place of a key or of the table.
  [[nodiscard]] std::string place(std::string_view key = {}) const;

 private:
  struct State;
  explicit Table(std::shared_ptr<State> state) : state_(std::move(state)) {}
  std::shared_ptr<State> state_;  // shared by the copies of this Table
};

/// Visitor that fills an aggregate from a Table.
class Reader {
 public:
  explicit Reader(Table& table) : table_(table) {}

  template <class D>
  void quantity(const char* name, Quantity<D>& value, Unit<D> unit, Bounds bounds, const char*) {
    if (auto read = table_.number(std::string{name} + "_" + unit.suffix, bounds, unit.suffix, false)) {
      value = *read * unit;
    }
  }
  template <class D>
  void quantities(const char* name, std::vector<Quantity<D>>& values, Unit<D> unit, Bounds bounds,
                  const char*) {
    const std::string key = std::string{name} + "_" + unit.suffix;
    if (auto read = table_.numbers(key, bounds, unit.suffix, std::nullopt)) {
      values.clear();
      for (double number : *read) values.push_back(number * unit);
    }
  }
  template <class Number>
    requires std::is_arithmetic_v<Number>
  void number(const char* name, Number& value, Bounds bounds, const char*) {
    if (auto read = table_.number(name, bounds, {}, std::is_integral_v<Number>)) {
      value = static_cast<Number>(*read);
    }
  }
  void numbers(const char* name, std::vector<double>& values, Bounds bounds, const char*) {
    if (auto read = table_.numbers(name, bounds, {}, std::nullopt)) values = *std::move(read);
  }
  template <std::size_t N>
  void numbers(const char* name, std::array<double, N>& values, Bounds bounds, const char*) {
    if (auto read = table_.numbers(name, bounds, {}, N)) {
      for (std::size_t i = 0; i < N; ++i) values[i] = (*read)[i];
    }
  }
  void text(const char* name, std::string& value, const char*) {
    if (auto read = table_.text(name)) value = *std::move(read);
  }
  void texts(const char* name, std::vector<std::string>& values, const char*) {
    if (auto read = table_.texts(name)) values = *std::move(read);
  }
  void flag(const char* name, bool& value, const char*) {
    if (auto read = table_.flag(name)) value = *read;
  }
  template <class Enum>
  void choice(const char* name, Enum& value,
              std::initializer_list<std::pair<const char*, Enum>> options, const char*) {
    const auto read = table_.text(name);
    if (!read) return;
    std::string known;
    for (const auto& [word, meaning] : options) {
      if (*read == word) {
        value = meaning;
        return;
      }
      known += (known.empty() ? "" : ", ") + std::string{word};
    }
    table_.complain(name, "is \"" + *read + "\", but must be one of: " + known);
  }
  template <class Aggregate>
  void group(const char* name, Aggregate& value, const char*) {
    if (auto below = table_.table(name)) below->read(value);
  }
  template <class Aggregate>
  void group(const char* name, std::vector<Aggregate>& values, const char*) {
    if (!table_.has(name)) return;
    values.clear();
    for (Table& below : table_.tables(name)) below.read(values.emplace_back());
  }

 private:
  Table& table_;
};

template <class Aggregate>
void Table::read(Aggregate& aggregate) {
  Reader reader{*this};
  aggregate.visit(reader);
}

/// A whole file as one aggregate; unknown keys are errors.
template <class Aggregate>
Result<Aggregate> loadFile(const std::filesystem::path& file) {
  Result<Table> table = Table::load(file);
  if (!table) return table.error();
  Aggregate aggregate;
  table->read(aggregate);
  if (auto checked = table->check(); !checked) return checked.error();
  return aggregate;
}

}  // namespace toftwin::settings
