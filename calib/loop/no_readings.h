// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/loop/evidence.h"

namespace toftwin::loop {

/// Why a row measures nothing.
enum class NoReading : unsigned char {
  None,     ///< it does
  Stuck,    ///< the same values whatever the reference
  Wrapped,  ///< too short by the length after which the camera begins anew
  Far,      ///< farther from all others than these are from each other by several times
  Jumped,   ///< off by about one same length, now and then
};

/// Rows of one kind.
struct NoReadings {
  NoReading kind = NoReading::None;
  std::vector<Eigen::Index> rows{};
  double low = 0.0, high = 0.0;  ///< Stuck: the measured values; Wrapped: the length; Far, Jumped: size of the errors
  int side = 0;                  ///< Jumped: 1 or −1 where all are too high or too low; 0: to either side
};

/// Rows that are far from what a robust, flexible model says of all others, with a gap between them and the rest; unless something
/// in the table says which rows those are: then it is an effect. `measured` may be empty.
std::vector<NoReadings> findNoReadings(const Evidence& evidence, const Eigen::VectorXd& measured);

/// Rows that jump: residuals over their sigma have, beside a core, a part at one distance to one side or either, and heavy tails do not
/// explain that.
NoReadings findJumps(const Evidence& evidence, const Eigen::VectorXd& residual);

}  // namespace toftwin::loop
