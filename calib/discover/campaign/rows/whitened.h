// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "calib/discover/campaign/captures/light_delay.h"
#include "calib/discover/campaign/rows/cells.h"

namespace toftwin::discover {

/// Offset and gain of all captures; what moved the camera and its light at each: columns 0 to
/// kCommon − 1.
std::vector<Group> commonGroups();
inline constexpr std::size_t kCommon = 8;

/// Columns and residuals of one capture, whitened.
struct WhitenedCapture {
  WhitenedCapture() = default;
  WhitenedCapture(const Cells& cells, std::size_t columns);
  std::array<Eigen::MatrixXf, kChannels> columns{};
  std::array<Eigen::VectorXf, kChannels> residual{};

  void putCommon(const Cells& cells, const TracedCapture& traced);
  /// Measured minus simulated at the pose as it was told: what the place where the light was traced
  /// changes is, to first order, taken back. putCommon must have been called.
  void putResidual(const Cells& cells, const MeasuredCapture& capture, const TracedCapture& traced,
                   const Reading& simulated);
  /// What is left of `residual` when the simulation says `to` instead of `from`.
  void putResidual(const Cells& cells, const std::array<Eigen::VectorXf, kChannels>& residual_before,
                   const Reading& from, const Reading& to);
  void put(const Cells& cells, std::size_t column, const Reading& change);
  void putChange(const Cells& cells, std::size_t column, const Reading& from, const Reading& to);
  /// Column kCommon: what a millimetre of delay in the light changes, beyond an offset, which is free
  /// already. `to`: with light that is late by kDelay_mm. putCommon must have been called.
  void putDelay(const Cells& cells, const Reading& from, const Reading& to);
  [[nodiscard]] CaptureEvidence evidence(std::string name, std::string block) const;
};

}  // namespace toftwin::discover
