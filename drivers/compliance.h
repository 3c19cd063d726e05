// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/source.h"

/// What every camera must do, whatever its driver. One suite for all: the tests run it on every
/// camera that a driver of this build lists, and a new driver is done when it passes.
namespace toftwin::drivers {

/// A camera to be checked: the keys of its [[source]] table as TOML, and those of one that is not
/// there together with the text by which an error must name it.
struct Candidate {
  const Driver* driver = nullptr;
  std::string keys;
  std::string absent_keys;
  std::string absent_name;
};
/// The candidate for a camera that the driver lists.
Candidate listedCamera(const Driver& driver, const std::string& uri);

struct Finding {
  enum class Outcome { Passed, Failed, DoesNotApply };
  std::string_view check;    ///< the fact, in words
  std::string_view because;  ///< the failure that the check exists for
  Outcome outcome = Outcome::Passed;
  std::string detail;
};

struct ComplianceOptions {
  int frames = 5;                                  ///< looked at per check
  std::chrono::milliseconds frame_timeout{10000};  ///< a frame must come within this
  std::chrono::milliseconds stop_timeout{1000};    ///< a wait must end within this when asked
  std::function<void(const Finding&)> report{};    ///< told of each check when it is through
  std::function<bool()> interrupted{};             ///< asked between checks: whether to leave out the rest
};

/// Runs all checks, each on a camera opened for it.
std::vector<Finding> checkCompliance(const Candidate& camera,
                                     const ComplianceOptions& options = {});

}  // namespace toftwin::drivers
