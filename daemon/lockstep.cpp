// SPDX-License-Identifier: Apache-2.0
// What lockstep subscribers may ask of a source that others watch, too.
#include <fmt/format.h>

#include <algorithm>

#include "daemon/source_host.h"
#include "drivers/logging.h"

namespace toftwin::daemon {
namespace {

bool isLockstep(const SubscriberPtr& one) { return one->wish.backlog.policy == wire::Policy::Lockstep; }

/// Subscriptions of one client share its account; there is no other client without one.
bool areOfOneClient(const Subscriber& a, const Subscriber& b) {
  const auto& account = a.wish.backlog.account;
  return &a == &b || (account && account == b.wish.backlog.account);
}

}  // namespace

bool SourceHost::hasLockstep() const {
  return std::ranges::any_of(
      subscribers_, [](const SubscriberPtr& one) { return isLockstep(one) && !one->is_passed_over; });
}

bool SourceHost::mayMakeFrame() const {
  return isWanted() && std::ranges::none_of(subscribers_, [](const SubscriberPtr& one) {
           return one->unacknowledged.has_value() && !one->is_passed_over;
         });
}

/// Whether another client wants a frame that `holder` keeps from it.
bool SourceHost::isWaitedFor(const Subscriber& holder) const {
  return std::ranges::any_of(subscribers_, [&](const SubscriberPtr& other) {
    return !areOfOneClient(*other, holder) && !other->unacknowledged.has_value() && !other->backlog.hasEnded();
  });
}

/// When the next lockstep subscriber has kept others waiting for as long as it may.
std::optional<SteadyTime> SourceHost::nextPassingOver() const {
  std::optional<SteadyTime> next;
  for (const SubscriberPtr& one : subscribers_) {
    if (!one->unacknowledged || one->is_passed_over || !isWaitedFor(*one)) continue;
    const SteadyTime due = one->handed_out + one->wish.who.lockstep_patience;
    next = next ? std::min(*next, due) : due;
  }
  return next;
}

/// The source goes on without them, until they acknowledge.
void SourceHost::passOverTheLate() {
  const SteadyTime now = clock_.steady();
  for (const SubscriberPtr& one : subscribers_) {
    if (!one->unacknowledged || one->is_passed_over || !isWaitedFor(*one)) continue;
    const std::chrono::duration<double> patience = one->wish.who.lockstep_patience;
    if (now - one->handed_out < one->wish.who.lockstep_patience) continue;
    one->is_passed_over = true;
    logging::warn("{}: goes on without {}, which has not acknowledged frame {} for {} s of lockstep (limits.lockstep_s)",
                  name_, one->wish.who.text, *one->unacknowledged, patience.count());
  }
}

/// Those of one user run a source as fast as they like. Where somebody else watches, too, frames come no faster than the
/// source's own: when the next may be begun.
std::optional<SteadyTime> SourceHost::paceOfOthers() const {
  if (!info_ || !info_->frame_interval) return std::nullopt;
  const auto holder = std::ranges::find_if(
      subscribers_, [](const SubscriberPtr& one) { return isLockstep(one) && !one->is_passed_over; });
  if (holder == subscribers_.end()) return std::nullopt;
  const std::string& name = (*holder)->wish.who.name;
  const bool is_alone = std::ranges::all_of(
      subscribers_, [&](const SubscriberPtr& other) { return isLockstep(other) || other->wish.who.name == name; });
  if (is_alone) return std::nullopt;
  const std::chrono::duration<double> interval{info_->frame_interval->in(second)};
  return last_begun_ + std::chrono::duration_cast<SteadyTime::duration>(interval);
}

std::string SourceHost::lockstepHolder() const {
  const auto holder = std::ranges::find_if(subscribers_, isLockstep);
  if (holder == subscribers_.end()) return {};
  const Subscriber& one = **holder;
  if (one.is_passed_over) return one.wish.who.text + ", which others do not wait for any more";
  if (!one.unacknowledged) return one.wish.who.text;
  const std::chrono::duration<double> waited = clock_.steady() - one.handed_out;
  return fmt::format("{}, waited for since {:.1f} s", one.wish.who.text, waited.count());
}

}  // namespace toftwin::daemon
