// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/features.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace toftwin::drivers::aravis {
namespace {

std::optional<double> numberIn(const std::string& text) {
  double number = 0.0;
  const char* end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, number);
  if (read.ec != std::errc{} || read.ptr != end || !std::isfinite(number)) return std::nullopt;
  return number;
}

// Doubles count whole numbers exactly up to here.
constexpr double kMostWhole = 9'007'199'254'740'992.0;
constexpr std::size_t kLongestText = 4096, kMostChoices = 1024;  // those of docs/protocol.md

Error wrong(const std::string& name, const std::string& value, std::string_view what) {
  return {Error::Code::InvalidArgument,
          fmt::format("{} = {} cannot be set: it must be {}", name, value, what)};
}

std::string boundsText(const Bounds& bounds) {
  return std::isfinite(bounds.min) && std::isfinite(bounds.max)
             ? fmt::format(" from {} to {}", bounds.min, bounds.max)
             : std::string{};
}

/// The library gives the largest number there is for "none".
Bounds boundsOf(double min, double max) {
  constexpr double kMost = std::numeric_limits<double>::max(), kFarthest = 9.2e18;
  if (std::isnan(min) || std::isnan(max) || min > max) return {};
  const double infinity = std::numeric_limits<double>::infinity();
  Bounds bounds{min, max};
  if (min <= -kFarthest || min <= -kMost) bounds.min = -infinity;
  if (max >= kFarthest || max >= kMost) bounds.max = infinity;
  return bounds;
}

}  // namespace

ArvGcNode* Features::node(const std::string& name) const {
  return arv_device_get_feature(device_, name.c_str());
}

Error Features::noFeature(const std::string& name) const {
  return {Error::Code::NotFound,
          fmt::format("the camera has no feature \"{}\" now; arv-tool-0.8 features lists what it "
                      "has",
                      name)};
}

bool Features::has(const std::string& name) const {
  Failure failure;
  ArvGcNode* found = node(name);
  if (found == nullptr || ARV_IS_GC_FEATURE_NODE(found) == FALSE) return false;
  return arv_device_is_feature_available(device_, name.c_str(), failure.slot()) != FALSE &&
         !failure;
}

bool Features::isWritable(const std::string& name) const {
  if (!has(name)) return false;
  const auto mode = arv_gc_feature_node_get_actual_access_mode(ARV_GC_FEATURE_NODE(node(name)));
  return mode == ARV_GC_ACCESS_MODE_RW || mode == ARV_GC_ACCESS_MODE_WO;
}

std::optional<double> Features::number(const std::string& name) const {
  if (!has(name)) return std::nullopt;
  Failure failure;
  ArvGcNode* of = node(name);
  double value = 0.0;
  if (ARV_IS_GC_ENUMERATION(of) != FALSE) {
    value = static_cast<double>(
        arv_gc_enumeration_get_int_value(ARV_GC_ENUMERATION(of), failure.slot()));
  } else if (ARV_IS_GC_BOOLEAN(of) != FALSE) {
    value = arv_gc_boolean_get_value(ARV_GC_BOOLEAN(of), failure.slot()) != FALSE ? 1.0 : 0.0;
  } else if (ARV_IS_GC_FLOAT(of) != FALSE) {
    value = arv_gc_float_get_value(ARV_GC_FLOAT(of), failure.slot());
  } else if (ARV_IS_GC_INTEGER(of) != FALSE) {
    value = static_cast<double>(arv_gc_integer_get_value(ARV_GC_INTEGER(of), failure.slot()));
  } else {
    return std::nullopt;
  }
  if (failure || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<std::string> Features::text(const std::string& name) const {
  if (!has(name)) return std::nullopt;
  Failure failure;
  const char* value =
      arv_gc_feature_node_get_value_as_string(ARV_GC_FEATURE_NODE(node(name)), failure.slot());
  if (failure || value == nullptr) return std::nullopt;
  return std::string{value};
}

Bounds Features::bounds(const std::string& name) const {
  ArvGcNode* of = node(name);
  Failure min_failure, max_failure;
  if (ARV_IS_GC_ENUMERATION(of) != FALSE) {
    guint count = 0;
    const Memory<gint64> values{arv_gc_enumeration_dup_available_int_values(
        ARV_GC_ENUMERATION(of), &count, min_failure.slot())};
    if (min_failure || count == 0) return {};
    const auto [least, most] = std::minmax_element(values.get(), values.get() + count);
    return boundsOf(static_cast<double>(*least), static_cast<double>(*most));
  }
  if (ARV_IS_GC_BOOLEAN(of) != FALSE) return {0.0, 1.0};
  double min = 0.0, max = 0.0;
  if (ARV_IS_GC_FLOAT(of) != FALSE) {
    min = arv_gc_float_get_min(ARV_GC_FLOAT(of), min_failure.slot());
    max = arv_gc_float_get_max(ARV_GC_FLOAT(of), max_failure.slot());
  } else {
    min = static_cast<double>(arv_gc_integer_get_min(ARV_GC_INTEGER(of), min_failure.slot()));
    max = static_cast<double>(arv_gc_integer_get_max(ARV_GC_INTEGER(of), max_failure.slot()));
  }
  return min_failure || max_failure ? Bounds{} : boundsOf(min, max);
}

Parameter Features::parameter(const std::string& name) const {
  Parameter parameter{.name = name, .value = number(name)};
  if (parameter.value) parameter.bounds = bounds(name);
  ArvGcNode* of = node(name);
  const bool is_switch = ARV_IS_GC_BOOLEAN(of) != FALSE, is_choice = ARV_IS_GC_ENUMERATION(of) != FALSE;
  if (!is_switch && !is_choice && ARV_IS_GC_STRING(of) == FALSE) return parameter;
  parameter.text = text(name);
  // What the protocol could not carry is as if the camera did not tell.
  const bool can_be_told = parameter.text && parameter.text->size() <= kLongestText &&
                           g_utf8_validate(parameter.text->c_str(), -1, nullptr) != FALSE;
  if (!can_be_told) parameter.text.reset();
  if (is_switch) parameter.choices = {"false", "true"};
  if (is_choice) parameter.choices = entries(name);
  if (parameter.choices.size() > kMostChoices) parameter.choices.clear();
  return parameter;
}

std::vector<std::string> Features::entries(const std::string& name) const {
  std::vector<std::string> names;
  ArvGcNode* of = node(name);
  if (of == nullptr || ARV_IS_GC_ENUMERATION(of) == FALSE || !has(name)) return names;
  Failure failure;
  guint count = 0;
  const Memory<const char*> entries{arv_gc_enumeration_dup_available_string_values(
      ARV_GC_ENUMERATION(of), &count, failure.slot())};
  for (guint i = 0; i < count && entries != nullptr; ++i) names.emplace_back(entries.get()[i]);
  return names;
}

Result<> Features::setNumber(const std::string& name, double value) const {
  if (!has(name)) return noFeature(name);
  ArvGcNode* of = node(name);
  const std::string said = fmt::format("{}", value);
  const Bounds bounds = parameter(name).bounds;
  const bool is_float = ARV_IS_GC_FLOAT(of) != FALSE && ARV_IS_GC_INTEGER(of) == FALSE;
  const bool is_whole = value == std::floor(value) && std::abs(value) <= kMostWhole;
  if (!std::isfinite(value) || !bounds.contains(value) || (!is_float && !is_whole)) {
    return wrong(name, said,
                 fmt::format("a {}number{}", is_float ? "" : "whole ", boundsText(bounds)));
  }
  const auto whole = is_float ? 0 : static_cast<gint64>(value);
  Failure failure;
  if (ARV_IS_GC_ENUMERATION(of) != FALSE) {
    arv_gc_enumeration_set_int_value(ARV_GC_ENUMERATION(of), whole, failure.slot());
  } else if (ARV_IS_GC_BOOLEAN(of) != FALSE) {
    arv_gc_boolean_set_value(ARV_GC_BOOLEAN(of), whole != 0 ? TRUE : FALSE, failure.slot());
  } else if (is_float) {
    arv_gc_float_set_value(ARV_GC_FLOAT(of), value, failure.slot());
  } else if (ARV_IS_GC_INTEGER(of) != FALSE) {
    arv_gc_integer_set_value(ARV_GC_INTEGER(of), whole, failure.slot());
  } else {
    return wrong(name, said, "set as text, by the key set");
  }
  if (failure) return failure.toError(fmt::format("{} = {} cannot be set", name, value));
  return {};
}

Result<> Features::setText(const std::string& name, const std::string& value) const {
  if (!has(name)) return noFeature(name);
  ArvGcNode* of = node(name);
  Failure failure;
  if (ARV_IS_GC_COMMAND(of) != FALSE) {
    arv_gc_command_execute(ARV_GC_COMMAND(of), failure.slot());
  } else if (ARV_IS_GC_ENUMERATION(of) != FALSE) {
    const auto names = entries(name);
    if (std::ranges::find(names, value) == names.end())
      return wrong(name, value, fmt::format("one of: {}", fmt::join(names, ", ")));
    arv_gc_enumeration_set_string_value(ARV_GC_ENUMERATION(of), value.c_str(), failure.slot());
  } else if (ARV_IS_GC_BOOLEAN(of) != FALSE && (value == "true" || value == "false")) {
    return setNumber(name, value == "true" ? 1.0 : 0.0);
  } else if (ARV_IS_GC_FLOAT(of) != FALSE || ARV_IS_GC_INTEGER(of) != FALSE ||
             ARV_IS_GC_BOOLEAN(of) != FALSE) {
    const auto number = numberIn(value);
    if (!number) return wrong(name, value, "a number");
    return setNumber(name, *number);
  } else if (ARV_IS_GC_STRING(of) != FALSE) {
    const gint64 most = arv_gc_string_get_max_length(ARV_GC_STRING(of), failure.slot());
    if (!failure && most > 0 && value.size() > static_cast<std::uint64_t>(most))
      return wrong(name, value, fmt::format("at most {} bytes long", most));
    arv_gc_string_set_value(ARV_GC_STRING(of), value.c_str(), failure.slot());
  } else {
    return wrong(name, value, "a number, a text or an entry, but this feature is none of them");
  }
  if (failure) return failure.toError(fmt::format("{} = {} cannot be set", name, value));
  return {};
}

}  // namespace toftwin::drivers::aravis
