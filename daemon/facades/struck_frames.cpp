// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/struck_frames.h"

#include <fmt/format.h>

#include <chrono>

namespace toftwin::daemon {
namespace {

using Kind = LineFaults::Kind;

/// That wait for their time; more of them leave at once.
constexpr std::size_t kMostWaitingFrames = 64;
/// A late one waits so long for the next.
constexpr std::chrono::seconds kLatePatience{2};

}  // namespace

void StruckFrames::take(const Frame& frame) {
  if (faults_.isNone()) return static_cast<void>(put_(frame, {}));
  Struck one{frame, faults_.next(), fmt::format("frame {}", frame.sequence)};
  if (one.fate.is_lost) return note(one, Kind::Loss);
  if (one.fate.is_late && !late_) return hold(std::move(one));
  leave(one);
}

void StruckFrames::hold(Struck late) {
  late_ = std::move(late);
  patience_.expires_after(kLatePatience);
  patience_.async_wait([this, alive = is_alive_](boost::system::error_code cancelled) {
    if (cancelled || !*alive || !late_) return;
    leave(*std::exchange(late_, std::nullopt));
  });
}

void StruckFrames::leave(const Struck& one) {
  if (!one.fate.is_delayed || waiting_ >= kMostWaitingFrames) return put(one);
  const std::chrono::duration<double> time{delay_.in(second)};
  auto timer = std::make_shared<boost::asio::steady_timer>(
      io_, std::chrono::duration_cast<std::chrono::steady_clock::duration>(time));
  ++waiting_;
  Struck later = one;
  later.on_its_way.push_back(Kind::Delay);
  timer->async_wait(
      [this, timer, later = std::move(later), alive = is_alive_](boost::system::error_code cancelled) {
        if (!*alive) return;
        --waiting_;
        if (!cancelled) put(later);
      });
}

/// The only way out. What was late comes behind the first that is after it.
void StruckFrames::put(const Struck& one) {
  if (!putStruck(one) || !late_ || late_->fate.packet > one.fate.packet) return;
  patience_.cancel();
  Struck late = *std::exchange(late_, std::nullopt);
  late.on_its_way.push_back(Kind::Reorder);
  leave(late);
}

bool StruckFrames::putStruck(const Struck& one) {
  Damage damage;
  damage.is_cut = one.fate.is_cut;
  if (one.fate.is_corrupted) damage.noise = one.fate.noise;
  if (!put_(one.frame, damage)) return false;
  for (const Kind kind : one.on_its_way) note(one, kind);
  if (one.fate.is_cut) note(one, Kind::Disconnect);
  if (one.fate.is_corrupted) note(one, Kind::Corruption);
  if (one.fate.is_doubled && put_(one.frame, damage)) note(one, Kind::Duplicate);
  return true;
}

}  // namespace toftwin::daemon
