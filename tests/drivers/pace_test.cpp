// SPDX-License-Identifier: Apache-2.0
#include "drivers/pace.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace toftwin::drivers {
namespace {

using namespace std::chrono_literals;

std::uint64_t turnOf(Pacer& pacer) {
  const auto lost = pacer.waitForTurn({}, false);
  if (!lost) ADD_FAILURE() << lost.error().message;
  return lost ? *lost : 0;
}

TEST(Pacer, CountsTurnsThatPassedWhileAFrameWasMade) {
  Pacer pacer{Pace::RealTime, 20_ms};
  EXPECT_EQ(turnOf(pacer), 0u);
  EXPECT_EQ(pacer.index(), 0u);
  std::this_thread::sleep_for(75ms);
  pacer.advance();
  const std::uint64_t lost = turnOf(pacer);
  EXPECT_GE(lost, 2u);
  EXPECT_EQ(pacer.index(), 1 + lost);
  EXPECT_EQ(pacer.deviceTime().ns, static_cast<std::int64_t>(1 + lost) * 20'000'000);
}

/// What was lost is said with the chosen frame, which is not lost however long it takes from then on.
TEST(Pacer, KeepsTheTurnThatWasChosen) {
  Pacer pacer{Pace::RealTime, 20_ms};
  EXPECT_EQ(turnOf(pacer), 0u);
  std::this_thread::sleep_for(75ms);
  const DeviceTime chosen = pacer.chooseNext();
  EXPECT_GE(chosen.ns, 60'000'000);
  EXPECT_EQ(pacer.index(), 0u) << "the present frame is not made yet";
  std::this_thread::sleep_for(65ms);
  pacer.advance();
  EXPECT_EQ(pacer.deviceTime().ns, chosen.ns);
  const std::uint64_t lost = turnOf(pacer);
  EXPECT_EQ(static_cast<std::int64_t>(lost + 1) * 20'000'000, chosen.ns);
  EXPECT_EQ(pacer.deviceTime().ns, chosen.ns);
  pacer.advance();
  EXPECT_GE(turnOf(pacer), 1u) << "the next one was not chosen";
}

TEST(Pacer, LosesAChosenTurnThatIsASecondLate) {
  Pacer pacer{Pace::RealTime, 20_ms};
  turnOf(pacer);
  pacer.chooseNext();
  pacer.advance();
  std::this_thread::sleep_for(1100ms);
  EXPECT_GE(turnOf(pacer), 50u);
}

TEST(Pacer, ForgetsTheChosenTurnWhenItStartsAnew) {
  Pacer pacer{Pace::RealTime, 20_ms};
  turnOf(pacer);
  std::this_thread::sleep_for(75ms);
  pacer.chooseNext();
  pacer.advance();
  const std::uint64_t index = pacer.index();
  pacer.restart();
  EXPECT_EQ(turnOf(pacer), 0u);
  EXPECT_EQ(pacer.index(), index);
}

TEST(Pacer, LosesNothingWhereNobodyWaits) {
  Pacer pacer{Pace::Fast, 20_ms};
  EXPECT_EQ(turnOf(pacer), 0u);
  std::this_thread::sleep_for(50ms);
  EXPECT_EQ(pacer.chooseNext().ns, 20'000'000);
  pacer.advance();
  EXPECT_EQ(turnOf(pacer), 0u);
  EXPECT_EQ(pacer.index(), 1u);
}

}  // namespace
}  // namespace toftwin::drivers
