// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calib/intrinsics/target.h"
#include "tools/cli/arguments.h"

namespace toftwin::cli {

/// --board or --tags, --square, --marker, --dictionary: the board that was put before a camera.
struct BoardOptions {
  void add(Arguments& args);
  /// An Error of the command line: what is missing, or what such a board cannot be.
  [[nodiscard]] Result<> check() const;
  [[nodiscard]] intrinsics::BoardWords words() const;

 private:
  std::string corners_, tags_, dictionary_;
  double square_mm_ = 0.0, marker_mm_ = 0.0;
};

}  // namespace toftwin::cli
