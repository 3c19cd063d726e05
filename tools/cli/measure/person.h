// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/plan/take.h"

namespace toftwin::cli {

/// Somebody at the terminal, who presses Enter when it is done.
class PersonAtTerminal final : public plan::Person {
 public:
  /// EndOfStream: q, or the end of the input. Stopped: Ctrl-C.
  Result<> doThis(const std::string& what) override;
};

/// Everything stands there and is set already; says what was taken for done.
class EverythingPrepared final : public plan::Person {
 public:
  Result<> doThis(const std::string& what) override;
};

}  // namespace toftwin::cli
