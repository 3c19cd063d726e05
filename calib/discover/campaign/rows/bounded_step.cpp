// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/rows/bounded_step.h"

#include <algorithm>

namespace toftwin::discover {
namespace {

/// How far each number may go, in units of its step.
struct Room {
  double least = 0.0, most = 0.0;
};
Room roomOf(const sim::AnyEffect& effect, const FreeNumber& one) {
  const auto numbers = numbersOf(effect);
  const auto found = std::ranges::find(numbers, one.key, &EffectNumber::key);
  const double down = (found->low - found->value) / one.step, up = (found->high - found->value) / one.step;
  return {std::min(down, up), std::max(down, up)};
}

}  // namespace

BoundedStep boundedStep(const std::vector<sim::AnyEffect>& effects, const std::vector<FreeNumber>& free,
                        const NormalEquations& at, double damping) {
  BoundedStep step{.change = Eigen::VectorXd::Zero(at.moment.size())};
  Eigen::MatrixXd damped = at.gram;
  damped.diagonal() *= 1.0 + damping;
  std::vector<Room> rooms;
  for (const FreeNumber& one : free) rooms.push_back(roomOf(effects[one.place], one));
  std::vector<Eigen::Index> inside;
  for (Eigen::Index i = 0; i < at.moment.size(); ++i) inside.push_back(i);
  for (std::size_t before = inside.size() + 1; inside.size() < before;) {  // ends: each round has fewer
    before = inside.size();
    const Eigen::VectorXd moment = at.moment - damped * step.change + damped(Eigen::all, inside) * step.change(inside);
    step.change(inside) = pseudoInverse(damped(inside, inside), 1e-7).inverse * moment(inside);
    std::erase_if(inside, [&](Eigen::Index i) {
      const Room& room = rooms[static_cast<std::size_t>(i)];
      const double bounded = std::clamp(step.change[i], room.least, room.most);
      const bool leaves = bounded != step.change[i];
      step.change[i] = bounded;
      return leaves;
    });
  }
  step.promised = 2.0 * step.change.dot(at.moment) - step.change.dot(at.gram * step.change);
  return step;
}

}  // namespace toftwin::discover
