// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <toftwin/fields.h>

#include "drivers/o3d303/wire/xmlrpc.h"

/// The camera's parameters as a real one's configuration lists them: what each is at first, and what it may
/// be.
namespace toftwin::daemon::o3d303 {

using Parameters = std::map<std::string, std::string>;

struct Rule {
  enum class Kind {
    Fixed,   ///< cannot be set
    Text,    ///< at most bounds.max bytes
    Whole,   ///< within bounds
    Real,    ///< within bounds
    Switch,  ///< true or false
    Source,  ///< as the source's own parameter (bindings.h) says
    Special  ///< has a check of its own
  };
  std::string_view name, initial;
  Kind kind = Kind::Fixed;
  Bounds bounds{};
};

std::span<const Rule> deviceRules();
std::span<const Rule> networkRules();
std::span<const Rule> timeRules();
std::span<const Rule> applicationRules();
std::span<const Rule> imagerRules();
std::span<const Rule> spatialFilterRules();
std::span<const Rule> temporalFilterRules();

Parameters initialOf(std::span<const Rule> rules);
const Rule* ruleOf(std::span<const Rule> rules, std::string_view name);

/// Puts the value into the form in which the camera keeps it ("1" of a switch is "true"), or says why it will
/// not do. Nothing: it will. For the kinds from Fixed to Switch.
std::optional<toftwin::o3d303::XmlRpcAnswer> check(const Rule& rule, std::string& value);
std::optional<toftwin::o3d303::XmlRpcAnswer> checkNumber(std::string_view name, std::string& value,
                                                         Bounds bounds, bool is_integral);
toftwin::o3d303::XmlRpcAnswer readOnly(std::string_view name);
toftwin::o3d303::XmlRpcAnswer noSuchParameter(std::string_view name);

/// The struct of structs {min, max} that getAllParameterLimits gives; `bounds` are asked of what has any.
toftwin::o3d303::XmlRpcValue limitsOf(const std::map<std::string, Bounds>& bounds);

}  // namespace toftwin::daemon::o3d303
