// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <utility>

#include "calib/intrinsics/coverage.h"

namespace toftwin::cli {

/// What a person who holds the board is told. Said again only when it changes.
class Prompter {
 public:
  /// The clock, and where it is said; others only in tests.
  using Now = std::function<std::chrono::steady_clock::time_point()>;
  using Say = std::function<void(const std::string&)>;
  explicit Prompter(Say say, Now now = std::chrono::steady_clock::now) : say_(std::move(say)), now_(std::move(now)) {}

  void tell(const intrinsics::Guidance& guidance);
  void sayOnce(const std::string& text);
  /// Why what is there now is not taken: when it has been so for a second, as a board that is brought elsewhere is
  /// blurred, moving and out of the image on its way.
  void whyNot(const std::string& why);

 private:
  Say say_;
  Now now_;
  std::string said_, why_, why_said_;
  std::chrono::steady_clock::time_point since_{};
};

/// Which search a frame gets. Where squares are of ten pixels the quick one misses most boards that the thorough one
/// finds, which takes a second. After so many misses in a row it is tried.
class Searches {
 public:
  static constexpr int kMissesUntilThorough = 3;
  [[nodiscard]] bool isThorough() const { return misses_ >= kMissesUntilThorough; }
  /// What the search of a frame came to. Whether that is so: that nothing is seen is not, when the quick search says it
  /// alone.
  bool add(const intrinsics::Sighting& sighting);
  /// The quick search is to be tried again.
  void beginAnew() { misses_ = 0; }

 private:
  int misses_ = 0;
  bool has_missed_ = false;  ///< the last thorough one
};

}  // namespace toftwin::cli
