// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <toftwin/result.h>

#include "calib/compare/json.h"

namespace toftwin::compare {

/// A JSON text (RFC 8259) as a value; of a key that comes twice the last counts. Errors Malformed say at
/// which byte: anything that is not JSON, values nested deeper than 64, numbers that are no finite double.
Result<Json> parseJson(std::string_view text);

}  // namespace toftwin::compare
