// SPDX-License-Identifier: Apache-2.0
#include "protocol/settings/settings.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>
#include <sstream>

#include "protocol/settings/describe.h"

namespace toftwin::settings {

struct Table::State {
  std::shared_ptr<const toml::table> root;  // keeps `table` alive
  const toml::table* table = nullptr;
  std::filesystem::path file;
  std::set<std::string, std::less<>> read;
  struct Fault {
    toml::source_index line;
    std::string text;
    bool operator==(const Fault&) const = default;
  };
  std::vector<Fault> errors;
  std::vector<std::shared_ptr<State>> below;

  std::string place(const toml::node& node) const {
    return fmt::format("{}:{}", file.string(), node.source().begin.line);
  }
  void error(const toml::node& node, std::string_view key, std::string_view what) {
    errors.push_back({node.source().begin.line,
                      fmt::format("{}: {}{}{}", place(node), key, key.empty() ? "" : " ", what)});
  }
  const toml::node* find(std::string_view key) {
    const toml::node* node = table->get(key);
    if (node != nullptr) read.emplace(key);
    return node;
  }
  std::shared_ptr<State> descend(const toml::table& child) {
    auto state = std::make_shared<State>();
    state->root = root;
    state->table = &child;
    state->file = file;
    below.push_back(state);
    return state;
  }
  void gather(std::vector<Fault>& all) const {
    all.insert(all.end(), errors.begin(), errors.end());
    for (const auto& [key, node] : *table) {
      if (!read.contains(key.str())) {
        all.push_back({node.source().begin.line,
                       fmt::format("{}: unknown key \"{}\"", place(node), key.str())});
      }
    }
    for (const auto& child : below) child->gather(all);
  }
};

namespace {

/// Of a whole number, too, that lies between two of those that a double has.
double numberOf(const toml::node& node) {
  if (const auto whole = node.value_exact<std::int64_t>()) return static_cast<double>(*whole);
  return node.value_exact<double>().value_or(std::nan(""));
}

/// The error text for a number that is not what the key wants, or empty.
std::string whyNot(const toml::node& node, Bounds bounds, std::string_view unit, bool integral) {
  const std::string in_unit = unit.empty() ? "" : fmt::format(" {}", unit);
  if (!node.is_number()) return fmt::format("must be a number{}", unit.empty() ? "" : " in" + in_unit);
  if (integral && !node.is_integer()) return "must be a whole number";
  const double value = numberOf(node);
  if (std::isnan(value) || !bounds.contains(value)) {
    return fmt::format("= {:.12g}{} is out of bounds: it must be {}{}", value, in_unit,
                       describe(bounds).empty() ? "a number" : describe(bounds), in_unit);
  }
  return {};
}

}  // namespace

Result<Table> Table::load(const std::filesystem::path& file) {
  std::ifstream stream{file, std::ios::binary};
  std::ostringstream text;
  // Copying nothing counts as a failure, so an empty file must be told apart from one that cannot be read.
  const bool is_empty = stream.peek() == std::ifstream::traits_type::eof() && stream.eof();
  if (!is_empty && !(stream && text << stream.rdbuf())) {
    return Error{Error::Code::NotFound,
                 fmt::format("{}: cannot read this file; is the path right and may you read it?",
                             file.string())};
  }
  return parse(text.str(), file);
}

Result<Table> Table::parse(std::string_view text, const std::filesystem::path& name) {
  auto state = std::make_shared<State>();
  state->file = name;
  try {
    auto root = std::make_shared<toml::table>(toml::parse(text, name.string()));
    state->table = root.get();
    state->root = std::move(root);
  } catch (const toml::parse_error& error) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}:{}: {}", name.string(), error.source().begin.line,
                             error.description())};
  }
  return Table{std::move(state)};
}

bool Table::has(std::string_view key) const { return state_->table->contains(key); }

void Table::accept(std::string_view key) { state_->read.emplace(key); }

Table Table::anew() const {
  auto state = std::make_shared<State>();
  state->root = state_->root;
  state->table = state_->table;
  state->file = state_->file;
  return Table{std::move(state)};
}

void Table::acceptAll() {
  for (const auto& [key, node] : *state_->table) state_->read.emplace(key.str());
}

std::string Table::canonicalText() const {
  std::ostringstream text;
  text << toml::json_formatter{*state_->table};
  return text.str();
}

std::optional<double> Table::number(std::string_view key, Bounds bounds, std::string_view unit,
                                    bool integral) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return std::nullopt;
  if (std::string why = whyNot(*node, bounds, unit, integral); !why.empty()) {
    state_->error(*node, key, why);
    return std::nullopt;
  }
  return numberOf(*node);
}

std::optional<std::vector<double>> Table::numbers(std::string_view key, Bounds bounds,
                                                  std::string_view unit,
                                                  std::optional<std::size_t> count) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return std::nullopt;
  const toml::array* array = node->as_array();
  if (array == nullptr || (count && array->size() != *count)) {
    state_->error(*node, key,
                  count ? fmt::format("must be an array of {} numbers", *count)
                        : std::string{"must be an array of numbers"});
    return std::nullopt;
  }
  std::vector<double> values;
  for (const toml::node& element : *array) {
    if (std::string why = whyNot(element, bounds, unit, false); !why.empty()) {
      state_->error(element, fmt::format("{}[{}]", key, values.size()), why);
      return std::nullopt;
    }
    values.push_back(numberOf(element));
  }
  return values;
}

std::optional<std::string> Table::text(std::string_view key) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_string()) {
    state_->error(*node, key, "must be text in quotes");
    return std::nullopt;
  }
  return node->value<std::string>();
}

std::optional<std::vector<std::string>> Table::texts(std::string_view key) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return std::nullopt;
  std::vector<std::string> values;
  if (const toml::array* array = node->as_array()) {
    for (const toml::node& element : *array) {
      if (auto value = element.value<std::string>(); value && element.is_string()) {
        values.push_back(*std::move(value));
      }
    }
    if (values.size() == array->size()) return values;
  }
  state_->error(*node, key, "must be an array of texts in quotes");
  return std::nullopt;
}

std::optional<bool> Table::flag(std::string_view key) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_boolean()) {
    state_->error(*node, key, "must be true or false");
    return std::nullopt;
  }
  return node->value<bool>();
}

std::optional<Table> Table::table(std::string_view key) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_table()) {
    state_->error(*node, key, "must be a table");
    return std::nullopt;
  }
  return Table{state_->descend(*node->as_table())};
}

std::vector<Table> Table::tables(std::string_view key) {
  std::vector<Table> all;
  const toml::node* node = state_->find(key);
  if (node == nullptr) return all;
  if (const toml::table* one = node->as_table()) {
    all.push_back(Table{state_->descend(*one)});
    return all;
  }
  if (const toml::array* array = node->as_array(); array != nullptr && (array->empty() || array->is_array_of_tables())) {
    for (const toml::node& element : *array) {
      all.push_back(Table{state_->descend(*element.as_table())});
    }
    return all;
  }
  state_->error(*node, key, fmt::format("must be tables, written [[{}]]", key));
  return all;
}

void Table::complain(std::string_view key, std::string_view what) {
  const toml::node* node = key.empty() ? nullptr : state_->table->get(key);
  state_->error(node != nullptr ? *node : *state_->table, key, what);
}

Result<> Table::check() const {
  std::vector<State::Fault> all;
  state_->gather(all);
  if (all.empty()) return {};
  std::ranges::stable_sort(all, {}, &State::Fault::line);  // as a reader of the file meets them
  std::string text;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (std::find(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(i), all[i]) !=
        all.begin() + static_cast<std::ptrdiff_t>(i))
      continue;
    text += (text.empty() ? "" : "\n") + all[i].text;
  }
  return Error{Error::Code::InvalidArgument, text};
}

std::filesystem::path Table::resolve(const std::filesystem::path& path) const {
  return path.is_absolute() ? path : state_->file.parent_path() / path;
}

std::vector<std::filesystem::path> Table::files() const {
  std::vector<std::filesystem::path> found;
  const auto look = [&](const auto& self, const toml::node& node) -> void {
    if (const auto* table = node.as_table()) {
      for (const auto& [key, below] : *table) self(self, below);
    } else if (const auto* array = node.as_array()) {
      for (const toml::node& below : *array) self(self, below);
    } else if (const auto* text = node.as_string(); text != nullptr && !text->get().empty()) {
      std::error_code not_there;
      const std::filesystem::path path = resolve(text->get());
      if (std::filesystem::is_regular_file(path, not_there)) found.push_back(path);
    }
  };
  look(look, *state_->table);
  return found;
}

std::string Table::place(std::string_view key) const {
  const toml::node* node = key.empty() ? nullptr : state_->table->get(key);
  return state_->place(node != nullptr ? *node : *state_->table);
}

}  // namespace toftwin::settings
