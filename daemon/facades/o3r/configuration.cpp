// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3r/configuration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace toftwin::daemon::o3r {
namespace {

constexpr int kDeepest = 32;
constexpr std::size_t kLongestText = 4096, kMostItems = 16;

Error notThere(const std::string& pointer) {
  return {Error::Code::NotFound,
          fmt::format("\"{}\" is no place of the configuration; `getSchema` tells which there are", pointer)};
}

Error wrong(const std::string& pointer, std::string_view why) {
  return {Error::Code::InvalidArgument, fmt::format("\"{}\" {}", pointer, why)};
}

bool isWithin(const Json& value, const Json& schema) {
  const double number = value.get<double>();
  return std::isfinite(number) && number >= schema.value("minimum", -HUGE_VAL) &&
         number <= schema.value("maximum", HUGE_VAL);
}

Result<> fitsNumber(const std::string& pointer, const Json& value, const Json& schema) {
  const bool is_whole = schema.at("type") == "integer";
  if (!value.is_number()) return wrong(pointer, "takes a number");
  if (is_whole && !value.is_number_integer() && std::trunc(value.get<double>()) != value.get<double>())
    return wrong(pointer, "takes a whole number");
  if (isWithin(value, schema)) return {};
  return wrong(pointer, fmt::format("takes {} to {}", schema.value("minimum", -HUGE_VAL),
                                    schema.value("maximum", HUGE_VAL)));
}

Result<> fitsText(const std::string& pointer, const Json& value, const Json& schema) {
  if (!value.is_string()) return wrong(pointer, "takes a text");
  if (value.get_ref<const std::string&>().size() > schema.value("maxLength", kLongestText))
    return wrong(pointer, "takes no text of that length");
  const auto words = schema.find("enum");
  if (words == schema.end() || std::ranges::find(*words, value) != words->end()) return {};
  return wrong(pointer, "takes one of " + textOf(*words));
}

Result<> fits(const std::string& pointer, const Json& value, const Json& schema) {
  const std::string type = schema.at("type");
  if (type == "boolean") return value.is_boolean() ? Result<>{} : wrong(pointer, "takes true or false");
  if (type == "string") return fitsText(pointer, value, schema);
  if (type == "integer" || type == "number") return fitsNumber(pointer, value, schema);
  const auto isText = [](const Json& item) {
    return item.is_string() && item.get_ref<const std::string&>().size() <= kLongestText;
  };
  const bool is_list = value.is_array() && value.size() <= kMostItems && std::ranges::all_of(value, isText);
  return is_list ? Result<>{} : wrong(pointer, "takes a list of texts");
}

/// The same number in the schema's type: 10.0 is 10 where whole numbers are.
Json normal(const Json& value, const Json& schema) {
  if (schema.at("type") == "integer" && value.is_number_float())
    return static_cast<std::int64_t>(value.get<double>());
  return value;
}

/// A name as it stands in a pointer (RFC 6901).
std::string escaped(const std::string& name) {
  std::string text;
  for (const char c : name) {
    if (c == '~')
      text += "~0";
    else if (c == '/')
      text += "~1";
    else
      text += c;
  }
  return text;
}

/// Where the schema of that place stands in the whole schema.
std::string schemaPointerOf(const std::string& pointer) {
  std::string place;
  for (const char c : pointer) c == '/' ? place += "/properties/" : place += c;
  return place;
}

/// Objects say that they are some, and that nothing else is in them.
void closeObjects(Json& schema) {
  const auto properties = schema.find("properties");
  if (properties == schema.end()) return;
  for (auto& [name, below] : properties->items()) closeObjects(below);
  schema["type"] = "object";
  schema["additionalProperties"] = false;
}

}  // namespace

Result<Json> readJson(std::string_view text) {
  bool is_too_deep = false;
  const auto watch = [&](int depth, Json::parse_event_t, Json&) {
    is_too_deep |= depth > kDeepest;
    return depth <= kDeepest;
  };
  constexpr bool kThrows = false;
  Json json = Json::parse(text, watch, kThrows);
  if (is_too_deep) return Error{Error::Code::TooLarge, "JSON: it is nested too deeply"};
  if (json.is_discarded()) return Error{Error::Code::Malformed, "JSON: this is none"};
  return json;
}

std::string textOf(const Json& json) {
  constexpr int kOneLine = -1;
  constexpr bool kEscapes = false;
  return json.dump(kOneLine, ' ', kEscapes, Json::error_handler_t::replace);
}

void Configuration::add(std::string pointer, Leaf leaf) {
  if (leaf.factory.is_null()) leaf.factory = leaf.value;
  leaf.widest = leaf.schema;
  leaves_.insert_or_assign(std::move(pointer), std::move(leaf));
}

bool Configuration::isPlace(const std::string& pointer) const {
  if (pointer.empty() || leaves_.contains(pointer)) return true;
  const auto below = leaves_.lower_bound(pointer + "/");
  return below != leaves_.end() && below->first.starts_with(pointer + "/");
}

/// Calls `take` with each leaf at or below one of those places.
template <class Take>
Result<> Configuration::visit(const std::vector<std::string>& pointers, Take take) const {
  for (const std::string& pointer : pointers) {
    if (!isPlace(pointer)) return notThere(pointer);
  }
  const auto isWanted = [&](const std::string& leaf) {
    return pointers.empty() || std::ranges::any_of(pointers, [&](const std::string& pointer) {
             return leaf == pointer || leaf.starts_with(pointer + "/");
           });
  };
  for (const auto& [pointer, leaf] : leaves_) {
    if (isWanted(pointer)) take(pointer, leaf);
  }
  return {};
}

Result<Json> Configuration::get(const std::vector<std::string>& pointers) const {
  Json tree = Json::object();
  const auto visited = visit(pointers, [&](const std::string& pointer, const Leaf& leaf) {
    tree[Json::json_pointer{pointer}] = leaf.value;
  });
  if (!visited) return visited.error();
  return tree;
}

Result<Json> Configuration::settable(const std::vector<std::string>& pointers) const {
  Json tree = Json::object();
  const auto visited = visit(pointers, [&](const std::string& pointer, const Leaf& leaf) {
    if (!leaf.is_read_only) tree[Json::json_pointer{pointer}] = leaf.value;
  });
  if (!visited) return visited.error();
  return tree;
}

Result<Json> Configuration::schema(const std::vector<std::string>& pointers) const {
  Json tree = Json::object();
  const auto visited = visit(pointers, [&](const std::string& pointer, const Leaf& leaf) {
    Json one = leaf.schema;
    one["default"] = leaf.factory;
    if (leaf.is_read_only) one["readOnly"] = true;
    tree[Json::json_pointer{schemaPointerOf(pointer)}] = std::move(one);
  });
  if (!visited) return visited.error();
  closeObjects(tree);
  tree["$schema"] = "http://json-schema.org/draft-07/schema#";
  return tree;
}

Result<> Configuration::collect(const Json& fragment, const std::string& pointer, Changes& changes) const {
  const auto found = leaves_.find(pointer);
  const bool is_leaf = found != leaves_.end() && found->second.schema.at("type") != "object";
  if (is_leaf) {
    const Leaf& leaf = found->second;
    if (leaf.is_read_only || fragment == leaf.value) return {};
    if (auto fit = fits(pointer, fragment, leaf.schema); !fit) return fit;
    changes.emplace_back(pointer, normal(fragment, leaf.schema));
    return {};
  }
  if (!isPlace(pointer)) return notThere(pointer);
  if (!fragment.is_object()) return wrong(pointer, "takes an object");
  for (const auto& [name, below] : fragment.items()) {
    if (auto collected = collect(below, pointer + "/" + escaped(name), changes); !collected) return collected;
  }
  return {};
}

Result<Configuration::Changes> Configuration::changesOf(const Json& fragment) const {
  Changes changes;
  if (auto collected = collect(fragment, "", changes); !collected) return collected.error();
  return changes;
}

Result<Configuration::Changes> Configuration::resetOf(const std::string& pointer) const {
  Changes changes;
  const auto visited = visit({pointer}, [&](const std::string& place, const Leaf& leaf) {
    if (!leaf.is_read_only && leaf.value != leaf.factory) changes.emplace_back(place, leaf.factory);
  });
  if (!visited) return visited.error();
  return changes;
}

void Configuration::apply(const Changes& changes) {
  for (const auto& [pointer, value] : changes) leaves_.at(pointer).value = value;
}

}  // namespace toftwin::daemon::o3r
