// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

namespace toftwin::daemon {

/// While it lives, what libraries print comes into the log, line by line, and never has to wait for whoever reads that:
/// standard output and error are a pipe which a thread of its own empties. One at a time.
class OwnOutput {
 public:
  OwnOutput();
  ~OwnOutput();
  OwnOutput(const OwnOutput&) = delete;
  OwnOutput& operator=(const OwnOutput&) = delete;

 private:
  struct State;
  std::unique_ptr<State> state_;  ///< null: they stay what they were
};

}  // namespace toftwin::daemon
