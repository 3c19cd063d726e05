// SPDX-License-Identifier: Apache-2.0
// What a person who holds a calibration board before the camera is told.
#include "tools/cli/prompter.h"

#include <gmock/gmock.h>

#include <vector>

namespace toftwin::cli {
namespace {

using intrinsics::Rejection;
using std::chrono::milliseconds;
using testing::ElementsAre;

class Prompts : public testing::Test {
 protected:
  void whyNotFor(const std::string& why, milliseconds time) {
    for (const auto end = now_ + time; now_ < end; now_ += milliseconds{33}) prompter_.whyNot(why);
  }
  std::vector<std::string> said_;
  std::chrono::steady_clock::time_point now_{};
  Prompter prompter_{[this](const std::string& text) { said_.push_back(text); }, [this] { return now_; }};
};

TEST_F(Prompts, SayOnceWhyNotAndOnlyWhenItIsSoForASecond) {
  whyNotFor("moves", milliseconds{900});
  whyNotFor("small", milliseconds{900});
  EXPECT_THAT(said_, ElementsAre());
  whyNotFor("small", milliseconds{2'000});
  EXPECT_THAT(said_, ElementsAre("  not taken: small\n"));
}

/// Moved, held still and taken, moved on at once: the second began anew.
TEST_F(Prompts, DoNotComplainOfAMoveAwayFromAViewThatWasTaken) {
  whyNotFor("moves", milliseconds{1'500});
  prompter_.sayOnce("one view\n");
  whyNotFor("moves", milliseconds{900});
  EXPECT_THAT(said_, ElementsAre("  not taken: moves\n", "one view\n"));
  whyNotFor("moves", milliseconds{300});
  EXPECT_EQ(said_.size(), 3u);
}

/// A small board: the quick search sees nothing, the thorough one that it is too small. At 30 frames a second that is
/// one reason, not two by turns.
TEST_F(Prompts, SayWhatTheThoroughSearchSeesOfASmallBoard) {
  Searches searches;
  const auto look = [&](Rejection thorough, milliseconds time) {
    for (const auto end = now_ + time; now_ < end; now_ += milliseconds{33}) {
      intrinsics::Sighting sighting;
      sighting.rejection = searches.isThorough() ? thorough : Rejection::NotFound;
      if (searches.add(sighting)) prompter_.whyNot(sighting.rejection == Rejection::NotFound ? "none" : "small");
    }
  };
  look(Rejection::TooSmall, milliseconds{1'500});
  EXPECT_THAT(said_, ElementsAre("  not taken: small\n"));
  look(Rejection::NotFound, milliseconds{1'500});
  EXPECT_THAT(said_, ElementsAre("  not taken: small\n", "  not taken: none\n"));
}

}  // namespace
}  // namespace toftwin::cli
