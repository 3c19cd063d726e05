// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/loop/discovery.h"

namespace toftwin::loop {

/// What came out, in a metrologist's words and order.
struct Answer {
  enum class Tone { Good, Fair, Open };
  /// Good only where the raw errors are within what repeats scatter by; Open where something stands out that no shape predicts.
  Tone tone = Tone::Fair;
  std::string headline{};               ///< the ladder in one sentence
  std::string removed{};                ///< the share that the model takes off, with its interval; empty where nobody knows
  std::vector<std::string> effects{};   ///< a sentence for each
  std::vector<std::string> readings{};  ///< what was set aside, and what its share goes with
  std::vector<std::string> cautions{};  ///< what cannot be told from this table, and what would tell it
};
Answer answerOf(const Discovery& discovery);

/// A length or another value with its unit and as many digits as a person reads: "31.6 mm", "0.42".
std::string quantityText(double value, const std::string& unit);
/// One sentence: "speed_m_per_s: a latency of 79 ms (straight line, −78.5 mm per m/s)."
std::string sentenceOf(const Discovery& discovery, const Effect& effect);
/// What is told of an effect, above its mean, at each open row: of effects that take each other back not their terms, but toldOf().
Eigen::VectorXd curveOf(const Discovery& discovery, const Effect& effect);
/// How an effect of the mean is told; null of others.
const Told* toldOf(const Discovery& discovery, const Effect& effect);

}  // namespace toftwin::loop
