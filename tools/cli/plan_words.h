// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calib/plan/check.h"

/// What the commands `plan` and `measure` say of a plan.
namespace toftwin::cli {

/// "standard: 102 captures of 10 frames each, 63 min, of which 20 min to prepare 10 blocks".
std::string howLong(const plan::Plan& plan, const plan::Schedule& schedule);
/// Remarks, a line or two each, those that refuse first; and the verdict.
std::string inWords(const plan::Check& check);

}  // namespace toftwin::cli
