// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/rows/bounded_step.h"

#include <gtest/gtest.h>

namespace toftwin::discover {
namespace {

/// Two numbers of an effect that go together, and where they would have to go: to (2, 3) steps.
struct Pulled {
  std::vector<sim::AnyEffect> effects{sim::LensGhost{}};
  std::vector<FreeNumber> free{{0, "right_px", 1.0}, {0, "down_px", 1.0}};
  NormalEquations at{};
  Pulled() {
    at.gram = (Eigen::Matrix2d{} << 4.0, 1.0, 1.0, 2.0).finished();
    at.moment = at.gram * Eigen::Vector2d{2.0, 3.0};
  }
  /// Puts a number so far below its highest.
  void leave(const std::string& key, double room) {
    for (const EffectNumber& one : numbersOf(effects[0]))
      if (one.key == key) effects[0] = withNumber(effects[0], key, one.high - room);
  }
};

TEST(BoundedStep, IsGaussAndNewtonsWhereThereIsRoom) {
  const Pulled pulled;
  const BoundedStep step = boundedStep(pulled.effects, pulled.free, pulled.at, 0.0);
  EXPECT_NEAR(step.change[0], 2.0, 1e-12);
  EXPECT_NEAR(step.change[1], 3.0, 1e-12);
  EXPECT_NEAR(step.promised, pulled.at.moment.dot(step.change), 1e-12);
}

/// min 4x² + 2xy + 2y² − 2 mᵀ(x, y) at x = 1 is y = (8 − 1)/2.
TEST(BoundedStep, SolvesTheOthersAgainWhereOneEndsAtItsBound) {
  Pulled pulled;
  pulled.leave("right_px", 1.0);
  const BoundedStep step = boundedStep(pulled.effects, pulled.free, pulled.at, 0.0);
  EXPECT_NEAR(step.change[0], 1.0, 1e-9);
  EXPECT_NEAR(step.change[1], 3.5, 1e-9);
  const double promised = 2.0 * (11.0 * 1.0 + 8.0 * 3.5) - (4.0 + 2.0 * 3.5 + 2.0 * 3.5 * 3.5);
  EXPECT_NEAR(step.promised, promised, 1e-6);
}

TEST(BoundedStep, PromisesNothingOfWhatIsAtItsBound) {
  Pulled pulled;
  pulled.leave("right_px", 0.0), pulled.leave("down_px", 0.0);
  const BoundedStep step = boundedStep(pulled.effects, pulled.free, pulled.at, 0.0);
  EXPECT_EQ(step.change.norm(), 0.0);
  EXPECT_EQ(step.promised, 0.0);
  pulled.free[0].step = -1.0;  // bounds are the number's, whichever way a step goes
  pulled.at.moment[0] = -pulled.at.moment[0], pulled.at.gram(0, 1) = pulled.at.gram(1, 0) = -1.0;
  EXPECT_EQ(boundedStep(pulled.effects, pulled.free, pulled.at, 0.0).change.norm(), 0.0);
}

}  // namespace
}  // namespace toftwin::discover
