// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/parameter.h>
#include <toftwin/result.h>

#include "drivers/aravis/library.h"

/// A camera's features, by their GenICam names.
namespace toftwin::drivers::aravis {

class Features {
 public:
  explicit Features(ArvDevice* device) : device_(device) {}

  /// Whether the camera has it now: what selectors and other features hide is not there.
  [[nodiscard]] bool has(const std::string& name) const;
  [[nodiscard]] bool isWritable(const std::string& name) const;

  /// Numbers as they are, a flag as 0 or 1, an enumeration as the number of its entry. Nothing if
  /// it is none of these, or cannot be read.
  [[nodiscard]] std::optional<double> number(const std::string& name) const;
  [[nodiscard]] std::optional<std::string> text(const std::string& name) const;
  /// The number with its bounds; a switch and an enumeration also as a text with its choices, a text as such.
  [[nodiscard]] Parameter parameter(const std::string& name) const;
  /// The names of an enumeration's entries that can be chosen now.
  [[nodiscard]] std::vector<std::string> entries(const std::string& name) const;

  Result<> setNumber(const std::string& name, double value) const;
  /// Whatever its type; an enumeration by its entry's name, a command by any text.
  Result<> setText(const std::string& name, const std::string& value) const;

 private:
  [[nodiscard]] Bounds bounds(const std::string& name) const;
  [[nodiscard]] ArvGcNode* node(const std::string& name) const;
  [[nodiscard]] Error noFeature(const std::string& name) const;
  ArvDevice* device_;
};

}  // namespace toftwin::drivers::aravis
