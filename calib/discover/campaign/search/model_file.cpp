// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/search/model_file.h"

#include <algorithm>
#include <limits>
#include <sstream>

#include <fmt/format.h>

#include "protocol/settings/describe.h"

namespace toftwin::discover {
namespace {

/// What a reader of the camera file wants to know of a number, or of those of a list: at least where it was
/// found.
std::string errorOf(const FittedEffect& effect, const std::string& key) {
  std::string errors;
  for (const FittedNumber& number : effect.numbers) {
    if (number.key == key || number.key.starts_with(key + "["))
      errors += fmt::format("{}{:.2g}", errors.empty() ? "  # ± " : ", ", number.error);
  }
  return errors;
}

/// The lines of a camera file, each with whether an effect begins there.
std::vector<std::string> linesOf(std::string_view text) {
  std::vector<std::string> lines;
  std::istringstream in{std::string{text}};
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::string withoutIndent(const std::string& line) {
  const auto first = line.find_first_not_of(" \t");
  return first == std::string::npos ? "" : line.substr(first);
}

}  // namespace

std::string tomlOf(const FittedEffect& fitted, const std::string& why) {
  std::string text = why.empty() ? "" : "# " + why + "\n";
  text += fmt::format("[[effect]]\ntype = {}\n", settings::toToml(nameOf(fitted.effect)));
  const auto keys =
      std::visit([]<class E>(const E& effect) { return settings::keysOf(effect); }, fitted.effect);
  for (const settings::Key& key : keys) {
    // What is fitted of terms are their coefficients.
    text += fmt::format("{} = {}{}\n", key.name, key.value, errorOf(fitted, key.name == "terms" ? "coefficients" : key.name));
  }
  return text;
}

std::string withEffects(std::string_view camera_file, const std::vector<sim::AnyEffect>& declared,
                        const std::vector<std::optional<FittedEffect>>& updates,
                        const std::vector<FittedEffect>& added, const std::string& about) {
  std::string text = "# " + about + "\n";
  std::size_t effect = 0;
  bool is_replaced = false;
  std::vector<FittedEffect> waiting = added;
  const auto writeBefore = [&](std::size_t place) {  // where light meets them
    for (auto one = waiting.begin(); one != waiting.end();) {
      if (placeOf(one->effect) >= place) {
        ++one;
        continue;
      }
      text += tomlOf(*one, "found by toftwin discover") + "\n";
      one = waiting.erase(one);
    }
  };
  for (const std::string& line : linesOf(camera_file)) {
    const std::string word = withoutIndent(line);
    if (word.starts_with("[[effect]]")) {
      if (effect < declared.size()) writeBefore(placeOf(declared[effect]));
      is_replaced = effect < updates.size() && updates[effect].has_value();
      if (is_replaced) text += tomlOf(*updates[effect], "with other numbers than before") + "\n";
      ++effect;
    } else if (word.starts_with("[")) {
      is_replaced = false;
    }
    if (!is_replaced) text += line + "\n";
  }
  text += "\n";
  writeBefore(std::numeric_limits<std::size_t>::max());
  return text;
}

}  // namespace toftwin::discover
