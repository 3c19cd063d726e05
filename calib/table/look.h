// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace toftwin::table {

/// What one field looks like, before it is known what its column holds.
enum class Look { Nothing, Number, Time, Text };
Look lookOf(std::string_view field);

inline bool isValue(Look look) { return look == Look::Number || look == Look::Time; }

}  // namespace toftwin::table
