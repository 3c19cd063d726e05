// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <toftwin/result.h>

namespace toftwin::daemon::o3r {

using Json = nlohmann::json;

/// A text as JSON. Malformed, or TooLarge where it is nested too deeply. Any text is safe.
Result<Json> readJson(std::string_view text);
/// Any JSON as text.
std::string textOf(const Json& json);

/// One value of the device, with what may be set there.
struct Leaf {
  Json value{};
  Json schema{};   ///< as JSON schema says it: type, minimum, maximum, enum, maxLength
  Json factory{};  ///< what a reset makes of it
  bool is_read_only = false;
  Json widest = {};  ///< the schema as the device has it, whatever is plugged in
};

/// The device's configuration: values in a tree, each with its JSON pointer, and the schema that they follow.
class Configuration {
 public:
  using Changes = std::vector<std::pair<std::string, Json>>;

  void add(std::string pointer, Leaf leaf);
  /// The leaf there, which must be.
  [[nodiscard]] Leaf& at(const std::string& pointer) { return leaves_.at(pointer); }
  [[nodiscard]] const Json& valueAt(const std::string& pointer) const { return leaves_.at(pointer).value; }
  [[nodiscard]] const std::map<std::string, Leaf>& leaves() const { return leaves_; }

  /// Those parts of the tree; all of it where there are none. NotFound.
  [[nodiscard]] Result<Json> get(const std::vector<std::string>& pointers) const;
  /// The schema of those parts.
  [[nodiscard]] Result<Json> schema(const std::vector<std::string>& pointers) const;
  /// Those of the parts that can be set: what is saved for the next start.
  [[nodiscard]] Result<Json> settable(const std::vector<std::string>& pointers) const;
  /// What a fragment of the tree would set. What is only shown is passed over, so that a whole dump can be
  /// set. NotFound: there is no such place; InvalidArgument: the value is of another type, or out of range.
  [[nodiscard]] Result<Changes> changesOf(const Json& fragment) const;
  /// What a reset of that place and of all below it would set.
  [[nodiscard]] Result<Changes> resetOf(const std::string& pointer) const;
  void apply(const Changes& changes);

 private:
  [[nodiscard]] bool isPlace(const std::string& pointer) const;
  Result<> collect(const Json& fragment, const std::string& pointer, Changes& changes) const;
  template <class Take>
  Result<> visit(const std::vector<std::string>& pointers, Take take) const;

  std::map<std::string, Leaf> leaves_;
};

}  // namespace toftwin::daemon::o3r
