// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <span>

namespace toftwin::compare {

/// What a model with parameters p says of a row.
using Model = std::function<double(std::span<const double> p, std::size_t row)>;

}  // namespace toftwin::compare
